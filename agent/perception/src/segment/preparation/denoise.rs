//! The filter that matches the noise: wavelet shrinkage for Gaussian noise, a switching median for impulses
//! ([Wang 2023], "Removing image noise").
//!
//! Coefficients are shrunk softly with a threshold for each band, `T = sigma^2 / sigma_x` with `sigma_x` the deviation
//! of the band's own signal [Chang 2000], averaged over shifted grids so that no blocks show [Coifman 1995]. The median
//! replaces impulses only: everything else keeps its detail.

use super::noise::{Noise, detect, impulses};
use super::wavelet::{Plane, robust_deviation};
use image::RgbImage;
use imageproc::filter::median_filter;
use rayon::prelude::*;

/// Levels of the transform.
const LEVELS: usize = 3;
/// Offsets of the grids whose results are averaged.
const SHIFTS: [(usize, usize); 4] = [(0, 0), (1, 3), (2, 1), (3, 2)];

/// `rgb` without its noise; `None` if it has none.
pub fn denoised(rgb: &RgbImage) -> Option<RgbImage> {
    match detect(rgb) {
        Noise::None => None,
        Noise::Gaussian { .. } => Some(shrunk(rgb)),
        Noise::Impulse { .. } => Some(without_impulses(rgb)),
    }
}

/// Shrinks the wavelet coefficients of every channel, by that channel's own noise.
pub fn shrunk(rgb: &RgbImage) -> RgbImage {
    let channels: Vec<Plane> = (0..3)
        .into_par_iter()
        .map(|channel| {
            let plane = channel_of(rgb, channel);
            let sigma = robust_deviation(&plane.split().high[2].values);
            let mut sums = vec![0.0; plane.values.len()];
            for shift in SHIFTS {
                for (sum, value) in sums.iter_mut().zip(shrunk_on(&plane, shift, sigma).values) {
                    *sum += value / SHIFTS.len() as f32;
                }
            }
            Plane { values: sums, ..plane }
        })
        .collect();
    joined(rgb, |at, channel| channels[channel].values[at])
}

/// Replaces impulses, channel by channel, by the median of the pixels about them.
pub fn without_impulses(rgb: &RgbImage) -> RgbImage {
    let median = median_filter(rgb, 1, 1);
    let wider = median_filter(rgb, 2, 2);
    let marked: [Vec<bool>; 3] = std::array::from_fn(|channel| impulses(&channel_of(rgb, channel)));
    // Impulses side by side are left by one pass over the nearest pixels.
    let left: [Vec<bool>; 3] = std::array::from_fn(|channel| impulses(&channel_of(&median, channel)));
    joined(rgb, |at, channel| {
        let source = match (marked[channel][at], left[channel][at]) {
            (false, _) => rgb,
            (true, false) => &median,
            (true, true) => &wider,
        };
        f32::from(source.as_raw()[3 * at + channel])
    })
}

/// Shrinks on the grid that begins at `shift`; the picture is continued by its mirror image to whole blocks.
fn shrunk_on(plane: &Plane, (dx, dy): (usize, usize), sigma: f32) -> Plane {
    let block = 1 << LEVELS;
    let (width, height) = ((plane.width + dx).next_multiple_of(block), (plane.height + dy).next_multiple_of(block));
    let padded = Plane::of(width, height, |u, v| {
        plane.values[mirrored(v, dy, plane.height) * plane.width + mirrored(u, dx, plane.width)]
    });
    let whole = shrink(&padded, sigma, LEVELS);
    Plane::of(plane.width, plane.height, |u, v| whole.values[(v + dy) * width + u + dx])
}

/// The place in `0..size` that is `shift` before `i`, mirrored at both ends.
fn mirrored(i: usize, shift: usize, size: usize) -> usize {
    let at = i.abs_diff(shift);
    let back = (2 * size).saturating_sub(at + 2);
    if at < size { at } else { back }.min(size.saturating_sub(1))
}

fn shrink(plane: &Plane, sigma: f32, levels: usize) -> Plane {
    if levels == 0 {
        return plane.clone();
    }
    let mut bands = plane.split();
    bands.low = shrink(&bands.low, sigma, levels - 1);
    for band in &mut bands.high {
        let n = band.values.len().max(1) as f32;
        let energy = band.values.iter().map(|v| v * v).sum::<f32>() / n;
        let signal = (energy - sigma * sigma).max(0.0).sqrt();
        let threshold = if signal > 0.0 { sigma * sigma / signal } else { f32::INFINITY };
        for value in &mut band.values {
            *value = value.signum() * (value.abs() - threshold).max(0.0);
        }
    }
    bands.join()
}

fn channel_of(rgb: &RgbImage, channel: usize) -> Plane {
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    let raw = rgb.as_raw();
    Plane::of(width, height, |u, v| f32::from(raw[3 * (v * width + u) + channel]))
}

/// A picture of `rgb`'s size from values by pixel and channel.
fn joined(rgb: &RgbImage, value: impl Fn(usize, usize) -> f32) -> RgbImage {
    let mut out = rgb.clone();
    for (i, byte) in out.iter_mut().enumerate() {
        *byte = value(i / 3, i % 3).round().clamp(0.0, 255.0) as u8;
    }
    out
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use image::Rgb;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    /// Slopes, discs and stripes: edges in all directions.
    pub(in super::super) fn picture() -> RgbImage {
        RgbImage::from_fn(190, 130, |u, v| {
            let (x, y) = (u as f32, v as f32);
            let disc = ((x - 60.0).powi(2) + (y - 60.0).powi(2)).sqrt() < 35.0;
            let stripe = (((x * 0.8 + y * 0.6) / 11.0) as u32).is_multiple_of(2) && x > 110.0;
            let base = 60.0 + 0.4 * x + 0.2 * y;
            let grey = if disc {
                190.0
            } else if stripe {
                40.0
            } else {
                base
            };
            Rgb([grey as u8, (grey * 0.9) as u8, (grey * 0.7 + 20.0) as u8])
        })
    }

    pub(in super::super) fn with_gaussian(clean: &RgbImage, sigma: f32, seed: u64) -> RgbImage {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut out = clean.clone();
        for byte in out.iter_mut() {
            let gauss = (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
            *byte = (f32::from(*byte) + sigma * gauss).round().clamp(0.0, 255.0) as u8;
        }
        out
    }

    pub(in super::super) fn with_impulses(clean: &RgbImage, share: f64, seed: u64) -> RgbImage {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut out = clean.clone();
        for pixel in out.pixels_mut() {
            if random.random::<f64>() < share {
                *pixel = Rgb([if random.random::<bool>() { 255 } else { 0 }; 3]);
            }
        }
        out
    }

    fn rms(a: &RgbImage, b: &RgbImage) -> f64 {
        let sum: f64 = a.iter().zip(b.iter()).map(|(x, y)| (f64::from(*x) - f64::from(*y)).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    }

    #[test]
    fn gaussian_noise_is_more_than_halved_and_edges_stay() {
        let clean = picture();
        for sigma in [8.0, 20.0] {
            let noisy = with_gaussian(&clean, sigma, 1);
            let quiet = denoised(&noisy).expect("it is noisy");
            let (before, after) = (rms(&noisy, &clean), rms(&quiet, &clean));
            assert!(after < 0.55 * before, "{before} to {after}");
        }
    }

    #[test]
    fn impulses_go_and_nothing_else_changes() {
        let clean = picture();
        for share in [0.01, 0.08] {
            let noisy = with_impulses(&clean, share, 2);
            let quiet = denoised(&noisy).expect("it is noisy");
            assert!(rms(&quiet, &clean) < 0.2 * rms(&noisy, &clean), "{} {}", rms(&quiet, &clean), rms(&noisy, &clean));
            let untouched = |i: usize| noisy.as_raw()[i] == clean.as_raw()[i] && quiet.as_raw()[i] != clean.as_raw()[i];
            let changed = (0..clean.len()).filter(|&i| untouched(i)).count();
            assert!(changed * 100 < clean.len(), "{changed} of {} good values changed", clean.len());
        }
    }

    #[test]
    fn a_clean_picture_is_left_alone_and_any_size_is_taken() {
        assert!(denoised(&picture()).is_none());
        for (w, h) in [(1, 1), (2, 7), (9, 3)] {
            let tiny = RgbImage::from_pixel(w, h, Rgb([90, 91, 92]));
            assert_eq!(shrunk(&tiny), tiny, "{w}x{h}");
            assert_eq!(without_impulses(&tiny), tiny, "{w}x{h}");
        }
    }
}
