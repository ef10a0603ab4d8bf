//! The least-squares sphere. It starts where the normals of two points meet [Schnabel 2007, section 4.1].

use super::covariance::{SurfaceErrors, judge};
use super::element::{Element, Sphere};
use super::robust::{Parametric, best_start, search};
use super::{Fit, FitError, SurfacePoint};
use nalgebra::{Matrix6, Vector3, Vector4};

/// Share of the radius above which its standard uncertainty makes it no figure.
const LEAST_KNOWN: f64 = 0.15;
/// Least angle between two normals that show where a centre is, radians.
const LEAST_ANGLE: f64 = 0.15;
/// Radius by the extent of the points above which they are a plane.
const LARGEST_RADIUS: f64 = 20.0;

impl Parametric<4> for Sphere {
    fn residual(&self, point: &SurfacePoint) -> (f64, Vector4<f64>) {
        let from = point.position - self.centre;
        let length = from.norm();
        let out = if length > 0.0 { from / length } else { Vector3::zeros() };
        (length - self.radius, Vector4::new(-out.x, -out.y, -out.z, -1.0))
    }

    fn stepped(&self, step: &Vector4<f64>) -> Option<Self> {
        let radius = self.radius + step[3];
        (radius > 0.0).then(|| Self { centre: self.centre + step.xyz(), radius })
    }
}

/// Fits a sphere.
pub(super) fn fit(points: &[SurfacePoint], errors: &SurfaceErrors) -> Result<Fit, FitError> {
    if points.len() < 5 {
        return Err(FitError::TooFewPoints);
    }
    let distance = |s: &Sphere, p: &SurfacePoint| (p.position - s.centre).norm() - s.radius;
    let start = best_start(points, errors.tolerance, None, by_two, distance).ok_or(FitError::ArcTooShort)?;
    let found = search(start, points, errors.tolerance).ok_or(FitError::ArcTooShort)?;
    let sphere = found.element;
    let judged = judge(&sphere, points, &found.weights, errors).map_err(|error| match error {
        FitError::Collinear => FitError::ArcTooShort,
        error => error,
    })?;
    let (low, high) = points.iter().fold((Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN)), |(low, high), p| {
        (low.inf(&p.position), high.sup(&p.position))
    });
    let is_flat = sphere.radius > LARGEST_RADIUS * (high - low).norm();
    if is_flat || judged.covariance[(3, 3)] > (LEAST_KNOWN * sphere.radius).powi(2) {
        return Err(FitError::ArcTooShort);
    }
    if 2 * judged.used < points.len() {
        return Err(FitError::NotThisForm);
    }
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<4, 4>(0, 0).copy_from(&judged.covariance);
    Ok(Fit {
        element: Element::Sphere(sphere),
        rms: judged.rms,
        largest: judged.largest,
        used: judged.used,
        left_out: points.len() - judged.used,
        covariance,
    })
}

/// The sphere of the first two of three points: its centre is the middle of the shortest way between their normals.
fn by_two([a, b, _]: [&SurfacePoint; 3]) -> Option<Sphere> {
    if a.normal.cross(&b.normal).norm() < LEAST_ANGLE {
        return None;
    }
    let cosine = a.normal.dot(&b.normal);
    let between = b.position - a.position;
    let (along_a, along_b) = (between.dot(&a.normal), between.dot(&b.normal));
    let whole = 1.0 - cosine * cosine;
    let (s, t) = ((along_a - cosine * along_b) / whole, (cosine * along_a - along_b) / whole);
    let centre = (a.position + a.normal * s + b.position + b.normal * t) * 0.5;
    let radius = 0.5 * ((a.position - centre).norm() + (b.position - centre).norm());
    (radius.is_finite() && radius > 0.0).then_some(Sphere { centre, radius })
}
