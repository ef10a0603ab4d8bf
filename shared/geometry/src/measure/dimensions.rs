//! Distances and angles between points of a surface, each with its standard uncertainty.
//!
//! What is known of a point's error is the grid that it was fused on: along each axis it may lie anywhere in its voxel, a
//! rectangular distribution of half a voxel to either side. Its standard deviation is half a voxel over the root of three,
//! and goes into distance and angle by their derivatives [JCGM 100], 4.3.7 and 5.1.2. Errors that all points share
//! (of camera poses, of the scale of the depth camera) are not in it.

use crate::vector::{cross, dot, length, sub};

/// A figure and its standard uncertainty, both in the same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The figure.
    pub value: f64,
    /// One standard deviation.
    pub standard_uncertainty: f64,
}

impl Estimate {
    /// Expanded uncertainty with the coverage factor 2: about 95 % of errors are smaller.
    pub fn expanded(self) -> f64 {
        2.0 * self.standard_uncertainty
    }
}

/// Standard uncertainty of one coordinate of a point on a grid of `voxel` (metres): that of a rectangular distribution of half a
/// voxel to either side.
pub fn grid_uncertainty(voxel: f64) -> f64 {
    voxel / 2.0 / 3.0_f64.sqrt()
}

/// Distance of two points in metres.
///
/// * `coordinate`: standard uncertainty of each of their coordinates, metres.
pub fn distance(a: [f64; 3], b: [f64; 3], coordinate: f64) -> Estimate {
    // Its derivative by either point is a unit vector.
    Estimate { value: length(sub(b, a)), standard_uncertainty: 2.0_f64.sqrt() * coordinate }
}

/// The way from `a` to `b` along each axis, signed, in metres; `coordinate` as of [`distance`].
pub fn along_axes(a: [f64; 3], b: [f64; 3], coordinate: f64) -> [Estimate; 3] {
    sub(b, a).map(|value| Estimate { value, standard_uncertainty: 2.0_f64.sqrt() * coordinate })
}

/// Angle at `vertex` between the ways to `a` and to `b`, radians, 0 to pi; `None` where one of these lies at the vertex.
/// `coordinate` as of [`distance`].
pub fn angle(a: [f64; 3], vertex: [f64; 3], b: [f64; 3], coordinate: f64) -> Option<Estimate> {
    let (to_a, to_b) = (sub(a, vertex), sub(b, vertex));
    let (length_a, length_b) = (length(to_a), length(to_b));
    if !(length_a > 0.0 && length_b > 0.0) {
        return None;
    }
    let value = length(cross(to_a, to_b)).atan2(dot(to_a, to_b));
    // The derivative by an end is as long as one over its way, across it. That by the vertex is minus the sum of both; the
    // angle between them is pi - value.
    let (by_a, by_b) = (1.0 / length_a, 1.0 / length_b);
    let squares = 2.0 * (by_a * by_a + by_b * by_b - by_a * by_b * value.cos());
    Some(Estimate { value, standard_uncertainty: coordinate * squares.sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    const VOXEL: f64 = 1e-3;

    #[test]
    fn lengths_and_angles_are_those_of_school() {
        let u = grid_uncertainty(VOXEL);
        assert!((u - 0.288_675e-3).abs() < 1e-9);
        let way = distance([0.1, 0.2, 0.3], [0.13, 0.24, 0.3], u);
        assert!((way.value - 0.05).abs() < 1e-12);
        assert!((way.expanded() - VOXEL * (2.0_f64 / 3.0).sqrt()).abs() < 1e-9, "0.82 voxels");
        let [x, y, z] = along_axes([0.1, 0.2, 0.3], [0.13, 0.24, 0.2], u).map(|e| e.value);
        assert!((x - 0.03).abs() < 1e-12 && (y - 0.04).abs() < 1e-12 && (z + 0.1).abs() < 1e-12);
        let at = |b| angle([1.0, 0.0, 0.0], [0.0; 3], b, u).map(|e| e.value);
        for (b, expected) in
            [([0.0, 2.0, 0.0], FRAC_PI_2), ([-1.0, 0.0, 0.0], PI), ([3.0, 0.0, 0.0], 0.0), ([1.0, 0.0, 1.0], FRAC_PI_4)]
        {
            assert!((at(b).expect("an angle") - expected).abs() < 1e-12);
        }
        assert_eq!(at([0.0; 3]), None);
        assert_eq!(at([f64::NAN; 3]), None);
    }

    /// Points that are off by any place in their voxel scatter as the uncertainties say.
    #[test]
    fn simulated_errors_scatter_as_stated() {
        let u = grid_uncertainty(VOXEL);
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let points: [[f64; 3]; 3] = [[0.02, 0.0, 0.01], [0.0, 0.0, 0.0], [0.005, 0.015, -0.01]];
        let stated = [distance(points[0], points[2], u), angle(points[0], points[1], points[2], u).expect("an angle")];
        let (mut squares, mut inside) = ([0.0; 2], [0; 2]);
        const TRIALS: usize = 20_000;
        for _ in 0..TRIALS {
            let [a, v, b] = points.map(|p| p.map(|c| c + (random.random::<f64>() - 0.5) * VOXEL));
            let figures = [distance(a, b, u).value, angle(a, v, b, u).expect("an angle").value];
            for k in 0..2 {
                let error = figures[k] - stated[k].value;
                squares[k] += error * error;
                inside[k] += usize::from(error.abs() <= stated[k].expanded());
            }
        }
        for k in 0..2 {
            let scatter = (squares[k] / TRIALS as f64).sqrt();
            let ratio = scatter / stated[k].standard_uncertainty;
            assert!((0.97..1.03).contains(&ratio), "figure {k}: {ratio} of what is stated");
            assert!(inside[k] as f64 > 0.94 * TRIALS as f64, "figure {k}: {} inside", inside[k]);
        }
    }
}
