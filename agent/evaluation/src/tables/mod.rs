//! The papers' tables, rerun on the virtual cell.

mod frozen_threshold;
pub mod p0;
pub mod p1;
pub mod p2;
mod setting;

pub use frozen_threshold::{FrozenThreshold, ValidationPoint, freeze};
pub use setting::{DomainScores, NetworkSetting, Progress};

use semascan_inspection::pipeline::{InspectionSink, Stage, StageStatus, ViewOutcome};
use semascan_perception::fuse::{SemanticMap, TouchedChunk};
use semascan_perception::register::JointRefinement;

/// Nobody watches an inspection; views that are left out go to the log.
struct Silent;

impl InspectionSink for Silent {
    fn stage(&self, _view: u32, _stage: Stage, _status: &StageStatus) {}

    fn map_changed(&self, _map: &SemanticMap, _touched: &[TouchedChunk], _last: bool) {}

    fn view_done(&self, outcome: &ViewOutcome) {
        if let Err(reason) = &outcome.result {
            tracing::warn!("view {} left out: {reason}", outcome.index);
        }
    }

    fn refined(&self, _views: &[u32], _refinement: &JointRefinement) {}
}
