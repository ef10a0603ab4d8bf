//! How far the part reaches: its convex hull, from outside.
//!
//! A model may lack surface that views measured: where a network mistook it for background, or where only one view saw it. A
//! measured point far from all surface of the model is background for certain only where the part cannot be.

use nalgebra::{Point3, Vector3};

/// Directions in which the part's reach is known.
const DIRECTIONS: usize = 128;

/// The part lies within all half spaces `direction . x <= reach`.
#[derive(Clone, Debug)]
pub(crate) struct Extent {
    half_spaces: Vec<(Vector3<f64>, f64)>,
}

impl Extent {
    /// Of the points of a part; without any, nothing is within.
    pub(crate) fn of<'a>(points: impl Iterator<Item = &'a [f32; 3]> + Clone) -> Self {
        let reach = |direction: &Vector3<f64>| {
            let along = points.clone().map(|p| direction.dot(&Vector3::from(p.map(f64::from))));
            along.fold(f64::NEG_INFINITY, f64::max)
        };
        Self { half_spaces: directions().map(|direction| (direction, reach(&direction))).collect() }
    }

    /// Whether a point may be of the part: it lies beyond its reach by no more than `margin` metres in any direction.
    pub(crate) fn holds(&self, point: &Point3<f64>, margin: f64) -> bool {
        self.half_spaces.iter().all(|(direction, reach)| direction.dot(&point.coords) <= reach + margin)
    }
}

/// Directions evenly over the sphere (spherical Fibonacci lattice).
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..DIRECTIONS).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
        let (radius, angle) = ((1.0 - z * z).sqrt(), turn * k as f64);
        Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_between_the_points_is_within_and_what_lies_beyond_is_not() {
        let corners: Vec<[f32; 3]> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|c| c as f32 * 0.1)).collect();
        let extent = Extent::of(corners.iter());
        let holds = |x: f64, y: f64, z: f64| extent.holds(&Point3::new(x, y, z), 1e-3);
        assert!(holds(0.05, 0.05, 0.05) && holds(0.0, 0.1, 0.1) && holds(0.1, 0.02, 0.099));
        assert!(!holds(0.05, 0.05, 0.12) && !holds(-0.02, 0.05, 0.05) && !holds(0.13, 0.13, 0.13));
        assert!(!Extent::of([].iter()).holds(&Point3::origin(), 1.0));
    }
}
