//! A model against the true surface: accuracy and completeness by component ([Remanufacturing paper], Table 6), and how
//! far its points are off.
//!
//! Each point takes the label of the nearest vertex of the nearest true triangle as its true class. Points marked as
//! outliers or background do not belong to the model and are not judged.

use super::poses::moved;
use nalgebra::Isometry3;
use semascan_geometry::measure::{ClassScore, LabelledPoint, Nearest, OneWay, SurfaceIndex, class_scores};
use semascan_inspection::source::TrueMesh;
use semascan_model::{PointFlags, SemanticCloud};

/// Distances from the model's points to the true surface (point to triangle), metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceError {
    /// 95th percentile (HD95, model -> truth).
    pub hd95: f64,
    /// Mean (ME, model -> truth).
    pub mean: f64,
}

/// A model judged against truth.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthReport {
    /// Component classes that occur, in order.
    pub components: Vec<ClassScore>,
    /// Share of all retained points that carry their true class.
    pub accuracy: f64,
    /// Share of all points that are retained.
    pub completeness: f64,
    /// Defect classes that occur, in order.
    pub defects: Vec<ClassScore>,
    /// Distances to the true surface; `None` without points.
    pub surface: Option<SurfaceError>,
    /// Points judged.
    pub points: u64,
}

/// Judges `cloud` (table frame) against `truth`, as it stands.
pub fn judge(cloud: &SemanticCloud, truth: &TrueMesh) -> TruthReport {
    judge_aligned(cloud, truth, &Isometry3::identity())
}

/// Judges `cloud` (table frame) against `truth` after the rigid motion `truth_from_model`.
pub fn judge_aligned(cloud: &SemanticCloud, truth: &TrueMesh, truth_from_model: &Isometry3<f64>) -> TruthReport {
    let found = nearest_of_points(cloud, truth, truth_from_model);
    let labels = found.iter().map(|(i, n)| LabelledPoint {
        truth: truth_of(&truth.labels, n.vertex),
        given: cloud.labels[*i],
        retained: cloud.confidence[*i] > 0.0,
    });
    let defects = found.iter().map(|(i, n)| LabelledPoint {
        truth: truth_of(&truth.defects, n.vertex),
        given: cloud.defects[*i],
        retained: cloud.defect_confidence[*i] > 0.0,
    });
    let components = class_scores(labels);
    let sum = |f: fn(&ClassScore) -> u64| components.iter().map(f).sum::<u64>();
    let distances: Vec<f64> = found.iter().map(|(_, n)| f64::from(n.distance)).collect();
    TruthReport {
        accuracy: share(sum(|c| c.correct), sum(|c| c.retained)),
        completeness: share(sum(|c| c.retained), sum(|c| c.points)),
        defects: class_scores(defects),
        surface: OneWay::of(&distances).map(|d| SurfaceError { hd95: d.hd95, mean: d.mean_error }),
        points: found.len() as u64,
        components,
    }
}

/// The points of the model, by index, and what of the true surface is nearest to each.
pub(super) fn nearest_of_points(
    cloud: &SemanticCloud,
    truth: &TrueMesh,
    truth_from_model: &Isometry3<f64>,
) -> Vec<(usize, Nearest)> {
    let left_out = PointFlags::OUTLIER | PointFlags::BACKGROUND;
    let judged: Vec<usize> = (0..cloud.len()).filter(|&i| !cloud.flags[i].has(left_out)).collect();
    let positions: Vec<_> = judged.iter().map(|&i| moved(truth_from_model, cloud.positions[i])).collect();
    let nearest = SurfaceIndex::new(&truth.vertices, &truth.triangles).closest_of_all(&positions);
    judged.into_iter().zip(nearest).filter_map(|(i, n)| Some((i, n?))).collect()
}

/// Class of a vertex of the true mesh.
pub(super) fn truth_of(values: &[u16], vertex: u32) -> u16 {
    values.get(vertex as usize).copied().unwrap_or(0)
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    /// Two unit squares side by side, class 1 and class 2.
    fn truth() -> TrueMesh {
        let square = |x: f32| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]];
        let mut mesh = TrueMesh::default();
        for (k, x) in [0.0, 1.0].into_iter().enumerate() {
            let base = mesh.vertices.len() as u32;
            mesh.vertices.extend(square(x));
            mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
            mesh.labels.extend([k as u16 + 1; 4]);
            mesh.defects.extend([0; 4]);
        }
        mesh
    }

    fn point(position: [f32; 3], label: u16, confidence: f32) -> SemanticPoint {
        SemanticPoint {
            position,
            normal: [0.0, 0.0, 1.0],
            color: [0; 3],
            label,
            confidence,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags(0),
        }
    }

    #[test]
    fn scores_follow_p0() {
        let mut outlier = point([0.5, 0.5, 9.0], 2, 1.0);
        outlier.flags = PointFlags(PointFlags::RADIUS_OUTLIER);
        let cloud: SemanticCloud = [
            point([0.2, 0.5, 0.01], 1, 1.0),
            point([0.3, 0.5, 0.03], 2, 1.0),
            point([0.4, 0.5, 0.00], 0, 0.0),
            point([1.5, 0.5, 0.00], 2, 1.0),
            outlier,
        ]
        .into_iter()
        .collect();
        let report = judge(&cloud, &truth());
        let first = report.components[0];
        assert_eq!((first.class, first.points, first.retained, first.correct), (1, 3, 2, 1));
        assert!((report.accuracy - 2.0 / 3.0).abs() < 1e-12);
        assert!((report.completeness - 0.75).abs() < 1e-12);
        let second = report.components[1];
        assert!((second.iou() - 0.5).abs() < 1e-12);
        let surface = report.surface.expect("points");
        assert!((surface.mean - 0.01).abs() < 1e-6, "{surface:?}");
        assert!((surface.hd95 - 0.027).abs() < 1e-6, "{surface:?}");
    }
}
