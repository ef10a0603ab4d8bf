//! How well the parameters of a fitted element are known [JCGM 100].
//!
//! **What the residuals say** (type A). Points of a reconstructed surface are no independent witnesses: smoothing and the
//! windows of depth cameras make errors alike within a few voxels. So the points in one cube of the correlation length count
//! as one. With G such cubes and N parameters the covariance is s^2 G / (G - N - 2) A^-1, where A are the normal equations with
//! the weight of one a cube: the factor makes two standard deviations cover what Student's distribution with G - N degrees of
//! freedom would [JCGM 101], 6.4.9.4.
//!
//! **What they cannot say** (type B): errors that all points of the element share, or all that were seen from one side.
//! Such an error d moves the parameters by A^-1 b d, with b the sum of the derivatives over the points that share it.
//!
//! | error | shared by |
//! |---|---|
//! | of the surface along its normal: how pixels, voxels and the mesher place it | all points |
//! | of the poses of views: way and turn | points that face one way (the side of a cube that their normal shows), as the same views saw them |

use super::FitError;
use super::SurfacePoint;
use super::robust::{Parametric, equations};
use nalgebra::{SMatrix, SVector, Vector3};
use std::collections::HashSet;

/// Sides of a cube, and one more for points without a normal.
const SIDES: usize = 7;

/// What is known beforehand of the errors of a surface, standard uncertainties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceErrors {
    /// How far points may lie from an element to belong to it at first, metres.
    pub tolerance: f64,
    /// Distance within which errors are alike, metres; 0 where each point errs on its own.
    pub correlation: f64,
    /// Of the surface along its normal, alike on a whole element, metres.
    pub surface: f64,
    /// Of the views that saw one side, along the normal, metres.
    pub poses: f64,
    /// Of the same, a turn about each axis, radians.
    pub turn: f64,
}

impl SurfaceErrors {
    /// Those of a mesh that was made of voxels of this edge (metres). The shares are those of simulated motors (2001 to 2004)
    /// other than those that the coverage is tested on (`semascan tables measure`).
    pub fn of_voxels(voxel: f64) -> Self {
        Self {
            tolerance: 0.3 * voxel,
            correlation: 4.0 * voxel,
            surface: 0.06 * voxel,
            poses: 0.06 * voxel,
            turn: 5e-4,
        }
    }
}

/// Residuals and covariance of an element with `N` parameters at its best fit. `weights` are those of the search.
pub(super) fn judge<const N: usize, E: Parametric<N>>(
    element: &E,
    points: &[SurfacePoint],
    weights: &[f64],
    errors: &SurfaceErrors,
) -> Result<Judged<N>, FitError> {
    let used: Vec<SurfacePoint> = points.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(p, _)| *p).collect();
    let whole: f64 = used.iter().map(|p| p.weight).sum();
    let cubes = independent(&used, errors.correlation);
    if cubes < N + 3 || whole <= 0.0 {
        return Err(FitError::TooFewPoints);
    }
    let even: Vec<f64> = used.iter().map(|p| p.weight / whole).collect();
    let (normal, _) = equations(element, &used, &even);
    let inverse = normal.cholesky().ok_or(FitError::Collinear)?.inverse();
    let residuals: Vec<f64> = used.iter().map(|p| element.residual(p).0).collect();
    let mean_square: f64 = residuals.iter().zip(&even).map(|(r, w)| w * r * r).sum();
    let by_residuals = inverse * (mean_square / (cubes - N - 2) as f64);

    let sides = Sides::<N>::of(element, &used, &even);
    let middle = sides.sums.iter().fold(SVector::zeros(), |sum: SVector<f64, N>, side| sum + side);
    let mut shared = middle * middle.transpose() * errors.surface.powi(2);
    for (sum, turns) in sides.sums.iter().zip(&sides.turns) {
        shared += sum * sum.transpose() * errors.poses.powi(2);
        for turn in turns {
            shared += turn * turn.transpose() * errors.turn.powi(2);
        }
    }
    Ok(Judged {
        rms: mean_square.sqrt(),
        largest: residuals.iter().fold(0.0, |most, r| most.max(r.abs())),
        used: used.len(),
        covariance: by_residuals + inverse * shared * inverse,
    })
}

/// What [`judge`] finds.
pub(super) struct Judged<const N: usize> {
    pub(super) rms: f64,
    pub(super) largest: f64,
    pub(super) used: usize,
    pub(super) covariance: SMatrix<f64, N, N>,
}

/// How many cubes of this edge the points lie in; of an edge of 0 each point has its own.
fn independent(points: &[SurfacePoint], edge: f64) -> usize {
    if edge <= 0.0 {
        return points.len();
    }
    let cube = |p: &SurfacePoint| [0, 1, 2].map(|k| (p.position[k] / edge).floor() as i64);
    points.iter().map(cube).collect::<HashSet<_>>().len()
}

/// Sums of the derivatives over the points that face one way.
struct Sides<const N: usize> {
    /// For a shift of the side along its normals.
    sums: [SVector<f64, N>; SIDES],
    /// For turns of the side about each axis through its middle.
    turns: [[SVector<f64, N>; 3]; SIDES],
}

impl<const N: usize> Sides<N> {
    fn of<E: Parametric<N>>(element: &E, points: &[SurfacePoint], weights: &[f64]) -> Self {
        let mut middles = [(Vector3::zeros(), 0.0); SIDES];
        for (point, weight) in points.iter().zip(weights) {
            let (sum, whole) = &mut middles[side(&point.normal)];
            *sum += point.position * *weight;
            *whole += weight;
        }
        let mut sides = Self { sums: [SVector::zeros(); SIDES], turns: [[SVector::zeros(); 3]; SIDES] };
        for (point, weight) in points.iter().zip(weights) {
            let side = side(&point.normal);
            let (sum, whole) = middles[side];
            let derivative = element.residual(point).1 * *weight;
            sides.sums[side] += derivative;
            // A small turn t moves a point at arm a by t x a, and that along its normal n by t . (a x n).
            let along = (point.position - sum / whole).cross(&point.normal);
            for axis in 0..3 {
                sides.turns[side][axis] += derivative * along[axis];
            }
        }
        sides
    }
}

/// The side of a cube that a normal shows.
fn side(normal: &Vector3<f64>) -> usize {
    if *normal == Vector3::zeros() {
        return SIDES - 1;
    }
    let axis = normal.iamax();
    2 * axis + usize::from(normal[axis] < 0.0)
}
