//! What a data folder keeps, for the server: its rows, files and reviews, and its inspections made again.

use super::report_html;
use semascan_inspection::Inspection;
use semascan_inspection::ports::{Archive, Catalogue, InspectionState, PortError, Remake, Reports};
use semascan_inspection::spec::InspectionSpec;
use semascan_model::InspectionId;
use semascan_server::Past;
use semascan_sources::mcap::McapSource;
use semascan_store::data::DataFolder;
use std::sync::Arc;

/// What `data` keeps.
pub(crate) fn past(data: &Arc<DataFolder>) -> Past {
    let catalogue = data.catalogue();
    let (captures, reports) = (FromCaptures(Arc::clone(data)), ReportsOf(Arc::clone(data)));
    Past::new(catalogue.clone(), data.clone(), catalogue.clone(), Arc::new(captures), Arc::new(reports))
}

/// Makes reports with the reviews of a data folder.
struct ReportsOf(Arc<DataFolder>);

impl Reports for ReportsOf {
    fn html(&self, id: InspectionId) -> Result<Option<String>, PortError> {
        let Some(record) = Archive::record(self.0.as_ref(), id)? else { return Ok(None) };
        let reviewed = report_html::reviewed(&self.0, &record)?;
        let folder = self.0.result_path(id);
        let html = report_html::of_folder(&folder, &record, Some(&reviewed));
        html.map(Some).map_err(|failure| PortError::new(folder.display(), failure.reason()))
    }
}

/// Makes inspections again from their captured views.
struct FromCaptures(Arc<DataFolder>);

impl Remake for FromCaptures {
    fn again(&self, id: InspectionId) -> Result<Inspection, PortError> {
        let place = || format!("inspection {id}");
        let row = self.0.catalogue().inspection(id)?;
        let row = row.ok_or_else(|| PortError::new(place(), "there is none"))?;
        let mut spec: InspectionSpec = serde_json::from_str(&row.spec)
            .map_err(|error| PortError::new(place(), format!("its settings cannot be read: {error}")))?;
        // Views that were captured and not inspected any more are not made part of it now.
        let was_cut = matches!(row.state, InspectionState::Stopped | InspectionState::Interrupted);
        let views = if was_cut && !spec.source.leaves_out() { row.views } else { u32::MAX };
        let path = self.0.capture_path(id);
        let source = McapSource::first_views(&path, views).map_err(|error| PortError::new(path.display(), error))?;
        // The pauses between captures are over.
        spec.source.pace_s = 0.0;
        let inspection = Inspection::new(spec, Box::new(source)).map_err(|error| PortError::new(place(), error))?;
        Ok(inspection.continuing(id, row.began))
    }
}
