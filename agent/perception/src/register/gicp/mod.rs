//! Generalized ICP of unorganized clouds [Segal 2009]: plane to plane.
//!
//! Every point stands for a small disc: its covariance is 1 along the surface and `FLAT` across it. With normals `a`
//! and `b` of a pair, the weight of its error is the inverse of `2 - (1 - FLAT) (a a' + b b')`, which has a closed
//! form, so no 3x3 matrix is inverted for a pair. Each search begins at the neighbour of the iteration before. Outliers
//! weigh little (Geman-McClure [Geman 1987], its width from the median of the errors), so that half of a cloud may see
//! something else.

use super::se3;
use super::surfels::{SurfelCloud, vector};
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use rayon::prelude::*;
use semascan_geometry::measure::Guess;

/// Variance across the surface where that along it is 1.
const FLAT: f64 = 1e-3;
/// Pairs whose sums one thread computes at a time; fixed, so that the result does not depend on the threads.
const PIECE: usize = 1024;
/// Fewest pairs that can constrain six degrees of freedom.
const MIN_PAIRS: usize = 10;

/// How clouds are aligned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GicpConfig {
    /// Farthest that a pair's points may be apart, metres.
    pub max_distance: f64,
    /// Most iterations.
    pub max_iterations: u32,
    /// Ends when an iteration moves the cloud by less than this share of its voxel.
    pub tolerance: f64,
}

impl GicpConfig {
    /// Pairs up to `max_distance` apart.
    pub fn within(max_distance: f64) -> Self {
        Self { max_distance, max_iterations: 40, tolerance: 5e-3 }
    }
}

/// How an alignment ended.
#[derive(Clone, Debug, PartialEq)]
pub struct GicpFit {
    /// The pose that was found.
    pub target_from_source: Isometry3<f64>,
    /// Iterations made.
    pub iterations: u32,
    /// Whether the last of them moved it by less than the tolerance.
    pub converged: bool,
    /// Share of the source's points that have a partner within the distance, whatever its weight.
    pub overlap: f64,
    /// Root of the mean squared distance of the pairs' planes, weighted as the pairs are, metres.
    pub rmse: f64,
    /// Covariance over (rotation, translation) in the source's frame, from the spread of the errors.
    pub covariance: Matrix6<f64>,
}

/// Why clouds could not be aligned.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GicpError {
    /// The guess is not finite.
    #[error("the first guess of the pose is not finite")]
    Guess,
    /// Nothing of the source is near the target.
    #[error("{pairs} points have a partner within {max_distance} m: {MIN_PAIRS} are needed")]
    TooFewPairs {
        /// Pairs found.
        pairs: usize,
        /// How far they may be apart.
        max_distance: f64,
    },
    /// The pairs leave a direction unconstrained.
    #[error("the points do not constrain the pose in every direction")]
    Singular,
}

/// Aligns `source` with `target`, beginning at `guess` (`target_from_source`).
///
/// ```
/// use nalgebra::Isometry3;
/// use semascan_perception::register::gicp::{GicpConfig, align};
/// use semascan_perception::register::{Facing, SurfelCloud};
///
/// // Three faces of a box, 0.1 m wide, as [x, y, z] in metres, and the same box 1 mm farther along each axis.
/// let grid = (0..10_000).map(|i| ((i % 100) as f32 * 0.001, (i / 100) as f32 * 0.001));
/// let corner: Vec<[f32; 3]> = grid.flat_map(|(a, b)| [[a, b, 0.0], [a, 0.0, b], [0.0, a, b]]).collect();
/// let moved: Vec<[f32; 3]> = corner.iter().map(|p| p.map(|c| c + 0.001)).collect();
///
/// // Both are thinned to voxels of 3 mm, and normals fitted to 12 neighbours.
/// let surfels = |points: &[[f32; 3]]| SurfelCloud::new(points, Facing::Unknown, 0.003, 12);
/// let (source, target) = (surfels(&corner)?, surfels(&moved)?);
/// let fit = align(&source, &target, &Isometry3::identity(), &GicpConfig::within(0.01))?;
/// let error = (fit.target_from_source * source.centroid - target.centroid).norm();
/// assert!(error < 3e-4, "{error} m");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`GicpError`] if there is nothing to align or a direction of the pose is unconstrained.
pub fn align(
    source: &SurfelCloud,
    target: &SurfelCloud,
    guess: &Isometry3<f64>,
    config: &GicpConfig,
) -> Result<GicpFit, GicpError> {
    if !guess.to_homogeneous().iter().all(|v| v.is_finite()) {
        return Err(GicpError::Guess);
    }
    let mut pose = *guess;
    let mut guesses = vec![Guess::NONE; source.points.len()];
    let mut pairs: Vec<Option<Pair>> = vec![None; source.points.len()];
    let step = config.tolerance * source.voxel.min(target.voxel);
    let mut iterations = 0;
    loop {
        find_pairs(source, target, &pose, config.max_distance, &mut guesses, &mut pairs);
        let width = kernel_width(&pairs, source.voxel);
        let sums = accumulate(source, &pairs, width);
        if sums.pairs < MIN_PAIRS {
            return Err(GicpError::TooFewPairs { pairs: sums.pairs, max_distance: config.max_distance });
        }
        let factor = sums.hessian.cholesky().ok_or(GicpError::Singular)?;
        let update = about_origin(source, &-factor.solve(&sums.gradient));
        pose = se3::advance(&pose, &update);
        iterations += 1;
        let (turn, shift) = se3::halves(&update);
        let moved = (shift + turn.cross(&source.centroid.coords)).norm() + turn.norm() * source.radius;
        if !moved.is_finite() {
            return Err(GicpError::Singular);
        }
        // The sums are those from before the last step, which is too small to change them.
        if moved < step || iterations >= config.max_iterations {
            return finish(source, pose, &sums, iterations, moved < step);
        }
    }
}

/// A source point's partner, in the source's frame.
#[derive(Clone, Copy, Debug)]
struct Pair {
    source: [f32; 3],
    a: [f32; 3],
    error: Vector3<f64>,
    b: Vector3<f64>,
    /// `weighted = M^-1 error`, `distance` = distance of the planes, squared.
    weighted: Vector3<f64>,
    distance: f64,
}

impl Pair {
    fn new(source: [f32; 3], a: [f32; 3], error: Vector3<f64>, b: Vector3<f64>) -> Self {
        let (alpha, beta) = coefficients(&vector(a), &b);
        let n = vector(a);
        let (ea, eb) = (n.dot(&error), b.dot(&error));
        let weighted = 0.5 * (error + (alpha * ea + beta * eb) * n + (beta * ea + alpha * eb) * b);
        let distance = 2.0 * FLAT * error.dot(&weighted);
        Self { source, a, error, b, weighted, distance }
    }
}

/// `alpha`, `beta` of `M^-1 = (1 + alpha (a a' + b b') + beta (a b' + b a')) / 2` (Woodbury).
fn coefficients(a: &Vector3<f64>, b: &Vector3<f64>) -> (f64, f64) {
    let k = 1.0 - FLAT;
    // An unknown normal is zero: where one is, the disc of the other counts for both.
    let (a, b) = if a.norm_squared() < 0.5 { (b, b) } else { (a, if b.norm_squared() < 0.5 { a } else { b }) };
    if a.norm_squared() < 0.5 {
        return (0.0, 0.0);
    }
    let c = a.dot(b).clamp(-1.0, 1.0);
    let determinant = (2.0 - k).powi(2) - (k * c).powi(2);
    (k * (2.0 - k) / determinant, k * k * c / determinant)
}

fn find_pairs(
    source: &SurfelCloud,
    target: &SurfelCloud,
    pose: &Isometry3<f64>,
    max_distance: f64,
    guesses: &mut [Guess],
    pairs: &mut [Option<Pair>],
) {
    let rotation = *pose.rotation.to_rotation_matrix().matrix();
    let back = rotation.transpose();
    let t = pose.translation.vector;
    let radius = max_distance as f32;
    let points = source.points.par_iter().zip(&source.normals).with_min_len(PIECE);
    points.zip(guesses).zip(pairs).for_each(|(((p, a), guess), pair)| {
        let placed = rotation * vector(*p) + t;
        let query = [placed.x as f32, placed.y as f32, placed.z as f32];
        *pair = target.index.nearest_from(query, radius, guess).map(|n| {
            let (q, b) = (target.points[n.index as usize], target.normals[n.index as usize]);
            let mut b = back * vector(b);
            let a = if *a == [0.0; 3] { [b.x as f32, b.y as f32, b.z as f32] } else { *a };
            if b == Vector3::zeros() {
                b = vector(a);
            }
            Pair::new(*p, a, back * (vector(q) - placed), b)
        });
    });
}

/// Three times the standard deviation that the median of the errors stands for, at least a hundredth of the voxel.
fn kernel_width(pairs: &[Option<Pair>], voxel: f64) -> f64 {
    let mut squares: Vec<f64> = pairs.iter().flatten().map(|p| p.distance).collect();
    if squares.is_empty() {
        return voxel;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    (3.0 * 1.4826 * median.max(0.0).sqrt()).max(0.01 * voxel)
}

/// Sums over all pairs, about the source's centroid.
#[derive(Clone, Copy, Debug)]
struct Sums {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    /// Weighted sum of `e' M^-1 e`, and of the weights.
    cost: f64,
    weight: f64,
    pairs: usize,
}

fn accumulate(source: &SurfelCloud, pairs: &[Option<Pair>], width: f64) -> Sums {
    let centre = source.centroid;
    let pieces: Vec<Sums> = pairs.par_chunks(PIECE).map(|piece| sum(piece, &centre, width)).collect();
    let zero = Sums { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), cost: 0.0, weight: 0.0, pairs: 0 };
    pieces.into_iter().fold(zero, |s, p| Sums {
        hessian: s.hessian + p.hessian,
        gradient: s.gradient + p.gradient,
        cost: s.cost + p.cost,
        weight: s.weight + p.weight,
        pairs: s.pairs + p.pairs,
    })
}

fn sum(piece: &[Option<Pair>], centre: &Point3<f64>, width: f64) -> Sums {
    let mut lower = [[0.0_f64; 6]; 6];
    let mut gradient = [0.0_f64; 6];
    let (mut cost, mut weight, mut pairs) = (0.0, 0.0, 0);
    for pair in piece.iter().flatten() {
        // Geman-McClure.
        let w = (1.0 + pair.distance / (width * width)).powi(-2);
        let q = vector(pair.source) - centre.coords;
        let (a, b) = (vector(pair.a), pair.b);
        let (alpha, beta) = coefficients(&a, &b);
        // The error changes by [q]x omega - v: its transpose takes a direction d to (-q x d, -d).
        let column = |d: &Vector3<f64>| {
            let r = d.cross(&q);
            [r.x, r.y, r.z, -d.x, -d.y, -d.z]
        };
        let (ua, ub, ug) = (column(&a), column(&b), column(&pair.weighted));
        let h = 0.5 * w;
        let mixed: [f64; 6] = std::array::from_fn(|i| h * (alpha * ua[i] + beta * ub[i]));
        let other: [f64; 6] = std::array::from_fn(|i| h * (beta * ua[i] + alpha * ub[i]));
        for i in 0..6 {
            for j in 0..=i {
                lower[i][j] += mixed[i] * ua[j] + other[i] * ub[j];
            }
            gradient[i] += w * ug[i];
        }
        // J'J / 2.
        let square = q.norm_squared();
        for i in 0..3 {
            for j in 0..=i {
                lower[i][j] -= h * q[i] * q[j];
            }
            lower[i][i] += h * square;
            lower[3 + i][3 + i] += h;
        }
        // Lower left block: the transpose of [q]x.
        lower[3][1] += h * q.z;
        lower[3][2] -= h * q.y;
        lower[4][0] -= h * q.z;
        lower[4][2] += h * q.x;
        lower[5][0] += h * q.y;
        lower[5][1] -= h * q.x;
        cost += w * pair.error.dot(&pair.weighted);
        weight += w;
        pairs += 1;
    }
    let hessian = Matrix6::from_fn(|i, j| lower[i.max(j)][i.min(j)]);
    Sums { hessian, gradient: Vector6::from_row_slice(&gradient), cost, weight, pairs }
}

/// A twist about the centroid as one about the origin of the source's frame.
fn about_origin(source: &SurfelCloud, update: &Vector6<f64>) -> Vector6<f64> {
    se3::about(&Point3::from(-source.centroid.coords)) * update
}

fn finish(
    source: &SurfelCloud,
    pose: Isometry3<f64>,
    sums: &Sums,
    iterations: u32,
    converged: bool,
) -> Result<GicpFit, GicpError> {
    let spread = sums.cost / sums.weight.max(f64::MIN_POSITIVE);
    let centred = sums.hessian.try_inverse().ok_or(GicpError::Singular)? * spread;
    let carry = se3::about(&Point3::from(-source.centroid.coords));
    Ok(GicpFit {
        target_from_source: pose,
        iterations,
        converged,
        overlap: sums.pairs as f64 / source.points.len() as f64,
        rmse: (2.0 * FLAT * spread).max(0.0).sqrt(),
        covariance: carry * centred * carry.transpose(),
    })
}

#[cfg(test)]
pub(in crate::register) mod tests;
