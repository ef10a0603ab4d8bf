//! Listens to an inspection and keeps its record.

use super::record::{
    ComponentTruth, IdealRecord, InspectionRecord, PoseRecord, SCHEMA_VERSION, SoftwareRecord, StageTime, TruthRecord,
    ViewRecord, rows,
};
use crate::acquire::{Source, SourceInfo, TrueMesh};
use crate::evaluate::{ComponentScore, PoseError, TruthReport, judge, pose_error};
use crate::fuse::{OutlierFilter, SemanticMap, TouchedChunk};
use crate::inspect::summarize;
use crate::pipeline::{InspectionSink, Stage, StageStatus, ViewOutcome};
use nalgebra::Isometry3;
use semascan_shared::model::{ClassDef, SemanticCloud};
use std::sync::{Mutex, PoisonError};

/// An [`InspectionSink`] that makes an [`InspectionRecord`].
#[derive(Debug, Default)]
pub struct Recorder {
    views: Mutex<Vec<Heard>>,
}

/// A view's record, and its true pose with the error against it where the view is part of the model.
#[derive(Debug)]
struct Heard {
    record: ViewRecord,
    truth: Option<(Isometry3<f64>, PoseError)>,
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
            prior: registration.map(|r| PoseRecord::from(&r.prior)),
            covariance: registration.map(|r| rows(&r.covariance)),
            points_added: outcome.result.as_ref().map_or(0, |i| i.points_added),
            timings: outcome
                .timings
                .iter()
                .map(|(stage, time)| StageTime { stage: stage.name().into(), seconds: time.as_secs_f64() })
                .collect(),
        };
        let truth = outcome.view.as_ref().and_then(|v| v.truth.as_ref());
        let truth = registration
            .zip(truth)
            .filter(|_| outcome.result.is_ok())
            .map(|(r, t)| (t.table_from_camera, pose_error(&r.table_from_camera, &t.table_from_camera)));
        let mut views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        views.push(Heard { record, truth });
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
            let errors: Vec<_> = views.iter().filter_map(|v| Some((v.record.index, v.truth?.1))).collect();
            let mut record = truth_record(&judge(cloud, mesh), info, &errors);
            record.at_true_poses = map.and_then(|map| ideal(map, mesh, &views, filter));
            record
        });
        InspectionRecord {
            schema_version: SCHEMA_VERSION,
            id: id.into(),
            software: SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() },
            part: info.part.clone(),
            source: info.uri.clone(),
            labels: labels.into(),
            settings: info.settings.clone(),
            voxel,
            points: cloud.len() as u64,
            views: views.into_iter().map(|v| v.record).collect(),
            components,
            defects,
            truth,
        }
    }
}

/// How true the model would be with the true poses; `None` if the poses are exact or not all known.
fn ideal(map: &mut SemanticMap, mesh: &TrueMesh, views: &[Heard], filter: &OutlierFilter) -> Option<IdealRecord> {
    let accepted = views.iter().filter(|v| v.record.accepted);
    let known: Vec<_> = accepted.map(|v| v.truth).collect::<Option<_>>()?;
    if known.iter().all(|(_, e)| e.rotation < EXACT && e.translation < EXACT) {
        return None;
    }
    let poses: Vec<_> = known.into_iter().map(|(pose, _)| pose).collect();
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

fn truth_record(report: &TruthReport, info: &SourceInfo, errors: &[(u32, PoseError)]) -> TruthRecord {
    let named = |classes: &[ClassDef], scores: &[ComponentScore]| -> Vec<ComponentTruth> {
        let one = |s: &ComponentScore| ComponentTruth {
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
        ],
        label_accuracy: report.accuracy,
        label_completeness: report.completeness,
        components: named(&info.taxonomy.components, &report.components),
        defects: named(&info.taxonomy.defects, &report.defects),
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
        poses: errors.iter().map(|(view, e)| (*view, e.rotation, e.translation)).collect(),
        at_true_poses: None,
    }
}
