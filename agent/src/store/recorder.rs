//! Listens to an inspection and keeps its record.

use super::record::{
    AlignedRecord, ComponentTruth, IdealRecord, InspectionRecord, PoseRecord, RefinementRecord, SCHEMA_VERSION,
    SoftwareRecord, StageTime, TruthRecord, ViewRecord, rows,
};
use crate::acquire::{PoseEvidence, Source, SourceInfo, TrueMesh};
use crate::evaluate::{PosePair, TruthReport, align_poses, aligned_pose_errors, judge, judge_aligned, pose_error};
use crate::fuse::{OutlierFilter, SemanticMap, TouchedChunk};
use crate::inspect::summarize;
use crate::pipeline::{InspectionSink, Stage, StageStatus, ViewOutcome};
use crate::register::JointRefinement;
use nalgebra::Isometry3;
use semascan_shared::measure::ClassScore;
use semascan_shared::model::{ClassDef, SemanticCloud};
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
    poses: Option<Poses>,
}

/// Poses of one view, all `table_from_camera`.
#[derive(Clone, Copy, Debug)]
struct Poses {
    index: u32,
    estimate: Isometry3<f64>,
    /// Unless nothing was known.
    prior: Option<Isometry3<f64>>,
    truth: Isometry3<f64>,
}

/// Pose errors below this are rounding (radians, metres).
const EXACT: f64 = 1e-9;

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
        let poses = registration.zip(truth).filter(|_| outcome.result.is_ok()).map(|(r, t)| Poses {
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

    /// The record of a finished inspection whose model is `cloud`. Where truth is known and the poses are off, the map
    /// is rebuilt once with the true poses, to tell what the poses cost.
    pub fn finish(
        self,
        id: &str,
        source: &dyn Source,
        labels: &str,
        map: Option<&mut SemanticMap>,
        cloud: &SemanticCloud,
        filter: &OutlierFilter,
    ) -> InspectionRecord {
        let info = source.info();
        let views = self.views.into_inner().unwrap_or_else(PoisonError::into_inner);
        let voxel = map.as_ref().map(|m| m.config().voxel);
        let (components, defects) = summarize(cloud, &info.taxonomy, voxel.unwrap_or(0.0));
        let truth = source.truth().map(|mesh| {
            let known: Vec<_> = views.iter().filter_map(|v| v.poses).collect();
            // Every view of the model, or none: an alignment to some of them would favour these.
            let whole = views.iter().filter(|v| v.record.accepted).all(|v| v.poses.is_some());
            let mut record = truth_record(&judge(cloud, mesh), info, &known);
            if whole {
                record.aligned = aligned(cloud, mesh, &known);
                record.at_true_poses = map.and_then(|map| ideal(map, mesh, &known, filter));
            }
            record
        });
        InspectionRecord {
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
            truth,
        }
    }
}

/// The model and its poses after one rigid alignment of the poses to the true ones.
fn aligned(cloud: &SemanticCloud, mesh: &TrueMesh, known: &[Poses]) -> Option<AlignedRecord> {
    let pairs = |of: fn(&Poses) -> Option<Isometry3<f64>>| -> Vec<(u32, PosePair)> {
        known.iter().filter_map(|p| Some((p.index, PosePair { estimate: of(p)?, truth: p.truth }))).collect()
    };
    let errors = |pairs: &[(u32, PosePair)]| {
        let errors = aligned_pose_errors(&pairs.iter().map(|(_, pair)| *pair).collect::<Vec<_>>());
        pairs.iter().zip(errors).map(|((index, _), e)| (*index, e.rotation, e.translation)).collect()
    };
    let estimated = pairs(|p| Some(p.estimate));
    let truth_from_model = align_poses(&estimated.iter().map(|(_, pair)| *pair).collect::<Vec<_>>())?;
    let report = judge_aligned(cloud, mesh, &truth_from_model);
    Some(AlignedRecord {
        truth_from_model: (&truth_from_model).into(),
        label_accuracy: report.accuracy,
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
        poses: errors(&estimated),
        prior_poses: errors(&pairs(|p| p.prior)),
    })
}

/// How true the model would be with the true poses; `None` if the poses are exact.
fn ideal(map: &mut SemanticMap, mesh: &TrueMesh, known: &[Poses], filter: &OutlierFilter) -> Option<IdealRecord> {
    let errors = known.iter().map(|p| pose_error(&p.estimate, &p.truth));
    if errors.into_iter().all(|e| e.rotation < EXACT && e.translation < EXACT) {
        return None;
    }
    let poses: Vec<_> = known.iter().map(|p| p.truth).collect();
    if let Err(error) = map.rebuild(&poses) {
        tracing::warn!(%error, "the model could not be judged with the true poses");
        return None;
    }
    map.mark_outliers(filter);
    let report = judge(&map.cloud(), mesh);
    Some(IdealRecord {
        label_accuracy: report.accuracy,
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
    })
}

fn truth_record(report: &TruthReport, info: &SourceInfo, known: &[Poses]) -> TruthRecord {
    let named = |classes: &[ClassDef], scores: &[ClassScore]| -> Vec<ComponentTruth> {
        let one = |s: &ClassScore| ComponentTruth {
            class: s.class,
            name: classes.get(usize::from(s.class)).map_or_else(|| "unknown".into(), |c| c.name.clone()),
            points: s.points,
            accuracy: s.accuracy(),
            completeness: s.completeness(),
            iou: s.iou(),
        };
        scores.iter().map(one).collect()
    };
    let convention = |name: &str, text: &str| (name.to_owned(), text.to_owned());
    TruthRecord {
        conventions: vec![
            convention("points", "points of the model that are neither outliers nor background"),
            convention("true class", "class of the nearest vertex of the nearest triangle of the true mesh"),
            convention("accuracy", "correct / retained, over points of the true class; retained = with label evidence"),
            convention("completeness", "retained / all, over points of the true class"),
            convention("hd95", "95th percentile of point-to-triangle distances, model to truth, metres"),
            convention("mean_error", "mean of point-to-triangle distances, model to truth, metres"),
            convention("poses", "(view, angle in radians, distance of camera centres in metres), no alignment"),
            convention(
                "aligned",
                "after the one rigid motion of the model that minimises sum |c - X c'|^2 + s^2 a^2 over the views \
                 (centres c, angles a, s = RMS distance of the true centres from their mean); prior_poses: the \
                 kinematic poses after an alignment of their own; all else is judged without alignment",
            ),
        ],
        label_accuracy: report.accuracy,
        label_completeness: report.completeness,
        components: named(&info.taxonomy.components, &report.components),
        defects: named(&info.taxonomy.defects, &report.defects),
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
        poses: known.iter().map(pose_row).collect(),
        aligned: None,
        at_true_poses: None,
    }
}

fn pose_row(p: &Poses) -> (u32, f64, f64) {
    let error = pose_error(&p.estimate, &p.truth);
    (p.index, error.rotation, error.translation)
}
