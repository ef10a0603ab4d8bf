//! The homography between two planes from points of both ([Hartley and Zisserman 2004, algorithm 4.2]), and the points that agree
//! with one where some are mistaken for others (RANSAC, [Fischler 1981]).

use nalgebra::{DMatrix, Matrix3, Point2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Second smallest eigenvalue over the largest from which on the points leave no freedom.
const LEAST_EIGENVALUE: f64 = 1e-9;
/// Samples of four points: with a third of them mistaken, one sample is good with a probability of 1 - 1e-19.
const SAMPLES: usize = 200;
/// Seed of the samples.
const SEED: u64 = 9;

/// What takes `from` to `to`; `None` where the points leave it open.
pub fn homography(from: &[Point2<f64>], to: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    // Both sides are centred and scaled, without which the system is badly conditioned.
    let (from_scaled, to_scaled) = (scaling(from)?, scaling(to)?);
    let mut system = DMatrix::zeros(2 * from.len(), 9);
    for (k, (a, b)) in from.iter().zip(to).enumerate() {
        let (p, q) = (from_scaled * a.to_homogeneous(), to_scaled * b.to_homogeneous());
        for c in 0..3 {
            system[(2 * k, 3 + c)] = -p[c];
            system[(2 * k, 6 + c)] = q.y * p[c];
            system[(2 * k + 1, c)] = p[c];
            system[(2 * k + 1, 6 + c)] = -q.x * p[c];
        }
    }
    let eigen = (system.transpose() * &system).symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // Points on a line leave more than one.
    if eigen.eigenvalues[order[1]] < LEAST_EIGENVALUE * eigen.eigenvalues[order[8]] {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    let scaled = Matrix3::from_fn(|row, column| h[3 * row + column]);
    Some(to_scaled.try_inverse()? * scaled * from_scaled)
}

/// Whether each pair agrees with the homography that most of them agree with, within `tolerance` in the plane of `to`.
pub fn agreeing(from: &[Point2<f64>], to: &[Point2<f64>], tolerance: f64) -> Vec<bool> {
    let within = |h: &Matrix3<f64>| -> Vec<bool> {
        let pairs = from.iter().zip(to);
        pairs
            .map(|(a, b)| Point2::from_homogeneous(h * a.to_homogeneous()).is_some_and(|p| (p - b).norm() < tolerance))
            .collect()
    };
    let count = |agrees: &[bool]| agrees.iter().filter(|agrees| **agrees).count();
    let mut best = vec![false; from.len()];
    if from.len() < 4 {
        return best;
    }
    let mut rng = Pcg64::seed_from_u64(SEED);
    for _ in 0..SAMPLES {
        let chosen: [usize; 4] = std::array::from_fn(|_| rng.random_range(0..from.len()));
        let of = |points: &[Point2<f64>]| chosen.map(|k| points[k]);
        let Some(sampled) = homography(&of(from), &of(to)) else { continue };
        let agrees = within(&sampled);
        if count(&agrees) > count(&best) {
            best = agrees;
        }
    }
    // All that agree say it better than four do.
    let of = |points: &[Point2<f64>]| -> Vec<Point2<f64>> {
        points.iter().zip(&best).filter(|(_, agrees)| **agrees).map(|(point, _)| *point).collect()
    };
    match homography(&of(from), &of(to)).map(|all| within(&all)) {
        Some(agrees) if count(&agrees) >= count(&best) => agrees,
        _ => best,
    }
}

/// What centres points and brings their mean distance from the middle to about one; `None` where they are one point.
fn scaling(points: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    let count = points.len() as f64;
    let middle = points.iter().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let mean = points.iter().map(|p| (p.coords - middle).norm()).sum::<f64>() / count;
    let scale = 1.0 / mean;
    scale.is_finite().then(|| Matrix3::new(scale, 0.0, -scale * middle.x, 0.0, scale, -scale * middle.y, 0.0, 0.0, 1.0))
}
