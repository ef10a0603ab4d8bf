//! Flying pixels: at a depth step a pixel's light comes from both surfaces and its depth from neither.
//!
//! On a plane inverse depth is affine over the picture, so a pixel that belongs to a surface is foretold by two pixels
//! of that surface in a straight line, on at least two of eight sides; one that hangs between two surfaces is foretold
//! on none. Nearest measured pixels are taken along each line, so regular holes (depth warped into the colour image) do
//! no harm. What counts as foretold follows the noise of the picture itself.

use crate::view::Intrinsics;
use rayon::prelude::*;

/// Farthest that the first pixel of a line, and the second from the first, is looked for, pixels.
const REACH: i32 = 3;
/// Least tolerance of a prediction, as a share of inverse depth: 0.5 mm at half a metre.
const LEAST_TOLERANCE: f32 = 1e-3;
/// Tolerance in medians of the picture's own prediction errors.
const MEDIANS: f32 = 6.0;
/// Largest tolerance: noisier pictures have no edges that can be distinguished from noise.
const LARGEST_TOLERANCE: f32 = 0.015;
/// Fewest sides that must foretell a pixel, out of at least `TESTABLE`.
const AGREEING: u32 = 2;
/// Fewest sides with two measured pixels for a verdict.
const TESTABLE: u32 = 3;
/// Every how many pixels the noise is sampled.
const SAMPLING: usize = 13;

/// The eight directions of a pixel grid.
const SIDES: [(i32, i32); 8] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)];

/// Which pixels of `depth` (metres, 0 = none) are mixed or stray.
pub(super) fn flying_pixels(k: &Intrinsics, depth: &[f32]) -> Vec<bool> {
    let (width, height) = (k.width as usize, k.height as usize);
    let mut flying = vec![false; depth.len()];
    if width < 3 || height < 3 || depth.len() != width * height {
        return flying;
    }
    let tolerance = tolerance(depth, width, height);
    flying.par_chunks_mut(width).enumerate().for_each(|(v, row)| {
        let own = &depth[v * width..(v + 1) * width];
        for (u, flying) in row.iter_mut().enumerate() {
            let z = own[u];
            if z <= 0.0 {
                continue;
            }
            // Nearly all pixels lie on the line through their neighbours, in both directions.
            let inside = u > 0 && v > 0 && u + 1 < width && v + 1 < height;
            if inside
                && [1, width].into_iter().all(|step| bend(depth, v * width + u, step).is_some_and(|b| b < tolerance))
            {
                continue;
            }
            *flying = stands_alone(depth, (width as i32, height as i32), (u as i32, v as i32), tolerance);
        }
    });
    flying
}

/// Second difference of inverse depth along `step`, as a share of inverse depth; `None` beside a gap.
fn bend(depth: &[f32], i: usize, step: usize) -> Option<f32> {
    let (before, z, after) = (depth[i - step], depth[i], depth[i + step]);
    // z (1/a + 1/b - 2/z) without three divisions.
    (before > 0.0 && after > 0.0).then(|| (z * (before + after) / (before * after) - 2.0).abs())
}

/// The largest prediction error that noise explains.
fn tolerance(depth: &[f32], width: usize, height: usize) -> f32 {
    let inner = (1..height - 1).step_by(3).flat_map(|v| (1..width - 1).map(move |u| v * width + u));
    let mut bends: Vec<f32> =
        inner.step_by(SAMPLING).filter(|&i| depth[i] > 0.0).filter_map(|i| bend(depth, i, 1)).collect();
    if bends.is_empty() {
        return LEAST_TOLERANCE;
    }
    let middle = bends.len() / 2;
    let (_, median, _) = bends.select_nth_unstable_by(middle, f32::total_cmp);
    (MEDIANS * *median).clamp(LEAST_TOLERANCE, LARGEST_TOLERANCE)
}

/// Whether fewer than [`AGREEING`] sides foretell the pixel.
fn stands_alone(depth: &[f32], (width, height): (i32, i32), (u, v): (i32, i32), tolerance: f32) -> bool {
    let centre = depth[(v * width + u) as usize];
    let (mut testable, mut agreeing) = (0, 0);
    for (du, dv) in SIDES {
        let next = |from: i32| {
            (from + 1..=from + REACH).find_map(|n| {
                let (x, y) = (u + n * du, v + n * dv);
                let inside = x >= 0 && y >= 0 && x < width && y < height;
                let z = if inside { depth[(y * width + x) as usize] } else { 0.0 };
                (z > 0.0).then_some((n, z))
            })
        };
        let Some((near, first)) = next(0) else { continue };
        let Some((far, second)) = next(near) else { continue };
        testable += 1;
        // Inverse depths relative to the centre's, extended from the two pixels to it.
        let (a, b) = (centre / first, centre / second);
        let ratio = near as f32 / (far - near) as f32;
        let miss = (a + (a - b) * ratio - 1.0).abs();
        // Noise grows with the extrapolation; (1, 2) is the plain second difference.
        let spread = ((1.0 + (1.0 + ratio).powi(2) + ratio * ratio) / 6.0).sqrt();
        agreeing += u32::from(miss < tolerance * spread);
    }
    testable >= TESTABLE && agreeing < AGREEING
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const K: Intrinsics = Intrinsics { width: 64, height: 48, fx: 80.0, fy: 80.0, cx: 31.5, cy: 23.5 };

    /// A tilted plate before a wall; every fifth row of its left border hangs between them.
    fn plate(holes: bool) -> (Vec<f32>, Vec<usize>) {
        let mut mixed = Vec::new();
        let depth = (0..64 * 48)
            .map(|i| {
                let (u, v) = (i % 64, i / 64);
                if holes && u % 2 == 1 {
                    return 0.0;
                }
                let plate = 1.0 / (2.4 + 0.004 * u as f32 - 0.003 * v as f32);
                if (20..50).contains(&u) && (8..40).contains(&v) {
                    if u == 20 && v % 5 == 0 {
                        mixed.push(i);
                        return plate + (0.6 - plate) * (0.2 + 0.01 * v as f32);
                    }
                    return plate;
                }
                0.6
            })
            .collect();
        (depth, mixed)
    }

    #[test]
    fn mixed_pixels_are_found_and_borders_kept() {
        for holes in [false, true] {
            let (depth, mixed) = plate(holes);
            let flying = flying_pixels(&K, &depth);
            assert!(!mixed.is_empty());
            for i in &mixed {
                assert!(flying[*i], "pixel {i}, holes {holes}");
            }
            let wrong = flying.iter().enumerate().filter(|(i, f)| **f && !mixed.contains(i)).count();
            assert!(wrong <= 8, "{wrong} of a plate's 124 border pixels");
        }
    }

    #[test]
    fn a_noisy_plane_and_tiny_pictures_have_none() {
        let mut random = rand_pcg::Pcg32::seed_from_u64(3);
        let noisy: Vec<f32> = (0..64 * 48).map(|_| 0.5 + 0.002 * (random.random::<f32>() - 0.5)).collect();
        let flying = flying_pixels(&K, &noisy).iter().filter(|f| **f).count();
        assert!(flying < 64 * 48 / 1000, "{flying}");
        let k = Intrinsics { width: 2, height: 1, ..K };
        assert_eq!(flying_pixels(&k, &[0.5, 0.9]), [false, false]);
    }
}
