//! What a proposed motion is worth: the share of the smaller cloud that lies on the other after GICP, and how firmly that
//! constrains it.

use super::consistency::Hypothesis;
use crate::register::gicp::{self, GicpConfig, GicpFit};
use crate::register::surfels::{SurfelCloud, vector};
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use semascan_geometry::measure::Guess;

/// A direction whose share of the information is below this is unconstrained.
const UNCONSTRAINED: f64 = 0.01;
/// Cosine above which normals agree.
const AGREE: f64 = 0.8;

/// A motion as it stands on the clouds.
#[derive(Clone, Debug)]
pub(super) struct Judged {
    pub(super) overlap: f64,
    /// Directions of the motion that the common surface leaves unconstrained.
    pub(super) unconstrained: usize,
    pub(super) support: usize,
    pub(super) fit: GicpFit,
}

/// Aligns from a hypothesis, and looks at what comes out.
pub(super) fn judge(source: &SurfelCloud, target: &SurfelCloud, hypothesis: &Hypothesis) -> Option<Judged> {
    let config = GicpConfig { max_iterations: 15, tolerance: 0.01, ..GicpConfig::within(2.5 * source.voxel) };
    let fit = gicp::align(source, target, &hypothesis.target_from_source, &config).ok()?;
    let common = common(source, target, &fit.target_from_source);
    let all = source.points.len().min(target.points.len());
    Some(Judged {
        overlap: (common.len() as f64 / all as f64).min(1.0),
        unconstrained: information_shares(&common).into_iter().filter(|v| *v < UNCONSTRAINED).count(),
        support: hypothesis.support,
        fit,
    })
}

/// Points and normals of the source that lie on the target.
fn common(source: &SurfelCloud, target: &SurfelCloud, pose: &Isometry3<f64>) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let oriented = source.oriented && target.oriented;
    let mut guess = Guess::NONE;
    source
        .points
        .iter()
        .zip(&source.normals)
        .filter_map(|(p, n)| {
            let (p, n) = (Point3::from(vector(*p)), vector(*n));
            let q = pose * p;
            let query = [q.x as f32, q.y as f32, q.z as f32];
            let found = target.index.nearest_from(query, 1.5 * source.voxel as f32, &mut guess)?;
            let agree = (pose.rotation * n).dot(&vector(target.normals[found.index as usize]));
            ((if oriented { agree } else { agree.abs() }) > AGREE).then_some((p, n))
        })
        .collect()
}

/// How firmly points with normals constrain each of the six directions of a motion: eigenvalues of the point-to-plane
/// information matrix about their centroid, a turn counting as it moves the points on average; ascending, sum about one.
fn information_shares(points: &[(Point3<f64>, Vector3<f64>)]) -> [f64; 6] {
    let n = points.len().max(1) as f64;
    let centre = points.iter().map(|p| p.0.coords).sum::<Vector3<f64>>() / n;
    let radius = (points.iter().map(|p| (p.0.coords - centre).norm_squared()).sum::<f64>() / n).sqrt();
    let information: Matrix6<f64> = points
        .iter()
        .map(|(p, normal)| {
            let turn = (p.coords - centre).cross(normal) / radius.max(f64::MIN_POSITIVE);
            let row = Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
            row * row.transpose() / n
        })
        .sum();
    let mut values: [f64; 6] = information.symmetric_eigenvalues().into();
    values.sort_by(f64::total_cmp);
    values
}
