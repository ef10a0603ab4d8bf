//! A seeded part with detail at every size, and points on it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A mesh.
pub(crate) struct Part {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// A ribbed, knurled body of revolution about the size of a starter motor, with `around` times `along` quads.
pub(crate) fn part(around: u32, along: u32) -> Part {
    let place = |i: u32| {
        let (u, v) = (i % around, i / around);
        let angle = std::f32::consts::TAU * u as f32 / around as f32;
        let t = v as f32 / (along - 1) as f32;
        let body = 0.035 + 0.008 * (9.0 * t).sin().powi(3) + if (t * 7.0).fract() < 0.2 { 0.006 } else { 0.0 };
        let knurl = 0.0004 * (60.0 * angle).sin() * (150.0 * t).sin();
        let r = body + knurl;
        [r * angle.cos(), r * angle.sin(), 0.22 * t]
    };
    let quad = |i: u32| {
        let (u, v) = (i % around, i / around);
        let at = |u: u32, v: u32| v * around + u % around;
        [[at(u, v), at(u + 1, v), at(u, v + 1)], [at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)]]
    };
    Part {
        positions: (0..around * along).map(place).collect(),
        triangles: (0..around * (along - 1)).flat_map(quad).collect(),
    }
}

impl Part {
    /// `n` points evenly by area, off the surface by a normal error of `noise` metres along each axis.
    pub(crate) fn sample(&self, n: usize, noise: f32, seed: u64) -> Vec<[f32; 3]> {
        let corners = |t: &[u32; 3]| t.map(|i| glam::Vec3::from_array(self.positions[i as usize]));
        let mut sums = Vec::with_capacity(self.triangles.len());
        let mut sum = 0.0_f64;
        for [a, b, c] in self.triangles.iter().map(corners) {
            sum += f64::from((b - a).cross(c - a).length());
            sums.push(sum);
        }
        let mut rng = Pcg64::seed_from_u64(seed);
        // The sum of twelve uniform numbers is close enough to normal.
        let off = |rng: &mut Pcg64| (0..12).map(|_| rng.random_range(-0.5..0.5_f32)).sum::<f32>() * noise;
        (0..n)
            .map(|_| {
                let at = rng.random_range(0.0..sum);
                let [a, b, c] = corners(&self.triangles[sums.partition_point(|s| *s < at).min(sums.len() - 1)]);
                let (u, v) = (rng.random_range(0.0..1.0_f32).sqrt(), rng.random_range(0.0..1.0_f32));
                let p = a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v);
                (p + glam::vec3(off(&mut rng), off(&mut rng), off(&mut rng))).to_array()
            })
            .collect()
    }
}
