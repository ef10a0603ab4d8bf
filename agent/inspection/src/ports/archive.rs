//! What is kept of inspections, read back.

use super::PortError;
use crate::Inspection;
use crate::criteria::CheckedCriteria;
use semascan_model::record::InspectionRecord;
use semascan_model::{InspectionId, SemanticCloud, SemanticMesh, Taxonomy};
use semascan_perception::fuse::KeptDepth;
use semascan_perception::view::View;
use std::io::Read;

/// A file of an inspection, opened.
pub struct ArchivedFile {
    /// Its content.
    pub content: Box<dyn Read + Send>,
    /// Its length.
    pub bytes: u64,
    /// SHA-256 of the content, hexadecimal, where it was noted.
    pub sha256: Option<String>,
}

/// What the inspection said of the pixels of a view, row-major.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PixelLabels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Component class of each pixel.
    pub components: Vec<u16>,
    /// Standard uncertainty of the component class, 255 = 1; absent where labels are certain.
    pub component_sigma: Option<Vec<u8>>,
    /// Defect class of each pixel.
    pub defects: Vec<u16>,
    /// Standard uncertainty of the defect class, 255 = 1; absent where labels are certain.
    pub defect_sigma: Option<Vec<u8>>,
    /// Instance of each pixel; 0 = not told apart.
    pub instances: Vec<u16>,
}

/// A captured view.
pub struct ArchivedView {
    /// The view as its source gave it, or why it could not.
    pub view: Result<View, String>,
    /// What the inspection said of its pixels; `None` where it did not come so far.
    pub labels: Option<PixelLabels>,
}

/// Reads what is kept. Every method fails with a [`PortError`] that names the file and the reason, and answers `None` where
/// there is no such thing.
#[allow(clippy::missing_errors_doc)]
pub trait Archive: Send + Sync {
    /// The record of an inspection as it was measured and judged.
    fn record(&self, id: InspectionId) -> Result<Option<InspectionRecord>, PortError>;

    /// A file of an inspection's set, by its name: `inspection.json` or one that the record names.
    fn file(&self, id: InspectionId, name: &str) -> Result<Option<ArchivedFile>, PortError>;

    /// The points of the final model and their classes, table frame.
    fn model(&self, id: InspectionId) -> Result<Option<(Taxonomy, SemanticCloud)>, PortError>;

    /// The mesh of the final model and its classes, table frame.
    fn mesh(&self, id: InspectionId) -> Result<Option<(Taxonomy, SemanticMesh)>, PortError>;

    /// Hands the depth of each captured view that is part of the model of `record`, at its pose, to `each`, in order. Says why
    /// some or all are not there; `None` where all are.
    fn depths(
        &self,
        record: &InspectionRecord,
        each: &mut dyn FnMut(&KeptDepth<'_>),
    ) -> Result<Option<String>, PortError>;

    /// The view with this number in the capture order of the inspection.
    fn view(&self, id: InspectionId, index: u32) -> Result<Option<ArchivedView>, PortError>;

    /// Whether something more can be kept: tried by writing a little and removing it again.
    fn writable(&self) -> Result<(), PortError>;

    /// The criteria whose text has this SHA-256, hexadecimal.
    fn criteria(&self, sha256: &str) -> Result<Option<CheckedCriteria>, PortError>;
}

/// Makes reports.
pub trait Reports: Send + Sync {
    /// `report.html` of an ended inspection with what people have decided until now; `None` where there is no such inspection
    /// or no record of it.
    ///
    /// # Errors
    /// [`PortError`] that names what cannot be read.
    fn html(&self, id: InspectionId) -> Result<Option<String>, PortError>;
}

/// Makes inspections again.
pub trait Remake: Send + Sync {
    /// An inspection of the captured views as it was made then, under the same identifier, ready to begin.
    ///
    /// # Errors
    /// [`PortError`] that names what is missing: the capture, a network.
    fn again(&self, id: InspectionId) -> Result<Inspection, PortError>;
}
