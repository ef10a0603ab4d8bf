//! The least-squares circle in space: the plane of its points first, then the circle in it [Forbes 1989].

use super::covariance::{SurfaceErrors, judge};
use super::element::{Circle, Element, Plane, across};
use super::robust::{Parametric, best_start, search};
use super::{Fit, FitError, SurfacePoint, plane};
use nalgebra::{Matrix3, Matrix6, Vector3};

/// Share of the radius above which its standard uncertainty makes it no figure.
const LEAST_KNOWN: f64 = 0.15;
/// Radius by the extent of the points above which they are a line.
const LARGEST_RADIUS: f64 = 20.0;

/// A circle that moves in its plane only.
#[derive(Clone, Copy)]
struct InPlane(Circle);

impl Parametric<3> for InPlane {
    fn residual(&self, point: &SurfacePoint) -> (f64, Vector3<f64>) {
        let Circle { centre, normal, radius } = self.0;
        let from = point.position - centre;
        let out = from - normal * normal.dot(&from);
        let length = out.norm();
        let out = if length > 0.0 { out / length } else { Vector3::zeros() };
        let (u, v) = across(normal);
        (length - radius, Vector3::new(-out.dot(&u), -out.dot(&v), -1.0))
    }

    fn stepped(&self, step: &Vector3<f64>) -> Option<Self> {
        let Circle { centre, normal, radius } = self.0;
        let (u, v) = across(normal);
        let radius = radius + step[2];
        (radius > 0.0).then(|| Self(Circle { centre: centre + u * step[0] + v * step[1], normal, radius }))
    }
}

/// Fits a circle to points of a line, such as the rim of a hole. The normals of the points are not asked.
pub(super) fn fit(points: &[SurfacePoint], errors: &SurfaceErrors) -> Result<Fit, FitError> {
    if points.len() < 6 {
        return Err(FitError::TooFewPoints);
    }
    let distance = |c: &Circle, p: &SurfacePoint| Element::Circle(*c).distance(&p.position);
    let rough = best_start(points, errors.tolerance, None, through, distance).ok_or(FitError::Collinear)?;
    let near: Vec<SurfacePoint> =
        points.iter().filter(|p| distance(&rough, p) < 3.0 * errors.tolerance).copied().collect();
    if 2 * near.len() < points.len() {
        return Err(FitError::NotThisForm);
    }
    let flat = plane::fit(&near, errors)?;
    let Element::Plane(Plane { point, normal }) = flat.element else { return Err(FitError::NotThisForm) };
    let centre = rough.centre - normal * normal.dot(&(rough.centre - point));
    let start = InPlane(Circle { centre, normal, radius: rough.radius });
    let found = search(start, &near, errors.tolerance).ok_or(FitError::ArcTooShort)?;
    let circle = found.element.0;
    let judged = judge(&found.element, &near, &found.weights, errors).map_err(|error| match error {
        FitError::Collinear => FitError::ArcTooShort,
        error => error,
    })?;
    let extent = near.iter().map(|p| (p.position - point).norm()).fold(0.0, f64::max);
    let is_straight = circle.radius > LARGEST_RADIUS * extent;
    if is_straight || judged.covariance[(2, 2)] > (LEAST_KNOWN * circle.radius).powi(2) {
        return Err(FitError::ArcTooShort);
    }
    Ok(Fit {
        element: Element::Circle(circle),
        rms: judged.rms,
        largest: judged.largest,
        used: judged.used,
        left_out: points.len() - judged.used,
        covariance: joined(&circle, point, &judged.covariance, &flat.covariance.fixed_view::<3, 3>(0, 0).into_owned()),
    })
}

/// The circle through three points.
fn through([a, b, c]: [&SurfacePoint; 3]) -> Option<Circle> {
    let (ab, ac) = (b.position - a.position, c.position - a.position);
    let across = ab.cross(&ac);
    let normal = across.try_normalize(f64::MIN_POSITIVE)?;
    let from_a =
        (across.cross(&ab) * ac.norm_squared() + ac.cross(&across) * ab.norm_squared()) / (2.0 * across.norm_squared());
    let radius = from_a.norm();
    radius.is_finite().then(|| Circle { centre: a.position + from_a, normal, radius })
}

/// Covariance of the circle's six parameters by those in its plane (ways across, radius) and those of the plane (way along the
/// normal, turns) about `point`.
fn joined(circle: &Circle, point: Vector3<f64>, within: &Matrix3<f64>, plane: &Matrix3<f64>) -> Matrix6<f64> {
    // A turn of the plane about its point lifts or lowers the centre.
    let (u, v) = across(circle.normal);
    let arm = circle.centre - point;
    let at_centre = Matrix3::new(1.0, -arm.dot(&u), -arm.dot(&v), 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let plane = at_centre * plane * at_centre.transpose();
    let mut covariance = Matrix6::zeros();
    let (in_plane, out_of_plane) = ([0, 1, 5], [2, 3, 4]);
    for i in 0..3 {
        for j in 0..3 {
            covariance[(in_plane[i], in_plane[j])] = within[(i, j)];
            covariance[(out_of_plane[i], out_of_plane[j])] = plane[(i, j)];
        }
    }
    covariance
}
