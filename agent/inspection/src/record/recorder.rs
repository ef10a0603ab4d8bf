//! A subscriber that makes the record of an inspection from its events.

use super::isometry;
use crate::event::{EventKind, InspectionEvent};
use jiff::Timestamp;
use nalgebra::Isometry3;
use semascan_model::finding::FindingsRecord;
use semascan_model::record::{
    Outcome, PhotometricRecord, PlanCoverage, PlanStop, PlannedView, RefinementRecord, ViewRecord,
};
use semascan_perception::view::PoseEvidence;

/// Follows an inspection and keeps what its record is made of.
#[derive(Debug, Default)]
pub struct Recorder {
    recorded: Recorded,
}

/// What the events of an inspection said.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    /// When the first event was published.
    pub began: Option<Timestamp>,
    /// When the last one was.
    pub ended: Option<Timestamp>,
    /// How it ended; `None` while it runs.
    pub outcome: Option<Outcome>,
    /// Every view, in capture order.
    pub views: Vec<ViewRecord>,
    /// The views that were planned.
    pub planned: Vec<PlannedView>,
    /// Why no more were, and what was covered.
    pub plan_ended: Option<(PlanStop, Option<PlanCoverage>)>,
    /// The refinement of all poses together.
    pub refinement: Option<RefinementRecord>,
    /// How well the poses agree with the pictures.
    pub photometric: Option<PhotometricRecord>,
    /// What was found.
    pub findings: Option<FindingsRecord>,
    /// The table frame, at table angle 0, in the robot base; `None` without a robot.
    pub base_from_table: Option<Isometry3<f64>>,
    /// Views of the model whose true pose is known, in order.
    pub true_poses: Vec<TruePoses>,
}

/// Poses of one view of the model whose true pose is known, all `table_from_camera`.
#[derive(Clone, Copy, Debug)]
pub struct TruePoses {
    /// Position in the capture order.
    pub view: u32,
    /// The estimate.
    pub estimate: Isometry3<f64>,
    /// The kinematic pose, unless nothing was known.
    pub prior: Option<Isometry3<f64>>,
    /// The true pose.
    pub truth: Isometry3<f64>,
}

impl Recorder {
    /// Takes the next event in.
    pub fn handle(&mut self, event: &InspectionEvent) {
        let recorded = &mut self.recorded;
        recorded.began.get_or_insert(event.time);
        recorded.ended = Some(event.time);
        match &event.kind {
            EventKind::ViewFinished { record, view } => {
                let registration = view.as_ref().and_then(|v| v.registration.as_ref());
                let truth = view.as_ref().and_then(|v| v.view.truth.as_ref());
                if let (Some(registration), Some(truth), true) = (registration, truth, record.accepted) {
                    recorded.true_poses.push(TruePoses {
                        view: record.index,
                        estimate: registration.table_from_camera,
                        prior: registration.prior,
                        truth: truth.table_from_camera,
                    });
                }
                // Where the table frame is a camera's, the robot does not know it.
                if let (Some(view), true) = (view, registration.is_some_and(|r| r.prior.is_some()))
                    && let PoseEvidence::Chain { chain, .. } = &view.view.pose
                {
                    recorded.base_from_table.get_or_insert_with(|| chain.base_from_table(0.0));
                }
                recorded.views.push((**record).clone());
            }
            EventKind::Refined { poses, refinement } => {
                for refined in poses {
                    if let Some(view) = recorded.views.iter_mut().find(|v| v.index == refined.view) {
                        view.pose = Some(refined.pose);
                        view.covariance = Some(refined.covariance);
                    }
                    if let Some(poses) = recorded.true_poses.iter_mut().find(|p| p.view == refined.view) {
                        poses.estimate = isometry(&refined.pose);
                    }
                }
                recorded.refinement = Some(refinement.clone());
            }
            EventKind::Planned { view } => recorded.planned.push((**view).clone()),
            EventKind::PlanEnded { why, coverage } => {
                recorded.plan_ended = Some((*why, coverage.as_deref().cloned()));
            }
            EventKind::Judged { photometric } => recorded.photometric = Some((**photometric).clone()),
            EventKind::Ended { outcome } => recorded.outcome = Some(outcome.clone()),
            EventKind::Found { findings } => recorded.findings = Some((**findings).clone()),
            EventKind::Started { .. }
            | EventKind::Stage { .. }
            | EventKind::ModelChanged { .. }
            | EventKind::Measured { .. } => {}
        }
    }

    /// What was recorded.
    pub fn finish(self) -> Recorded {
        self.recorded
    }
}

impl Recorded {
    /// Why views were left out, for people.
    pub fn rejections(&self) -> Vec<String> {
        let reason = |v: &ViewRecord| Some(format!("view {}: {}", v.index, v.reason.as_ref()?));
        self.views.iter().filter_map(reason).collect()
    }
}
