//! A finished inspection against what its source knows to be true: labels, surface and poses, as they are, after one rigid
//! alignment, and as they would be with the true poses.
//!
//! The inspection's own map is only read: what needs other poses is fused into a map of its own.

use crate::poses::{PoseError, PosePair, align_poses, aligned_pose_errors, pose_error};
use crate::truth::{TruthReport, judge, judge_aligned};
use nalgebra::Isometry3;
use semascan_geometry::measure::ClassScore;
use semascan_inspection::Inspected;
use semascan_inspection::record::{TruePoses, pose_record};
use semascan_inspection::source::TrueMesh;
use semascan_model::record::{
    AlignedTruth, ClassTruth, Convention, LabelSource, PoseErrorRecord, TruthAtTruePoses, TruthRecord,
};
use semascan_model::{ClassDef, SemanticCloud, Taxonomy};
use semascan_perception::fuse::{OutlierFilter, SemanticMap};

/// Pose errors below this are rounding (radians, metres).
const EXACT: f64 = 1e-9;

/// Judges a finished inspection; `None` where its source knows no truth. Where the poses are off, its views are fused once
/// more with their true poses, to measure what the poses cost.
pub fn judge_inspection(inspected: &Inspected) -> Option<TruthRecord> {
    let mesh = inspected.source.truth()?;
    let (cloud, known) = (&inspected.cloud, &inspected.recorded.true_poses);
    let mut record = truth_record(&judge(cloud, mesh), &inspected.source.info().taxonomy, known);
    // Every view of the model, or none: an alignment to some of them would favour these.
    if inspected.record.views.iter().filter(|v| v.accepted).count() == known.len() {
        record.aligned = aligned(cloud, mesh, known);
        record.at_true_poses = ideal(&inspected.model.read(), mesh, known, &inspected.spec.outliers);
    }
    if inspected.record.labels == LabelSource::None {
        without_labels(&mut record);
    }
    Some(record)
}

/// Where no labels were used none was retained, let alone right: scores of classes would be figures of nothing.
fn without_labels(record: &mut TruthRecord) {
    record.components.clear();
    record.defects.clear();
    let aligned = record.aligned.iter_mut().map(|a| &mut a.label_accuracy);
    let ideal = record.at_true_poses.iter_mut().map(|a| &mut a.label_accuracy);
    let accuracies = aligned.chain(ideal).chain([&mut record.label_accuracy, &mut record.label_completeness]);
    accuracies.for_each(|accuracy| *accuracy = 0.0);
}

/// The model and its poses after one rigid alignment of the poses to the true ones.
fn aligned(cloud: &SemanticCloud, mesh: &TrueMesh, known: &[TruePoses]) -> Option<AlignedTruth> {
    let pairs = |of: fn(&TruePoses) -> Option<Isometry3<f64>>| -> Vec<(u32, PosePair)> {
        known.iter().filter_map(|p| Some((p.view, PosePair { estimate: of(p)?, truth: p.truth }))).collect()
    };
    let errors = |pairs: &[(u32, PosePair)]| {
        let errors = aligned_pose_errors(&pairs.iter().map(|(_, pair)| *pair).collect::<Vec<_>>());
        pairs.iter().zip(errors).map(|((view, _), error)| pose_row(*view, &error)).collect()
    };
    let estimated = pairs(|p| Some(p.estimate));
    let truth_from_model = align_poses(&estimated.iter().map(|(_, pair)| *pair).collect::<Vec<_>>())?;
    let report = judge_aligned(cloud, mesh, &truth_from_model);
    Some(AlignedTruth {
        truth_from_model: pose_record(&truth_from_model),
        label_accuracy: report.accuracy,
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
        poses: errors(&estimated),
        prior_poses: errors(&pairs(|p| p.prior)),
    })
}

/// How true the model would be with the true poses, on a map of its own; `None` if the poses are exact.
fn ideal(map: &SemanticMap, mesh: &TrueMesh, known: &[TruePoses], filter: &OutlierFilter) -> Option<TruthAtTruePoses> {
    let errors = known.iter().map(|p| pose_error(&p.estimate, &p.truth));
    if errors.into_iter().all(|e| e.rotation < EXACT && e.translation < EXACT) {
        return None;
    }
    let poses: Vec<_> = known.iter().map(|p| p.truth).collect();
    let mut ideal = match map.with_poses(&poses) {
        Ok(ideal) => ideal,
        Err(error) => {
            tracing::warn!(%error, "the model could not be judged with the true poses");
            return None;
        }
    };
    ideal.finish(filter);
    let report = judge(&ideal.cloud(), mesh);
    Some(TruthAtTruePoses {
        label_accuracy: report.accuracy,
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
    })
}

fn truth_record(report: &TruthReport, taxonomy: &Taxonomy, known: &[TruePoses]) -> TruthRecord {
    let named = |classes: &[ClassDef], scores: &[ClassScore]| -> Vec<ClassTruth> {
        let one = |s: &ClassScore| ClassTruth {
            class: s.class,
            name: classes.get(usize::from(s.class)).map_or_else(|| "unknown".into(), |c| c.name.clone()),
            points: s.points,
            accuracy: s.accuracy(),
            completeness: s.completeness(),
            iou: s.iou(),
        };
        scores.iter().map(one).collect()
    };
    let convention = |name: &str, text: &str| Convention { name: name.into(), text: text.into() };
    TruthRecord {
        conventions: vec![
            convention("points", "points of the model that are neither outliers nor background"),
            convention("true class", "class of the nearest vertex of the nearest triangle of the true mesh"),
            convention("accuracy", "correct / retained, over points of the true class; retained = with label evidence"),
            convention("completeness", "retained / all, over points of the true class"),
            convention("hd95", "95th percentile of point-to-triangle distances, model to truth, metres"),
            convention("mean_error", "mean of point-to-triangle distances, model to truth, metres"),
            convention("poses", "angle in radians, distance of camera centres in metres; no alignment"),
            convention(
                "aligned",
                "after the one rigid motion of the model that minimises sum |c - X c'|^2 + s^2 a^2 over the views \
                 (centres c, angles a, s = RMS distance of the true centres from their mean); prior_poses: the \
                 kinematic poses after an alignment of their own; all else is judged without alignment",
            ),
        ],
        label_accuracy: report.accuracy,
        label_completeness: report.completeness,
        components: named(&taxonomy.components, &report.components),
        defects: named(&taxonomy.defects, &report.defects),
        hd95: report.surface.map(|s| s.hd95),
        mean_error: report.surface.map(|s| s.mean),
        poses: known.iter().map(|p| pose_row(p.view, &pose_error(&p.estimate, &p.truth))).collect(),
        aligned: None,
        at_true_poses: None,
    }
}

fn pose_row(view: u32, error: &PoseError) -> PoseErrorRecord {
    PoseErrorRecord { view, rotation: error.rotation, translation: error.translation }
}
