//! The least-squares cylinder.
//!
//! Starts: the axis is across all normals, so it is the direction in which their Gauss image is thinnest; and of two points with
//! their normals, the axis is the cross product of the normals, and radius and place follow from where these meet
//! [Schnabel 2007, section 4.1].

use super::covariance::{SurfaceErrors, judge};
use super::element::{Cylinder, Element, across, oriented};
use super::robust::{Parametric, best_start, search};
use super::{Fit, FitError, SurfacePoint};
use nalgebra::{Matrix3, Matrix6, SVector, Vector3};

/// Share of the radius above which its standard uncertainty makes it no figure.
const LEAST_KNOWN: f64 = 0.15;
/// Standard uncertainty of the direction above which there is none, radians.
const LARGEST_TURN: f64 = 0.2;
/// Least angle between two normals that show where an axis is, radians.
const LEAST_ANGLE: f64 = 0.15;
/// Least part of a turn that the points go around the axis, radians: noise can make an arc of a short strip.
const LEAST_ARC: f64 = 0.35;

impl Parametric<5> for Cylinder {
    fn residual(&self, point: &SurfacePoint) -> (f64, SVector<f64, 5>) {
        let from = point.position - self.point;
        let along = self.axis.dot(&from);
        let out = from - self.axis * along;
        let length = out.norm();
        // On the axis no direction is outwards.
        let out = if length > 0.0 { out / length } else { Vector3::zeros() };
        let (u, v) = across(self.axis);
        let (by_u, by_v) = (-out.dot(&u), -out.dot(&v));
        (length - self.radius, SVector::from([by_u, by_v, along * by_u, along * by_v, -1.0]))
    }

    fn stepped(&self, step: &SVector<f64, 5>) -> Option<Self> {
        let (u, v) = across(self.axis);
        let axis = (self.axis + u * step[2] + v * step[3]).try_normalize(f64::EPSILON)?;
        let radius = self.radius + step[4];
        (radius > 0.0).then_some(Self { point: self.point + u * step[0] + v * step[1], axis, radius })
    }
}

/// Fits a cylinder.
pub(super) fn fit(points: &[SurfacePoint], errors: &SurfaceErrors) -> Result<Fit, FitError> {
    if points.len() < 6 {
        return Err(FitError::TooFewPoints);
    }
    let distance = |c: &Cylinder, p: &SurfacePoint| {
        let from = p.position - c.point;
        (from - c.axis * c.axis.dot(&from)).norm() - c.radius
    };
    let start =
        best_start(points, errors.tolerance, by_normals(points), by_two, distance).ok_or(FitError::ArcTooShort)?;
    let start = centred(start, points, |p| distance(&start, p).abs() < 3.0 * errors.tolerance);
    let found = search(start, points, errors.tolerance).ok_or(FitError::ArcTooShort)?;
    let mut used = found.weights.iter();
    let cylinder = centred(found.element, points, |_| used.next().is_some_and(|w| *w > 0.0));
    let cylinder = Cylinder { axis: oriented(cylinder.axis), ..cylinder };
    let judged = judge(&cylinder, points, &found.weights, errors)?;
    let variance = |k: usize| judged.covariance[(k, k)];
    let unknown =
        variance(4) > (LEAST_KNOWN * cylinder.radius).powi(2) || variance(2).max(variance(3)) > LARGEST_TURN.powi(2);
    if unknown || arc(&cylinder, points, &found.weights) < LEAST_ARC {
        return Err(FitError::ArcTooShort);
    }
    if 2 * judged.used < points.len() {
        return Err(FitError::NotThisForm);
    }
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<5, 5>(0, 0).copy_from(&judged.covariance);
    Ok(Fit {
        element: Element::Cylinder(cylinder),
        rms: judged.rms,
        largest: judged.largest,
        used: judged.used,
        left_out: points.len() - judged.used,
        covariance,
    })
}

/// The cylinder that all normals give together; `None` where they are not known.
fn by_normals(points: &[SurfacePoint]) -> Option<Cylinder> {
    let image: Matrix3<f64> = points.iter().map(|p| p.normal * p.normal.transpose()).sum();
    let eigen = image.symmetric_eigen();
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned().try_normalize(1e-9)?;
    // Across the axis, p = c + r n in the mean: r by regression.
    let flat = |v: Vector3<f64>| v - axis * axis.dot(&v);
    let count = points.len() as f64;
    let middle = points.iter().map(|p| flat(p.position)).sum::<Vector3<f64>>() / count;
    let normal = points.iter().map(|p| flat(p.normal)).sum::<Vector3<f64>>() / count;
    let (mut products, mut squares) = (0.0, 0.0);
    for p in points {
        let from = flat(p.normal) - normal;
        products += from.dot(&(flat(p.position) - middle));
        squares += from.norm_squared();
    }
    let radius = products / squares;
    (radius.abs() > 0.0 && radius.is_finite()).then(|| Cylinder {
        point: middle - normal * radius,
        axis,
        radius: radius.abs(),
    })
}

/// The cylinder of the first two of three points.
fn by_two([a, b, _]: [&SurfacePoint; 3]) -> Option<Cylinder> {
    let cross = a.normal.cross(&b.normal);
    if cross.norm() < LEAST_ANGLE {
        return None;
    }
    let axis = cross.normalize();
    let flat = |v: Vector3<f64>| v - axis * axis.dot(&v);
    // a + s n = b + t m across the axis.
    let (n, m) = (flat(a.normal), flat(b.normal));
    let between = flat(b.position - a.position);
    let s = between.cross(&m).dot(&axis) / n.cross(&m).dot(&axis);
    let point = a.position + n * s;
    let radius = 0.5 * (flat(a.position - point).norm() + flat(b.position - point).norm());
    (radius.is_finite() && radius > 0.0).then_some(Cylinder { point, axis, radius })
}

/// The same cylinder, its point in the middle of those that `belongs` accepts, along the axis.
fn centred(cylinder: Cylinder, points: &[SurfacePoint], mut belongs: impl FnMut(&SurfacePoint) -> bool) -> Cylinder {
    let (mut sum, mut whole) = (0.0, 0.0);
    for p in points {
        if belongs(p) {
            sum += p.weight * cylinder.axis.dot(&(p.position - cylinder.point));
            whole += p.weight;
        }
    }
    let along = if whole > 0.0 { sum / whole } else { 0.0 };
    Cylinder { point: cylinder.point + cylinder.axis * along, ..cylinder }
}

/// How much of a turn about the axis the used points fill, radians.
fn arc(cylinder: &Cylinder, points: &[SurfacePoint], weights: &[f64]) -> f64 {
    const PARTS: usize = 72;
    let (u, v) = across(cylinder.axis);
    let mut filled = [false; PARTS];
    for (p, _) in points.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        let from = p.position - cylinder.point;
        let turn = from.dot(&v).atan2(from.dot(&u)) / std::f64::consts::TAU + 0.5;
        filled[((turn * PARTS as f64) as usize).min(PARTS - 1)] = true;
    }
    std::f64::consts::TAU * filled.iter().filter(|f| **f).count() as f64 / PARTS as f64
}
