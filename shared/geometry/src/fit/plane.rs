//! The least-squares plane.

use super::covariance::{SurfaceErrors, judge};
use super::element::{Element, Plane, across};
use super::robust::{Parametric, best_start, search};
use super::{Fit, FitError, SurfacePoint};
use nalgebra::{Matrix6, Vector3};

/// Width of the points across their longest extent below which they lie on a line, a share of that.
const NARROWEST: f64 = 1e-3;
/// Standard uncertainty of the direction above which there is none, radians.
const LARGEST_TURN: f64 = 0.2;

impl Parametric<3> for Plane {
    fn residual(&self, point: &SurfacePoint) -> (f64, Vector3<f64>) {
        let from = point.position - self.point;
        let (u, v) = across(self.normal);
        (from.dot(&self.normal), Vector3::new(-1.0, from.dot(&u), from.dot(&v)))
    }

    fn stepped(&self, step: &Vector3<f64>) -> Option<Self> {
        let (u, v) = across(self.normal);
        let normal = (self.normal + u * step[1] + v * step[2]).try_normalize(f64::EPSILON)?;
        Some(Self { point: self.point + self.normal * step[0], normal })
    }
}

/// Fits a plane; its normal shows to the side of most normals of the points.
pub(super) fn fit(points: &[SurfacePoint], errors: &SurfaceErrors) -> Result<Fit, FitError> {
    if points.len() < 4 {
        return Err(FitError::TooFewPoints);
    }
    let middle = points.iter().map(|p| p.position).sum::<Vector3<f64>>() / points.len() as f64;
    let mean = points.iter().map(|p| p.normal).sum::<Vector3<f64>>();
    let by_normals = mean.try_normalize(1e-6).map(|normal| Plane { point: middle, normal });
    let distance = |plane: &Plane, p: &SurfacePoint| (p.position - plane.point).dot(&plane.normal);
    let start = best_start(points, errors.tolerance, by_normals, through, distance).ok_or(FitError::Collinear)?;
    // About the middle of its points the parameters depend on each other least.
    let start = centred(start, points, |p| distance(&start, p).abs() < 3.0 * errors.tolerance);
    let found = search(start, points, errors.tolerance).ok_or(FitError::Collinear)?;
    let mut used = found.weights.iter();
    let mut plane = centred(found.element, points, |_| used.next().is_some_and(|w| *w > 0.0));
    if mean.dot(&plane.normal) < 0.0 {
        plane.normal = -plane.normal;
    }
    if is_line(&plane, points, &found.weights) {
        return Err(FitError::Collinear);
    }
    let judged = judge(&plane, points, &found.weights, errors)?;
    if judged.covariance[(1, 1)].max(judged.covariance[(2, 2)]) > LARGEST_TURN.powi(2) {
        return Err(FitError::TooFewPoints);
    }
    if 2 * judged.used < points.len() {
        return Err(FitError::NotThisForm);
    }
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&judged.covariance);
    Ok(Fit {
        element: Element::Plane(plane),
        rms: judged.rms,
        largest: judged.largest,
        used: judged.used,
        left_out: points.len() - judged.used,
        covariance,
    })
}

/// The plane through three points.
fn through([a, b, c]: [&SurfacePoint; 3]) -> Option<Plane> {
    let normal = (b.position - a.position).cross(&(c.position - a.position)).try_normalize(f64::MIN_POSITIVE)?;
    Some(Plane { point: a.position, normal })
}

/// The same plane, its point in the middle of those that `belongs` accepts.
fn centred(plane: Plane, points: &[SurfacePoint], mut belongs: impl FnMut(&SurfacePoint) -> bool) -> Plane {
    let (mut sum, mut whole) = (Vector3::zeros(), 0.0);
    for p in points {
        if belongs(p) {
            sum += p.position * p.weight;
            whole += p.weight;
        }
    }
    if whole <= 0.0 {
        return plane;
    }
    let middle = sum / whole;
    Plane { point: middle - plane.normal * (middle - plane.point).dot(&plane.normal), normal: plane.normal }
}

/// Whether the used points are so narrow that a plane could turn about them.
fn is_line(plane: &Plane, points: &[SurfacePoint], weights: &[f64]) -> bool {
    let (u, v) = across(plane.normal);
    let used = || points.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(p, _)| p.position - plane.point);
    let sum = |of: &dyn Fn(Vector3<f64>) -> f64| used().map(of).sum::<f64>();
    let (uu, uv, vv) = (sum(&|p| p.dot(&u).powi(2)), sum(&|p| p.dot(&u) * p.dot(&v)), sum(&|p| p.dot(&v).powi(2)));
    let (half, root) = (0.5 * (uu + vv), (0.25 * (uu - vv).powi(2) + uv * uv).sqrt());
    half - root <= NARROWEST.powi(2) * (half + root)
}
