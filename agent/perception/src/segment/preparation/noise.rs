//! What noise a picture has: Gaussian or impulses, and how much ([Wang 2023], "Removing image noise").
//!
//! The paper decides by how the energy of the finest diagonal wavelet coefficients (HH) is concentrated: Gaussian noise
//! spreads it evenly over all of them, impulses put nearly all of it into a few. The level follows from the same
//! coefficients (their robust deviation) or, for impulses, from the share of pixels that stand out of all their
//! neighbours.

use super::wavelet::{Plane, robust_deviation};
use crate::view::luma;
use image::RgbImage;

/// Share of the coefficients whose energy is compared with that of all: of Gaussian ones they hold a quarter.
const LARGEST: f64 = 0.05;
/// Coefficients that an impulse reaches, and a little more.
const REACHED: f64 = 5.0;
/// Share of the energy in them from which it counts as concentrated.
const CONCENTRATED: f64 = 0.6;
/// Grey levels by which an impulse differs from the neighbours most like it, at least.
const OUTSTANDING: f32 = 40.0;
/// Smallest share of impulses that is called noise.
const FEWEST_IMPULSES: f64 = 5e-4;
/// Deviation, in grey levels, below which a picture counts as quiet: that of rounding and a little more.
const QUIET: f32 = 1.5;

/// Noise of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// None worth filtering.
    None,
    /// White Gaussian noise.
    Gaussian {
        /// Standard deviation in grey levels of 255.
        sigma: f32,
    },
    /// Single pixels that are far too bright or too dark (salt and pepper).
    Impulse {
        /// Share of the pixels.
        share: f64,
    },
}

/// Brightness of a picture, 0 to 255.
pub(super) fn luminance(rgb: &RgbImage) -> Plane {
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    let raw = rgb.as_raw();
    Plane::of(width, height, |u, v| luma(std::array::from_fn(|c| raw[(v * width + u) * 3 + c])))
}

/// Detects type and level of the noise of `rgb`.
pub fn detect(rgb: &RgbImage) -> Noise {
    let grey = luminance(rgb);
    let [_, _, diagonal] = grey.split().high;
    let sigma = robust_deviation(&diagonal.values);
    let share = impulses(&grey).iter().filter(|i| **i).count() as f64 / grey.values.len().max(1) as f64;
    if share >= FEWEST_IMPULSES && concentration(&diagonal, LARGEST.max(REACHED * share)) >= CONCENTRATED {
        Noise::Impulse { share }
    } else if sigma >= QUIET {
        Noise::Gaussian { sigma }
    } else {
        Noise::None
    }
}

/// Share of the energy that the largest `share` of the coefficients hold; 0 without energy.
fn concentration(band: &Plane, share: f64) -> f64 {
    let mut energy: Vec<f32> = band.values.iter().map(|v| v * v).collect();
    let total: f64 = energy.iter().map(|e| f64::from(*e)).sum();
    let count = (energy.len() as f64 * share.min(1.0)) as usize;
    if total <= 0.0 || count == 0 {
        return 0.0;
    }
    let rest = energy.len() - count;
    let (_, _, largest) = energy.select_nth_unstable_by(rest.saturating_sub(1), f32::total_cmp);
    largest.iter().map(|e| f64::from(*e)).sum::<f64>() / total
}

/// Pixels unlike the four most alike of their eight neighbours: an edge or a line has its like beside it, an impulse has
/// not (rank-ordered absolute differences, [Garnett 2005]).
pub(super) fn impulses(plane: &Plane) -> Vec<bool> {
    let (width, height) = (plane.width, plane.height);
    let mut found = vec![false; width * height];
    for v in 1..height.saturating_sub(1) {
        for u in 1..width.saturating_sub(1) {
            let own = plane.values[v * width + u];
            let mut differences = [0.0; 9];
            for (k, difference) in differences.iter_mut().enumerate() {
                *difference = (plane.values[(v + k / 3 - 1) * width + u + k % 3 - 1] - own).abs();
            }
            differences.sort_unstable_by(f32::total_cmp);
            // The smallest is the pixel's own.
            found[v * width + u] = differences[1..5].iter().sum::<f32>() > 4.0 * OUTSTANDING;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::denoise::tests::{picture, with_gaussian, with_impulses};
    use super::*;
    use crate::view::LUMA_WEIGHTS;

    #[test]
    fn type_and_level_are_found_on_a_structured_picture() {
        let clean = picture();
        assert_eq!(detect(&clean), Noise::None);
        for sigma in [4.0, 10.0, 25.0] {
            let Noise::Gaussian { sigma: found } = detect(&with_gaussian(&clean, sigma, 3)) else {
                panic!("sigma {sigma}: {:?}", detect(&with_gaussian(&clean, sigma, 3)));
            };
            // Luminance averages the channels' independent noise.
            let expected = sigma * LUMA_WEIGHTS.map(|w| w * w).iter().sum::<f32>().sqrt();
            assert!((found / expected - 1.0).abs() < 0.15, "{found} for {expected}");
        }
        for share in [0.005, 0.03, 0.10] {
            let Noise::Impulse { share: found } = detect(&with_impulses(&clean, share, 3)) else {
                panic!("share {share}: {:?}", detect(&with_impulses(&clean, share, 3)));
            };
            assert!((found / share - 1.0).abs() < 0.35, "{found} for {share}");
        }
    }

    #[test]
    fn tiny_pictures_are_quiet() {
        for (w, h) in [(0, 0), (1, 1), (3, 1), (2, 2)] {
            assert_eq!(detect(&RgbImage::new(w, h)), Noise::None);
        }
    }
}
