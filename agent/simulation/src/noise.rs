//! Seeded hashing and 3D noise: the procedural surfaces and every per-pixel draw of the virtual cell.
//!
//! Everything here is a pure function of its arguments, so a picture does not depend on the order or the number of
//! threads that computed it. Gradient-free value noise with quintic fade is enough at the scales used here and costs
//! eight hashes a sample ([Perlin 2002] for the fade curve).

use glam::Vec3;

/// Mixes one 32-bit word (C. Wellons, "lowbias32").
#[inline]
pub(super) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Mixes two words.
#[inline]
pub(super) fn hash2(a: u32, b: u32) -> u32 {
    hash(a ^ hash(b.wrapping_add(0x9e37_79b9)))
}

/// A uniform number in `[0, 1)` from a hash.
#[inline]
pub(super) fn unit(h: u32) -> f32 {
    (h >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A standard normal number from a hash (Box and Muller).
#[inline]
pub(super) fn gauss(h: u32) -> f32 {
    let radius = (-2.0 * (1.0 - unit(h)).max(1e-7).ln()).sqrt();
    radius * (std::f32::consts::TAU * unit(hash(h ^ 0x68bc_21eb))).cos()
}

/// Value noise over 3D space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    seed: u32,
}

impl Noise {
    /// A noise field of its own for each seed.
    pub(super) fn new(seed: u32) -> Self {
        Self { seed: hash(seed) }
    }

    /// Smooth noise in `[-1, 1]` with features about one unit wide.
    #[inline]
    pub(super) fn at(&self, p: Vec3) -> f32 {
        let cell = p.floor();
        let f = p - cell;
        let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
        let (x, y, z) = (cell.x as i32 as u32, cell.y as i32 as u32, cell.z as i32 as u32);
        let xs = [x.wrapping_mul(0x8da6_b343), x.wrapping_add(1).wrapping_mul(0x8da6_b343)];
        let ys = [y.wrapping_mul(0xd816_3841), y.wrapping_add(1).wrapping_mul(0xd816_3841)];
        let zs = [z.wrapping_mul(0xcb1a_b31f), z.wrapping_add(1).wrapping_mul(0xcb1a_b31f)];
        let corner = |i: usize, j: usize, k: usize| unit(hash(self.seed ^ xs[i] ^ ys[j] ^ zs[k]));
        let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let face = |k: usize| {
            lerp(lerp(corner(0, 0, k), corner(1, 0, k), w.x), lerp(corner(0, 1, k), corner(1, 1, k), w.x), w.y)
        };
        2.0 * lerp(face(0), face(1), w.z) - 1.0
    }

    /// Fractal sum of `octaves` noises, each twice as fine and half as strong; about `[-1, 1]`.
    #[inline]
    pub(super) fn fbm(&self, p: Vec3, octaves: u32) -> f32 {
        let (mut sum, mut weight, mut total, mut q) = (0.0, 1.0, 0.0, p);
        for _ in 0..octaves {
            sum += weight * self.at(q);
            total += weight;
            weight *= 0.5;
            q = q * 2.03 + Vec3::splat(17.17);
        }
        sum / total
    }
}

/// Cubic step from 0 at `a` to 1 at `b`.
#[inline]
pub(super) fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_bounded_continuous_and_seeded() {
        let (a, b) = (Noise::new(1), Noise::new(2));
        let mut differs = false;
        for i in 0..2000 {
            let p = Vec3::new(i as f32 * 0.37 - 300.0, i as f32 * 0.11, -(i as f32) * 0.23);
            let v = a.fbm(p, 4);
            assert!((-1.0..=1.0).contains(&v));
            assert!((a.at(p) - a.at(p + Vec3::splat(1e-4))).abs() < 1e-2);
            differs |= (v - b.fbm(p, 4)).abs() > 0.1;
        }
        assert!(differs);
    }

    #[test]
    fn gauss_has_unit_variance() {
        let n = 20_000;
        let draws: Vec<f32> = (0..n).map(|i| gauss(hash2(7, i))).collect();
        let mean = draws.iter().sum::<f32>() / n as f32;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f32>() / n as f32;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "mean {mean}, variance {variance}");
    }
}
