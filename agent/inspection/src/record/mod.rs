//! The record of an inspection: a subscriber that makes it ([`Recorder`]), and how what perception reports becomes plain
//! data. The record itself, `inspection.json`, is `semascan_model::record`.

mod conversions;
mod recorder;

pub use conversions::{isometry, photometric_record, pose_record};
pub(crate) use conversions::{
    misidentification_record, refinement_record, registration_record, rows, view_networks_record,
};
pub use recorder::{Recorded, Recorder, TruePoses};
