//! From light to a colour picture: lens, exposure, white balance, sensor noise, tone curve.

use glam::Vec3;
use image::RgbImage;
use rayon::prelude::*;

use super::noise::{gauss, hash2};
use super::random::Stream;
use semascan_perception::view::Intrinsics;

/// How one camera turns light into a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Film {
    pub(super) exposure: f32,
    pub(super) white_balance: Vec3,
    /// Standard deviation of the lens's blur in pixels, at most 1.
    pub(super) blur: f32,
    pub(super) vignette: f32,
    /// Exponent of the light before the tone curve: above 1 is a harder picture.
    pub(super) contrast: f32,
    /// 1 = as it is, 0 = grey.
    pub(super) saturation: f32,
}

impl Film {
    /// A camera's settings; they differ from camera to camera and stay for an inspection.
    pub(super) fn draw(seed: u64) -> Self {
        let mut s = Stream::new(seed, "film");
        Self {
            exposure: s.range(0.85, 1.2),
            white_balance: Vec3::new(s.range(0.95, 1.06), 1.0, s.range(0.94, 1.06)),
            blur: s.range(0.32, 0.5),
            vignette: s.range(0.5, 1.0),
            contrast: 1.0,
            saturation: 1.0,
        }
    }

    /// Exposed light as the camera's processing hands it to the tone curve.
    fn process(&self, light: Vec3) -> Vec3 {
        let mut out = light;
        if self.saturation != 1.0 {
            out = Vec3::splat(out.dot(LUMINANCE)).lerp(out, self.saturation);
        }
        if self.contrast != 1.0 {
            // Mid grey stays where it is.
            out = (out.max(Vec3::ZERO) / MID_GREY).powf(self.contrast) * MID_GREY;
        }
        out
    }
}

/// Share of each channel in how bright a light looks (ITU-R BT.709).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
/// What a camera's exposure aims at.
const MID_GREY: f32 = 0.18;

/// Develops linear colours, row-major; `noise` is the standard deviation at mid grey.
pub(super) fn develop(colors: &[Vec3], k: &Intrinsics, film: &Film, noise: f32, seed: u32) -> RgbImage {
    let (w, h) = (k.width as usize, k.height as usize);
    let side = (-0.5 / (film.blur * film.blur)).exp();
    let kernel = [side / (1.0 + 2.0 * side), 1.0 / (1.0 + 2.0 * side)];
    let mut rows = vec![Vec3::ZERO; w * h];
    rows.par_chunks_mut(w).zip(colors.par_chunks(w)).for_each(|(out, row)| {
        for u in 0..w {
            let (left, right) = (row[u.saturating_sub(1)], row[(u + 1).min(w - 1)]);
            // Light far beyond white would bleed over its neighbours as it does in no real lens of this kind.
            let cap = Vec3::splat(6.0);
            out[u] = row[u].min(cap) * kernel[1] + (left.min(cap) + right.min(cap)) * kernel[0];
        }
    });
    let mut bytes = vec![0_u8; w * h * 3];
    bytes.par_chunks_mut(w * 3).enumerate().for_each(|(v, out)| {
        let line = |v: usize| &rows[v * w..(v + 1) * w];
        let (above, here, below) = (line(v.saturating_sub(1)), line(v), line((v + 1).min(h - 1)));
        for u in 0..w {
            let light = here[u] * kernel[1] + (above[u] + below[u]) * kernel[0];
            let off = ((u as f64 - k.cx) / k.fx).powi(2) + ((v as f64 - k.cy) / k.fy).powi(2);
            let falloff = 1.0 / (1.0 + film.vignette * off as f32).powi(2);
            let exposed = light * film.white_balance * (film.exposure * falloff);
            let exposed = film.process(exposed);
            for c in 0..3 {
                let draw = hash2(seed ^ 0x5bd1_e995, ((v * w + u) * 3 + c) as u32);
                // Shot noise grows with the root of the light, read noise is always there.
                let grain = if noise > 0.0 { noise * (exposed[c].max(0.0) + 0.02).sqrt() * gauss(draw) } else { 0.0 };
                out[u * 3 + c] = encode(tone(exposed[c] + grain));
            }
        }
    });
    // The buffer has the picture's size by construction; an empty picture stands for the impossible other case.
    RgbImage::from_raw(k.width, k.height, bytes).unwrap_or_default()
}

/// A filmic curve (fit of K. Narkowicz, 2015): a soft shoulder instead of clipping.
fn tone(x: f32) -> f32 {
    let x = x.max(0.0) * 0.9;
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

/// sRGB transfer curve to a byte.
fn encode(linear: f32) -> u8 {
    let v = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (v * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn developing_keeps_size_order_and_neutrality() {
        let k = Intrinsics { width: 40, height: 30, fx: 40.0, fy: 40.0, cx: 19.5, cy: 14.5 };
        let film =
            Film { exposure: 1.0, white_balance: Vec3::ONE, blur: 0.4, vignette: 0.0, contrast: 1.0, saturation: 1.0 };
        let colors: Vec<Vec3> = (0..1200).map(|i| Vec3::splat((i % 40) as f32 / 40.0)).collect();
        let image = develop(&colors, &k, &film, 0.0, 1);
        assert_eq!(image.dimensions(), (40, 30));
        let row: Vec<[u8; 3]> = (0..40).map(|u| image.get_pixel(u, 10).0).collect();
        assert!(row.iter().all(|c| c[0] == c[1] && c[1] == c[2]));
        assert!(row.windows(2).all(|p| p[0][0] <= p[1][0]) && row[39][0] > 180);
        assert_ne!(develop(&colors, &k, &film, 0.02, 1), develop(&colors, &k, &film, 0.02, 2), "noise is seeded");
    }
}
