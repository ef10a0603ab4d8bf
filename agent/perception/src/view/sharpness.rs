//! How sharp a picture is. The ratio of second to first differences of the brightness grows with sharpness, and not with contrast.

use super::luma;
use image::RgbImage;
use rayon::prelude::*;

/// The ratio of independent noise in each pixel, the sharpest picture there is.
const OF_NOISE: f64 = 3.0;

/// Sharpness of a picture where `is_shown` (row-major pixel index) holds, 0 to 1: only to be compared with that of other pictures of
/// the same part. `None` where there is nothing to see.
pub fn sharpness(rgb: &RgbImage, is_shown: impl Fn(usize) -> bool + Sync) -> Option<f64> {
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    let grey: Vec<f32> = rgb.pixels().map(|p| luma(p.0)).collect();
    let rows = 1..height.saturating_sub(1);
    let sums: Vec<[f64; 2]> = rows
        .into_par_iter()
        .map(|y| {
            let mut sum = [0.0; 2];
            for at in y * width + 1..(y * width + width).saturating_sub(1) {
                if !is_shown(at) {
                    continue;
                }
                for (before, after) in [(at - 1, at + 1), (at - width, at + width)] {
                    sum[0] += f64::from((grey[after] - grey[before]).abs()) / 2.0;
                    sum[1] += f64::from((grey[after] + grey[before] - 2.0 * grey[at]).abs());
                }
            }
            sum
        })
        .collect();
    let [first, second] = sums.iter().fold([0.0; 2], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
    (first > 0.0).then(|| (second / first / OF_NOISE).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// Stripes of eight pixels; their edges are the steeper the `sharper`.
    fn stripes(sharper: f64, contrast: f64) -> RgbImage {
        RgbImage::from_fn(64, 48, |x, _| {
            let wave = (std::f64::consts::TAU * (f64::from(x) + 0.5) / 16.0).cos();
            Rgb([(127.0 + contrast * (sharper * wave).tanh()) as u8; 3])
        })
    }

    #[test]
    fn a_blurred_picture_is_less_sharp_and_a_pale_one_is_not() {
        let of = |sharper, contrast| sharpness(&stripes(sharper, contrast), |_| true).unwrap_or_default();
        assert!(of(8.0, 120.0) > 1.5 * of(2.0, 120.0) && of(2.0, 120.0) > 1.2 * of(0.5, 120.0));
        assert!((of(4.0, 120.0) / of(4.0, 60.0) - 1.0).abs() < 0.1);
    }

    #[test]
    fn what_is_not_shown_does_not_count() {
        let half =
            RgbImage::from_fn(64, 48, |x, y| if x < 32 { Rgb([90; 3]) } else { *stripes(8.0, 120.0).get_pixel(x, y) });
        assert_eq!(sharpness(&half, |at| at % 64 < 31), None, "nothing to see");
        assert_eq!(sharpness(&half, |at| at % 64 > 32), sharpness(&stripes(8.0, 120.0), |at| at % 64 > 32));
        assert_eq!(sharpness(&RgbImage::new(1, 1), |_| true), None);
        assert_eq!(sharpness(&RgbImage::new(0, 0), |_| true), None);
    }
}
