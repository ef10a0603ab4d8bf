//! Figures of the findings that people draw, measured on the model when their review is taken in. They stand in its entry, so
//! that everything else follows from the log, as it does of other reviews.

use super::{ReviewDesk, rules};
use crate::findings::{DrawnOn, measure_drawn};
use crate::ports::PortError;
use semascan_model::record::{ClassSummary, InspectionRecord, Outcome};
use semascan_model::review::{DrawnFigures, Review, ReviewAction};

impl ReviewDesk {
    /// What the model says of the finding that `review` draws; `None` where it draws none, or is not taken in.
    ///
    /// # Errors
    /// [`PortError`] that names the model or capture that cannot be read.
    pub(super) fn measured(
        &self,
        record: &InspectionRecord,
        review: &Review,
    ) -> Result<Option<DrawnFigures>, PortError> {
        let ReviewAction::NewFinding { outline, component, defect } = &review.action else { return Ok(None) };
        let class = |classes: &[ClassSummary], name: &str| classes.iter().find(|c| c.name == name).map(|c| c.class);
        let (Some(component), Some(defect)) = (
            class(&record.components, component),
            defect.as_deref().map_or(Some(0), |defect| class(&record.defects, defect)),
        ) else {
            return Ok(None);
        };
        // What is refused, or was taken in before, is not measured.
        if record.outcome == Outcome::Running
            || rules::check_outline("action.outline", outline).is_err()
            || self.log.entry(review.id)?.is_some()
        {
            return Ok(None);
        }
        let nothing = |reason: &str| Ok(Some(DrawnFigures { note: Some(reason.into()), ..DrawnFigures::default() }));
        let Some(models) = &self.models else { return nothing("the model is not at hand") };
        let (Some((_, mesh)), Some(voxel)) = (models.mesh(record.id)?, record.voxel) else {
            return nothing("the inspection has no mesh");
        };
        let on = DrawnOn { mesh: &mesh, voxel, record };
        measure_drawn(&on, outline, (component, defect), |each| models.depths(record, each)).map(Some)
    }
}
