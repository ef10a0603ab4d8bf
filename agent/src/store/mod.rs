//! Inspections on disk.

mod folder;
mod record;
mod recorder;
mod segmentation_record;

pub use folder::{StoreError, write as write_file, write_inspection, write_view_clouds};
pub use record::{
    AlignedRecord, ComponentTruth, IdealRecord, InspectionRecord, PoseRecord, SCHEMA_VERSION, SoftwareRecord,
    StageTime, TruthRecord, ViewRecord,
};
pub use recorder::Recorder;
pub use segmentation_record::{SegmentationRecord, ViewSegmentationRecord};
