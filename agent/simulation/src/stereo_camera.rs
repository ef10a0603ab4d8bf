//! Depth as an active stereo camera of the consumer class measures it (Intel RealSense D435), made from true depth.
//!
//! Such a camera measures disparity, `focal * baseline / depth`, by comparing windows of two pictures. So its noise is one
//! of disparity and grows with the square of the depth; neighbours share it; the values come in steps; what only one of
//! the two cameras sees is a hole beside each near edge; and a window that lies across an edge gives a depth between
//! both sides, or none ([Keselman 2017] describes these cameras). Depth is stored in whole millimetres.

use glam::Vec3;

use super::noise::{Noise, gauss, hash2, unit};
use semascan_perception::view::{DepthImage, Intrinsics};

/// Between the two cameras, metres.
const BASELINE: f32 = 0.050;
/// Standard deviation of the disparity of a window, pixels.
const SIGMA: f32 = 0.07;
/// The same of its slow error across the picture.
const RIPPLE: f32 = 0.04;
/// Steps of a pixel in which disparity comes.
const STEPS: f32 = 32.0;
/// Width of the comparing window that neighbours share, pixels.
const WINDOW: f32 = 3.5;
/// Change of depth between neighbours that makes an edge, as a share of the depth.
const EDGE: f32 = 0.02;
/// Pixels on each side of an edge that see both surfaces.
const SMEAR: i32 = 2;
/// Shares of these pixels that are lost, and that are lost or lie between both surfaces.
const SMEARED: (f32, f32) = (0.30, 0.60);
/// Where smooth noise in [-1, 1] lies beyond this, a patch is lost for want of texture.
const PATCHES: f32 = 0.80;
/// Share of the pixels that are lost for no visible reason.
const LOST: f32 = 0.004;
/// Step of the stored depth, metres.
const QUANTUM: f32 = 1e-3;

/// What the camera makes of `depth`; `seed` is the picture's own.
pub(super) fn measure(depth: &DepthImage, camera: &Intrinsics, seed: u32) -> DepthImage {
    let (width, height) = (depth.width as i32, depth.height as i32);
    let (fine, slow) = (Noise::new(hash2(seed, 1)), Noise::new(hash2(seed, 2)));
    let focal = camera.fx as f32 * BASELINE;
    let at = |u: i32, v: i32| {
        let inside = u >= 0 && v >= 0 && u < width && v < height;
        if inside { depth.metres[(v * width + u) as usize] } else { 0.0 }
    };
    let mut metres = vec![0.0; depth.metres.len()];
    for v in 0..height {
        let hidden = hidden_from_the_second(&depth.metres[(v * width) as usize..((v + 1) * width) as usize], focal);
        for u in 0..width {
            let z = at(u, v);
            let draw = hash2(seed, (v * width + u) as u32);
            let place = Vec3::new(u as f32, v as f32, 0.5);
            let patch = slow.at(place / 14.0 + Vec3::splat(40.0));
            if z <= 0.0 || hidden[u as usize] || patch > PATCHES || unit(hash2(draw, 3)) < LOST {
                continue;
            }
            let mut seen = z;
            if let Some(other) = across_an_edge(&at, u, v) {
                let fate = unit(hash2(draw, 4));
                if fate < SMEARED.0 {
                    continue;
                } else if fate < SMEARED.1 {
                    seen = z + (other - z) * unit(hash2(draw, 5));
                }
            }
            let error = SIGMA * (1.5 * fine.at(place / WINDOW) + 0.4 * gauss(hash2(draw, 6)))
                + RIPPLE * 1.8 * slow.at(place / 60.0);
            let disparity = ((focal / seen + error) * STEPS).round() / STEPS;
            if disparity > 1.0 {
                metres[(v * width + u) as usize] = (focal / disparity / QUANTUM).round() * QUANTUM;
            }
        }
    }
    DepthImage { width: depth.width, height: depth.height, metres }
}

/// The pixels of a row that the second camera does not see: something nearer lies on their ray.
fn hidden_from_the_second(row: &[f32], focal: f32) -> Vec<bool> {
    let mut hidden = vec![false; row.len()];
    // From the right: the farthest left that anything nearer reaches in the second picture.
    let mut reached = f32::INFINITY;
    for (u, z) in row.iter().enumerate().rev() {
        let place = if *z > 0.0 { u as f32 - focal / z } else { continue };
        hidden[u] = place > reached + 0.5;
        reached = reached.min(place);
    }
    hidden
}

/// The depth beyond the edge that a window at `(u, v)` touches.
fn across_an_edge(at: &impl Fn(i32, i32) -> f32, u: i32, v: i32) -> Option<f32> {
    let z = at(u, v);
    [(-SMEAR, 0), (SMEAR, 0), (0, -SMEAR), (0, SMEAR), (-1, 0), (1, 0), (0, -1), (0, 1)]
        .into_iter()
        .map(|(du, dv)| at(u + du, v + dv))
        .find(|other| *other > 0.0 && (other - z).abs() > EDGE * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Intrinsics = Intrinsics { width: 160, height: 60, fx: 600.0, fy: 600.0, cx: 79.5, cy: 29.5 };

    /// A wall at one metre with a box before its right half at 0.6 m.
    fn scene() -> DepthImage {
        let metres = (0..160 * 60).map(|i| if i % 160 < 80 { 1.0 } else { 0.6 }).collect();
        DepthImage { width: 160, height: 60, metres }
    }

    #[test]
    fn noise_grows_with_the_square_of_depth_and_repeats() {
        let measured = measure(&scene(), &CAMERA, 5);
        assert_eq!(measured, measure(&scene(), &CAMERA, 5));
        assert_ne!(measured, measure(&scene(), &CAMERA, 6));
        let deviation = |columns: std::ops::Range<usize>, truth: f32| {
            let errors: Vec<f32> = (0..60)
                .flat_map(|v| columns.clone().map(move |u| v * 160 + u))
                .filter(|i| measured.metres[*i] > 0.0)
                .map(|i| measured.metres[i] - truth)
                .collect();
            (errors.iter().map(|e| e * e).sum::<f32>() / errors.len() as f32).sqrt()
        };
        let (far, near) = (deviation(0..40, 1.0), deviation(100..160, 0.6));
        assert!((1e-3..6e-3).contains(&far) && (4e-4..2.5e-3).contains(&near), "{far} {near}");
        assert!((1.8..4.0).contains(&(far / near)), "{far} {near}");
    }

    #[test]
    fn beside_a_near_edge_there_is_a_hole_and_at_it_pixels_fly() {
        let measured = measure(&scene(), &CAMERA, 5);
        // Disparities 30 and 50: twenty columns of the wall are hidden from the second camera.
        let holes = |columns: std::ops::Range<usize>| {
            let all: Vec<usize> = (0..60).flat_map(|v| columns.clone().map(move |u| v * 160 + u)).collect();
            all.iter().filter(|i| measured.metres[**i] == 0.0).count() as f32 / all.len() as f32
        };
        assert!(holes(62..78) > 0.95 && holes(5..50) < 0.25, "{} {}", holes(62..78), holes(5..50));
        let flying = measured.metres.iter().filter(|z| (0.65..0.95).contains(*z)).count();
        assert!(flying > 5, "{flying}");
    }
}
