//! A picture of a few hundred pixels by which places are recognised: small blurred pictures are compared faster than
//! anything else, and tell from which keyframe a lost camera can be found ([Klein 2008]).

use crate::view::{DepthImage, luma};
use image::RgbImage;

const COLUMNS: usize = 32;
const ROWS: usize = 24;
/// Inverse depths (one a metre) by which surfaces are compared: differences of one count as much as the whole contrast.
const DEPTH_WEIGHT: f32 = 1.0;

/// Grey values and inverse depths, each normalised to mean 0 and deviation 1.
#[derive(Clone, Debug)]
pub(super) struct Thumbnail {
    grey: Vec<f32>,
    depth: Vec<f32>,
}

impl Thumbnail {
    /// Of a view's pictures.
    pub(super) fn new(rgb: &RgbImage, depth: &DepthImage) -> Self {
        let (mut grey, mut near) = (vec![0.0; COLUMNS * ROWS], vec![0.0; COLUMNS * ROWS]);
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let (mut light, mut inverse, mut pixels, mut measured) = (0.0, 0.0, 0.0_f32, 0.0_f32);
                // A few pixels of each block say as much as all of them.
                for k in 0..16 {
                    let at = |i: usize, part: usize, all: usize, size: u32| {
                        (((i * 4 + part) as u32 * size) / (all as u32 * 4)).min(size.saturating_sub(1))
                    };
                    let (u, v) = (at(column, k % 4, COLUMNS, rgb.width()), at(row, k / 4, ROWS, rgb.height()));
                    light += luma(rgb.get_pixel(u, v).0);
                    pixels += 1.0;
                    if let Some(z) = depth.at(u, v) {
                        inverse += 1.0 / z;
                        measured += 1.0;
                    }
                }
                grey[row * COLUMNS + column] = light / pixels;
                near[row * COLUMNS + column] = if measured > 0.0 { inverse / measured } else { 0.0 };
            }
        }
        normalise(&mut grey);
        normalise(&mut near);
        Self { grey, depth: near }
    }

    /// How alike two pictures are: the mean of the correlations of grey values and of inverse depths, -1 to 1.
    pub(super) fn alike(&self, other: &Self) -> f32 {
        let correlation = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>() / a.len() as f32;
        let surfaces = DEPTH_WEIGHT * correlation(&self.depth, &other.depth);
        (correlation(&self.grey, &other.grey) + surfaces) / (1.0 + DEPTH_WEIGHT)
    }
}

/// To mean 0 and deviation 1; all 0 where there is no contrast.
fn normalise(values: &mut [f32]) {
    let count = values.len() as f32;
    let mean = values.iter().sum::<f32>() / count;
    let deviation = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / count).sqrt();
    for value in values {
        *value = if deviation > 1e-6 { (*value - mean) / deviation } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn a_place_is_alike_itself_whatever_the_exposure_and_unlike_another() {
        let picture = |gain: f32, shift: f32| {
            let rgb = RgbImage::from_fn(160, 120, |u, v| {
                let print = ((u as f32 + shift) * 0.07).sin() * (v as f32 * 0.05 + shift).cos();
                Rgb([((110.0 + 60.0 * print) * gain) as u8; 3])
            });
            let metres = (0..160 * 120).map(|i| 1.0 + 0.3 * ((i % 160) as f32 * 0.03 + shift).sin()).collect();
            Thumbnail::new(&rgb, &DepthImage { width: 160, height: 120, metres })
        };
        let here = picture(1.0, 0.0);
        assert!(here.alike(&picture(0.6, 0.0)) > 0.95);
        assert!(here.alike(&picture(1.0, 40.0)) < 0.7, "{}", here.alike(&picture(1.0, 40.0)));
        let dark =
            Thumbnail::new(&RgbImage::new(160, 120), &DepthImage { width: 160, height: 120, metres: vec![0.0; 19200] });
        assert_eq!(here.alike(&dark), 0.0);
    }
}
