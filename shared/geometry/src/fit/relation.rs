//! Distances, angles and steps between features, with their uncertainties.
//!
//! Spheres and circles count by their centres, cylinders by their axes. Each figure is the length of a vector that follows
//! from the parameters of both features: from one foot to the other, or the turn from one direction to the other. Its
//! uncertainty is that of the vector along itself, by the derivatives [JCGM 100], 5.1.2. Where the vector is not longer than
//! what it is uncertain by (two axes that are parallel but for their errors), any of its directions may be that of the error,
//! and the uncertainties of all count: a length is never below zero.
//!
//! Elements that are parallel within ten degrees have a distance at one place: where the middle of the second is. The
//! distances of others would be zero, or lie where nothing was measured.

use super::feature::{Feature, Locus};
use crate::measure::dimensions::Estimate;
use nalgebra::{Matrix3, Vector3, Vector6};
use std::f64::consts::FRAC_PI_2;

/// Cosine of the angle below which directions are parallel: ten degrees.
const PARALLEL: f64 = 0.984_807_753;
/// Step of the derivatives, metres and radians.
const STEP: f64 = 1e-6;

/// A figure between two features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relation {
    /// Metres or radians.
    pub estimate: Estimate,
    /// From where to where a distance was taken, metres; at an angle the middles.
    pub ends: [Vector3<f64>; 2],
}

/// Distance between two features, metres; `None` where they have none: lines and planes that meet.
pub fn distance(first: &Feature, second: &Feature) -> Option<Relation> {
    let feet = |first: &Feature, second: &Feature| feet(first.locus(), second.locus());
    let ends = feet(first, second)?;
    // What is near parallel stays so: the feet exist on both sides.
    let estimate = length(first, second, |a, b| feet(a, b).map(|[from, to]| to - from))?;
    Some(Relation { estimate, ends })
}

/// Angle between two features that have a direction, radians, 0 to a quarter of a turn; between a plane or circle and an axis
/// the angle of the axis with the plane. `None` where one has no direction.
pub fn angle(first: &Feature, second: &Feature) -> Option<Relation> {
    let (a, b) = (first.direction()?, second.direction()?);
    // Directions have no sense: of both the one that makes the smaller angle.
    let sign = if a.dot(&b) < 0.0 { -1.0 } else { 1.0 };
    let turn = |first: &Feature, second: &Feature| {
        let (a, b) = (first.direction()?, second.direction()? * sign);
        let cross = a.cross(&b);
        let sine = cross.norm();
        // Where they are parallel the turn is its sine.
        let stretch = if sine > 0.0 { sine.atan2(a.dot(&b)) / sine } else { 1.0 };
        Some(cross * stretch)
    };
    let mut estimate = length(first, second, turn)?;
    let is_axis = |feature: &Feature| matches!(feature.locus(), Locus::Line(..));
    if is_axis(first) != is_axis(second) {
        estimate.value = FRAC_PI_2 - estimate.value;
    }
    Some(Relation { estimate, ends: [first.middle(), second.middle()] })
}

/// Height of the middle of the second above the plane of the first along its normal, signed, metres; `None` unless the first
/// is a plane.
pub fn step_height(first: &Feature, second: &Feature) -> Option<Relation> {
    let height = |first: &Feature, second: &Feature| match first.locus() {
        Locus::Plane(point, normal) => Some(normal.dot(&(second.middle() - point))),
        _ => None,
    };
    let value = height(first, second)?;
    let Locus::Plane(_, normal) = first.locus() else { return None };
    let along = propagated(first, second, |a, b| Some(Vector3::new(height(a, b)?, 0.0, 0.0)))?;
    let to = second.middle();
    let estimate = Estimate { value, standard_uncertainty: along[(0, 0)].max(0.0).sqrt() };
    Some(Relation { estimate, ends: [to - normal * value, to] })
}

/// The points of two features that lie nearest to each other.
fn feet(first: Locus, second: Locus) -> Option<[Vector3<f64>; 2]> {
    let onto_line = |p: Vector3<f64>, on: Vector3<f64>, axis: Vector3<f64>| on + axis * axis.dot(&(p - on));
    let onto_plane = |p: Vector3<f64>, on: Vector3<f64>, normal: Vector3<f64>| p - normal * normal.dot(&(p - on));
    match (first, second) {
        (Locus::Point(a), Locus::Point(b)) => Some([a, b]),
        (Locus::Line(on, axis), Locus::Point(p)) => Some([onto_line(p, on, axis), p]),
        (Locus::Plane(on, normal), Locus::Point(p)) => Some([onto_plane(p, on, normal), p]),
        (Locus::Line(on, axis), Locus::Line(p, other)) => {
            let cosine = axis.dot(&other);
            if cosine.abs() > PARALLEL {
                return Some([onto_line(p, on, axis), p]);
            }
            let (between, whole) = (p - on, 1.0 - cosine * cosine);
            let (along, along_other) = (between.dot(&axis), between.dot(&other));
            let (s, t) = ((along - cosine * along_other) / whole, (cosine * along - along_other) / whole);
            Some([on + axis * s, p + other * t])
        }
        (Locus::Plane(on, normal), Locus::Line(p, axis)) => {
            let meets = normal.dot(&axis).abs() > (1.0 - PARALLEL * PARALLEL).sqrt();
            (!meets).then(|| [onto_plane(p, on, normal), p])
        }
        (Locus::Plane(on, normal), Locus::Plane(p, other)) => {
            (normal.dot(&other).abs() > PARALLEL).then(|| [onto_plane(p, on, normal), p])
        }
        (first, second) => feet(second, first).map(|[to, from]| [from, to]),
    }
}

/// Length of the vector that follows from both features.
fn length(
    first: &Feature,
    second: &Feature,
    vector: impl Fn(&Feature, &Feature) -> Option<Vector3<f64>>,
) -> Option<Estimate> {
    let value = vector(first, second)?;
    let covariance = propagated(first, second, vector)?;
    let all = covariance.trace().max(0.0);
    let along = value.try_normalize(2.0 * all.sqrt()).map_or(all, |v| v.dot(&(covariance * v)).max(0.0));
    Some(Estimate { value: value.norm(), standard_uncertainty: along.sqrt() })
}

/// Covariance of the vector that follows from both features.
fn propagated(
    first: &Feature,
    second: &Feature,
    vector: impl Fn(&Feature, &Feature) -> Option<Vector3<f64>>,
) -> Option<Matrix3<f64>> {
    let mut covariance = Matrix3::zeros();
    for which in 0..2 {
        let feature = if which == 0 { first } else { second };
        let mut derivatives = nalgebra::Matrix3x6::zeros();
        for k in 0..6 {
            let moved = |step: f64| {
                let mut along = Vector6::zeros();
                along[k] = step;
                let moved = feature.moved(&along);
                if which == 0 { vector(&moved, second) } else { vector(first, &moved) }
            };
            derivatives.set_column(k, &((moved(STEP)? - moved(-STEP)?) / (2.0 * STEP)));
        }
        covariance += derivatives * feature.covariance() * derivatives.transpose();
    }
    Some(covariance)
}
