//! What happens in an inspection, as one stream of events: the only way in which anything outside learns of it.
//!
//! An event is plain data that serialises, so that a history can be stored and replayed. Beside its data an event may carry
//! what it speaks of (the view with its pictures, the model) while that is at hand; this part does not serialise, and an
//! event that was read back is without it.

use crate::source::Turntable;
use jiff::Timestamp;
use semascan_model::finding::FindingsRecord;
use semascan_model::record::{
    Outcome, PhotometricRecord, PlanCoverage, PlanStop, PlannedView, RefinementRecord, Stage, ViewPose, ViewRecord,
};
use semascan_model::{InspectionId, ModelFigures, Taxonomy};
use semascan_perception::fuse::{SemanticMap, TouchedChunk};
use semascan_perception::register::Registration;
use semascan_perception::segment::Segmentation;
use semascan_perception::view::View;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Something that happened in an inspection.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct InspectionEvent {
    /// The inspection.
    pub inspection: InspectionId,
    /// Place in the inspection's history, from 0 without gaps.
    pub sequence: u64,
    /// When it was published (UTC).
    pub time: Timestamp,
    /// What happened.
    pub kind: EventKind,
}

/// What happened.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum EventKind {
    /// The inspection began.
    Started {
        /// The part, for people.
        part: String,
        /// The source's URI or path.
        source: String,
        /// Classes of the labels.
        taxonomy: Taxonomy,
        /// Number of views if known.
        views_expected: Option<u32>,
        /// The turntable, if there is one.
        turntable: Option<Turntable>,
    },
    /// The next view was planned: it will be taken from there.
    Planned {
        /// From where, and why.
        view: Box<PlannedView>,
    },
    /// No more views are planned.
    PlanEnded {
        /// Why.
        why: PlanStop,
        /// What was covered; absent where the planner does not look at the model.
        coverage: Option<Box<PlanCoverage>>,
    },
    /// A stage of a view began, ended or failed.
    Stage {
        /// The view, in the capture order.
        view: u32,
        /// The stage.
        stage: Stage,
        /// How it stands.
        status: StageStatus,
    },
    /// The model changed.
    ModelChanged {
        /// Grows with every rebuild of the map; from 1.
        epoch: u32,
        /// Voxel edge in metres.
        voxel: f64,
        /// The view that changed it; absent where all of them did.
        view: Option<u32>,
        /// Chunks that changed, in address order.
        touched: Vec<TouchedChunk>,
        /// Whether this is the final model: all views are in, poses are refined, outliers are marked.
        complete: bool,
        /// The model as it is now: it may have changed further.
        #[serde(skip)]
        model: Option<SharedModel>,
    },
    /// A view is through all stages, one way or the other.
    ViewFinished {
        /// What became of it.
        record: Box<ViewRecord>,
        /// The view with its pictures, labels and pose; absent where it could not be acquired.
        #[serde(skip)]
        view: Option<Arc<ProcessedView>>,
    },
    /// All views have new poses; the model that follows is made with them.
    Refined {
        /// `table_from_camera` of every accepted view.
        poses: Vec<ViewPose>,
        /// How the refinement went.
        refinement: RefinementRecord,
    },
    /// The final model was meshed and measured.
    Measured {
        /// Its figures.
        figures: Box<ModelFigures>,
    },
    /// The final model was searched for defects.
    Found {
        /// What was found.
        findings: Box<FindingsRecord>,
    },
    /// The final poses were compared with the pictures.
    Judged {
        /// How well they agree.
        photometric: Box<PhotometricRecord>,
    },
    /// The inspection is over; nothing comes after this.
    Ended {
        /// How it ended.
        outcome: Outcome,
    },
}

/// How a stage of one view stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum StageStatus {
    /// It began.
    Started,
    /// It ended well.
    Finished {
        /// Time it took.
        seconds: f64,
    },
    /// It failed.
    Failed {
        /// Why.
        reason: String,
    },
}

/// One view on its way: the capture, and what the stages have added to it. Nothing in it is copied on the way.
#[derive(Clone, Debug)]
pub struct ProcessedView {
    /// The capture.
    pub view: View,
    /// Its labels, once it was segmented.
    pub segmentation: Option<Segmentation>,
    /// Its pose, once it was registered.
    pub registration: Option<Registration>,
}

/// The model of a running inspection, for readers. The inspection waits while it is read: copy what is wanted and let go.
#[derive(Clone, Debug)]
pub struct SharedModel(Arc<RwLock<SemanticMap>>);

impl SharedModel {
    pub(crate) fn new(map: SemanticMap) -> Self {
        Self(Arc::new(RwLock::new(map)))
    }

    /// The model as it is now.
    pub fn read(&self) -> RwLockReadGuard<'_, SemanticMap> {
        // A map changes a view at a time or not at all, so that it is whole even after a panic.
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn write(&self) -> RwLockWriteGuard<'_, SemanticMap> {
        self.0.write().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::FeatureFigures;

    #[test]
    fn a_history_is_written_and_read_back_without_pictures_and_model() {
        let inspection = InspectionId::new(1_700_000_000_000, &[7; 10]);
        let map = SemanticMap::new(semascan_perception::fuse::MapConfig::new(0.001, 2, 1)).expect("right settings");
        let kinds = [
            EventKind::Started {
                part: "motor".into(),
                source: "virtual:starter-motor".into(),
                taxonomy: Taxonomy::from_names(&["gear"], &["wear"]),
                views_expected: Some(5),
                turntable: Some(Turntable { radius: 0.2, height: 0.0 }),
            },
            EventKind::Stage { view: 0, stage: Stage::Fuse, status: StageStatus::Finished { seconds: 0.25 } },
            EventKind::ModelChanged {
                epoch: 1,
                voxel: 0.001,
                view: Some(0),
                touched: vec![TouchedChunk { id: [1, -2, 3], made: 4, relabelled: 5 }],
                complete: false,
                model: Some(SharedModel::new(map)),
            },
            EventKind::Measured {
                figures: Box::new(ModelFigures {
                    components: vec![FeatureFigures {
                        id: 1,
                        component: 1,
                        area: Some(1e-4),
                        ..FeatureFigures::default()
                    }],
                    ..ModelFigures::default()
                }),
            },
            EventKind::Ended { outcome: Outcome::Failed { reason: "no view could be used".into() } },
        ];
        for (sequence, kind) in (0..).zip(kinds) {
            let time = Timestamp::from_second(1_700_000_000).expect("in range");
            let event = InspectionEvent { inspection, sequence, time, kind };
            let text = serde_json::to_string(&event).expect("plain data");
            let back: InspectionEvent = serde_json::from_str(&text).expect("its own");
            assert_eq!(serde_json::to_string(&back).expect("plain data"), text);
            assert!(!matches!(back.kind, EventKind::ModelChanged { model: Some(_), .. }), "{text}");
        }
    }
}
