//! Points on a mesh, evenly by area: what is measured from where a model is a surface.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A point on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) position: [f64; 3],
    /// Unit normal of the triangle.
    pub(super) normal: [f32; 3],
    /// The corner that it is nearest to in barycentric terms.
    pub(super) vertex: u32,
}

/// `n` points, one in each `n`-th of the area, seeded; none if the mesh has no area.
pub(super) fn sample(positions: &[[f64; 3]], triangles: &[[u32; 3]], n: usize, seed: u64) -> Vec<Sample> {
    let corner = |i: u32| {
        let [x, y, z] = positions[i as usize];
        Point3::new(x, y, z)
    };
    let double_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        (b - a).cross(&(c - a))
    };
    let all: f64 = triangles.iter().map(|t| double_area(t).norm()).sum();
    if !(all > 0.0 && all.is_finite()) {
        return Vec::new();
    }
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut out = Vec::with_capacity(n);
    let step = all / n as f64;
    let (mut before, mut next) = (0.0, rng.random_range(0.0..1.0) * step);
    for t in triangles {
        let across = double_area(t);
        let after = before + across.norm();
        while next < after && out.len() < n {
            let [a, b, c] = t.map(corner);
            let (u, v) = (rng.random_range(0.0..1.0_f64).sqrt(), rng.random_range(0.0..1.0_f64));
            let weights = [1.0 - u, u * (1.0 - v), u * v];
            let p: Vector3<f64> = a.coords * weights[0] + b.coords * weights[1] + c.coords * weights[2];
            let nearest = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
            let normal = across / across.norm();
            out.push(Sample {
                position: [p.x, p.y, p.z],
                normal: [normal.x as f32, normal.y as f32, normal.z as f32],
                vertex: t[nearest],
            });
            next = (out.len() as f64 + rng.random_range(0.0..1.0)) * step;
        }
        before = after;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_even_by_area() {
        // A square of area 1 and a triangle of area 3 beside it, and a triangle of none.
        let positions =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [4.0, 0.0, 0.0], [1.0, 2.0, 0.0]];
        let triangles = [[0, 1, 2], [0, 2, 3], [3, 3, 2], [1, 4, 5]];
        let samples = sample(&positions, &triangles, 4000, 1);
        assert_eq!(samples.len(), 4000);
        let on_square = samples.iter().filter(|s| s.position[0] < 1.0).count();
        assert!((990..=1010).contains(&on_square), "{on_square}");
        let mean = samples.iter().filter(|s| s.position[0] > 1.0).map(|s| s.position[0]).sum::<f64>() / 3000.0;
        assert!((mean - 2.0).abs() < 0.02, "{mean}");
        assert!(samples.iter().all(|s| s.normal == [0.0, 0.0, 1.0]));
        let corner = samples.iter().find(|s| s.vertex == 4).expect("a point near corner 4");
        assert!(corner.position[0] > 2.0);
        assert_eq!(sample(&positions, &triangles, 50, 7), sample(&positions, &triangles, 50, 7));
        assert!(sample(&positions, &[[0, 0, 1], [3, 3, 3]], 100, 1).is_empty());
    }
}
