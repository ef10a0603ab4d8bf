//! The search that all elements share: a start from random samples, then Gauss-Newton steps on the weighted squares of the
//! geometric distances, damped where a step would not lower them [Forbes 1989], with Tukey's biweight [Beaton 1974]. What has no
//! weight then is left out, and the rest is fitted once more without weights.
//!
//! The scale of the biweight is that of the residuals themselves (their median, as of a normal distribution), but it falls no
//! lower than a share of the start's tolerance: an exact surface has residuals of rounding only.

use super::SurfacePoint;
use super::draws::Draws;
use nalgebra::{SMatrix, SVector};

/// Residuals beyond this many standard deviations do not count at all; 95 % efficiency for normal errors [Beaton 1974].
const BIWEIGHT: f64 = 4.685;
/// Least standard deviation that is believed, a share of the tolerance of the start.
const LEAST_SCALE: f64 = 0.02;
/// Rounds of weights.
const ROUNDS: usize = 30;
/// Most steps of the last, unweighted search.
const LAST_STEPS: usize = 8;
/// A step below this share of the tolerance ends the search.
const CONVERGED: f64 = 1e-7;
/// Random samples of the start.
const SAMPLES: usize = 300;
/// Most points that a start is judged by.
const JUDGES: usize = 600;
/// Standard deviation of a normal distribution by the median of its absolute values.
const BY_MEDIAN: f64 = 1.4826;

/// What an element with `N` parameters tells of itself.
pub(super) trait Parametric<const N: usize>: Copy {
    /// Distance of a point, metres, and its derivatives by the parameters.
    fn residual(&self, point: &SurfacePoint) -> (f64, SVector<f64, N>);
    /// After a step of the parameters; `None` where there is no such element.
    fn stepped(&self, step: &SVector<f64, N>) -> Option<Self>;
}

/// The best start that samples of `points` give.
///
/// * `sample`: an element by three points.
/// * `distance`: of a point from an element, metres.
pub(super) fn best_start<E: Copy>(
    points: &[SurfacePoint],
    tolerance: f64,
    given: impl IntoIterator<Item = E>,
    sample: impl Fn([&SurfacePoint; 3]) -> Option<E>,
    distance: impl Fn(&E, &SurfacePoint) -> f64,
) -> Option<E> {
    let mut draws = Draws::new();
    let stride = points.len().div_ceil(JUDGES).max(1);
    // What is far off counts the same however far it is (MSAC [Torr 2000]).
    let cost = |element: &E| -> f64 {
        points.iter().step_by(stride).map(|p| (distance(element, p) / tolerance).powi(2).min(1.0)).sum()
    };
    let mut best: Option<(f64, E)> = None;
    let mut consider = |element: E| {
        let cost = cost(&element);
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, element));
        }
    };
    given.into_iter().for_each(&mut consider);
    if points.len() >= 3 {
        for _ in 0..SAMPLES {
            let picked = [0; 3].map(|_| &points[draws.below(points.len())]);
            sample(picked).into_iter().for_each(&mut consider);
        }
    }
    best.map(|(_, element)| element)
}

/// An element after the search, with the weight of every point: 0 for those that were left out.
pub(super) struct Found<E> {
    pub(super) element: E,
    pub(super) weights: Vec<f64>,
}

/// Searches from `start`; `None` where the points do not determine the parameters.
pub(super) fn search<const N: usize, E: Parametric<N>>(
    start: E,
    points: &[SurfacePoint],
    tolerance: f64,
) -> Option<Found<E>> {
    let mut element = start;
    let mut scale = tolerance;
    let mut weights = vec![0.0; points.len()];
    for round in 0..ROUNDS {
        let residuals: Vec<f64> = points.iter().map(|p| element.residual(p).0).collect();
        let spread = scale_of(&residuals, tolerance).max(LEAST_SCALE * tolerance);
        // From the tolerance of the start down, so that points of other surfaces do not come in.
        scale = if round == 0 { spread.max(0.5 * tolerance) } else { spread.min(scale) };
        for ((weight, residual), point) in weights.iter_mut().zip(&residuals).zip(points) {
            let share = residual / (BIWEIGHT * scale);
            *weight = if share.abs() < 1.0 { point.weight * (1.0 - share * share).powi(2) } else { 0.0 };
        }
        let (next, length) = step(&element, points, &weights)?;
        element = next;
        if length < CONVERGED * tolerance && round > 2 {
            break;
        }
    }
    // Of the points that are left the sum of the squares itself: their residuals then say how well it is known.
    for (weight, point) in weights.iter_mut().zip(points) {
        *weight = if *weight > 0.0 { point.weight } else { 0.0 };
    }
    for _ in 0..LAST_STEPS {
        let (next, length) = step(&element, points, &weights)?;
        element = next;
        if length < CONVERGED * tolerance {
            break;
        }
    }
    Some(Found { element, weights })
}

/// One step, shortened until it lowers the sum of the squares; how far it went.
fn step<const N: usize, E: Parametric<N>>(element: &E, points: &[SurfacePoint], weights: &[f64]) -> Option<(E, f64)> {
    let (normal, right) = equations(element, points, weights);
    let before = squares(element, points, weights);
    let mut damping = 0.0;
    for _ in 0..12 {
        let mut damped = normal;
        (0..N).for_each(|k| damped[(k, k)] *= 1.0 + damping);
        let full: SVector<f64, N> = damped.cholesky()?.solve(&-right);
        if let Some(next) = element.stepped(&full)
            && squares(&next, points, weights) <= before * (1.0 + 1e-12)
        {
            return Some((next, full.norm()));
        }
        damping = if damping == 0.0 { 1e-3 } else { damping * 10.0 };
    }
    // No step lowers the sum: this is its least within rounding.
    Some((*element, 0.0))
}

/// Matrix and right side of the normal equations.
pub(super) fn equations<const N: usize, E: Parametric<N>>(
    element: &E,
    points: &[SurfacePoint],
    weights: &[f64],
) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
    let (mut normal, mut right) = (SMatrix::zeros(), SVector::zeros());
    for (point, weight) in points.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        let (residual, derivative) = element.residual(point);
        normal += derivative * derivative.transpose() * *weight;
        right += derivative * (*weight * residual);
    }
    (normal, right)
}

fn squares<const N: usize, E: Parametric<N>>(element: &E, points: &[SurfacePoint], weights: &[f64]) -> f64 {
    points.iter().zip(weights).map(|(p, w)| w * element.residual(p).0.powi(2)).sum()
}

/// Standard deviation of the residuals that lie within three tolerances, by their median.
fn scale_of(residuals: &[f64], tolerance: f64) -> f64 {
    let mut near: Vec<f64> = residuals.iter().map(|r| r.abs()).filter(|r| *r < 3.0 * tolerance).collect();
    if near.is_empty() {
        return tolerance;
    }
    let middle = near.len() / 2;
    BY_MEDIAN * *near.select_nth_unstable_by(middle, f64::total_cmp).1
}
