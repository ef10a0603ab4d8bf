//! Listens to an inspection and keeps its record.

use super::conversions::rows;
use super::{InspectionRecord, PoseRecord, RefinementRecord, SCHEMA_VERSION, SoftwareRecord, StageTime, ViewRecord};
use crate::pipeline::{InspectionSink, Stage, StageStatus, ViewOutcome};
use crate::source::SourceInfo;
use crate::summary::summarize;
use nalgebra::Isometry3;
use semascan_model::SemanticCloud;
use semascan_perception::fuse::{SemanticMap, TouchedChunk};
use semascan_perception::register::JointRefinement;
use semascan_perception::view::PoseEvidence;
use std::sync::{Mutex, PoisonError};

/// An [`InspectionSink`] that makes an [`InspectionRecord`].
#[derive(Debug, Default)]
pub struct Recorder {
    views: Mutex<Vec<Heard>>,
    refinement: Mutex<Option<RefinementRecord>>,
}

/// A view's record, and its poses where the view is part of the model and its true pose is known.
#[derive(Debug)]
struct Heard {
    record: ViewRecord,
    base_from_table: Option<Isometry3<f64>>,
    poses: Option<ViewPoses>,
}

/// Poses of one view of the model whose true pose is known, all `table_from_camera`.
#[derive(Clone, Copy, Debug)]
pub struct ViewPoses {
    /// Position in the capture order.
    pub index: u32,
    /// The estimate.
    pub estimate: Isometry3<f64>,
    /// The kinematic pose, unless nothing was known.
    pub prior: Option<Isometry3<f64>>,
    /// The true pose.
    pub truth: Isometry3<f64>,
}

/// A finished inspection's record, and what is known to be true of its poses.
#[derive(Debug)]
pub struct Recorded {
    /// The record, without a judgement against truth.
    pub record: InspectionRecord,
    /// Views of the model whose true pose is known, in order.
    pub poses: Vec<ViewPoses>,
}

impl InspectionSink for Recorder {
    fn stage(&self, _view: u32, _stage: Stage, _status: &StageStatus) {}

    fn map_changed(&self, _map: &SemanticMap, _touched: &[TouchedChunk], _last: bool) {}

    fn view_done(&self, outcome: &ViewOutcome) {
        let registration = outcome.registration.as_ref();
        let record = ViewRecord {
            index: outcome.index,
            accepted: outcome.result.is_ok(),
            reason: outcome.result.as_ref().err().cloned(),
            pose: registration.map(|r| (&r.table_from_camera).into()),
            prior: registration.and_then(|r| r.prior.as_ref()).map(Into::into),
            covariance: registration.map(|r| rows(&r.covariance)),
            registration: registration.map(|r| (&r.method).into()),
            segmentation: outcome.segmentation.as_ref().and_then(|s| s.network.as_deref()).map(Into::into),
            misidentified: outcome.misidentified.iter().map(Into::into).collect(),
            points_added: outcome.result.as_ref().map_or(0, |i| i.points_added),
            timings: outcome
                .timings
                .iter()
                .map(|(stage, time)| StageTime { stage: stage.name().into(), seconds: time.as_secs_f64() })
                .collect(),
        };
        let truth = outcome.view.as_ref().and_then(|v| v.truth.as_ref());
        let poses = registration.zip(truth).filter(|_| outcome.result.is_ok()).map(|(r, t)| ViewPoses {
            index: outcome.index,
            estimate: r.table_from_camera,
            prior: r.prior,
            truth: t.table_from_camera,
        });
        let mut views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        // Where the table frame is a camera's, the robot does not know it.
        let in_table = registration.is_some_and(|r| r.prior.is_some());
        let base_from_table = outcome.view.as_ref().filter(|_| in_table).and_then(|v| match &v.pose {
            PoseEvidence::Chain { chain, .. } => Some(chain.base_from_table(0.0)),
            _ => None,
        });
        views.push(Heard { record, base_from_table, poses });
    }

    fn refined(&self, indices: &[u32], refinement: &JointRefinement) {
        let mut views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        for (index, pose) in indices.iter().zip(&refinement.table_from_camera) {
            if let Some(heard) = views.iter_mut().find(|v| v.record.index == *index) {
                heard.record.pose = Some(pose.into());
                if let Some(poses) = &mut heard.poses {
                    poses.estimate = *pose;
                }
            }
        }
        *self.refinement.lock().unwrap_or_else(PoisonError::into_inner) = Some(refinement.into());
    }
}

impl Recorder {
    /// Why views were left out.
    pub fn rejections(&self) -> Vec<String> {
        let views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        let reason = |v: &Heard| Some(format!("view {}: {}", v.record.index, v.record.reason.as_ref()?));
        views.iter().filter_map(reason).collect()
    }

    /// The record of a finished inspection of `info`, whose model is `map`, as points `cloud`.
    pub fn finish(
        self,
        id: &str,
        info: &SourceInfo,
        labels: &str,
        map: Option<&SemanticMap>,
        cloud: &SemanticCloud,
    ) -> Recorded {
        let views = self.views.into_inner().unwrap_or_else(PoisonError::into_inner);
        let voxel = map.map(|m| m.config().voxel);
        let (components, defects) = summarize(cloud, &info.taxonomy, voxel.unwrap_or(0.0));
        let poses = views.iter().filter_map(|v| v.poses).collect();
        let record = InspectionRecord {
            schema_version: SCHEMA_VERSION,
            id: id.into(),
            software: SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() },
            part: info.part.clone(),
            source: info.uri.clone(),
            labels: labels.into(),
            segmentation: None,
            settings: info.settings.clone(),
            voxel,
            points: cloud.len() as u64,
            base_from_table: views.iter().find_map(|v| v.base_from_table.as_ref()).map(PoseRecord::from),
            refinement: self.refinement.into_inner().unwrap_or_else(PoisonError::into_inner),
            views: views.into_iter().map(|v| v.record).collect(),
            components,
            defects,
            truth: None,
        };
        Recorded { record, poses }
    }
}
