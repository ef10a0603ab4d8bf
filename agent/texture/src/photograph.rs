//! A photograph at its pose, and colours at places of it.

use image::RgbImage;
use nalgebra::{Isometry3, Point3};
use semascan_perception::view::Intrinsics;
use std::borrow::Cow;
use std::sync::Arc;

/// A photograph.
#[derive(Clone, Debug)]
pub struct Photograph<'a> {
    /// Its pixels.
    pub rgb: Arc<RgbImage>,
    /// Depths that were measured with it, metres, row-major; 0 where there are none. What they show before the surface hides it.
    pub depth: Cow<'a, [f32]>,
    /// Its camera.
    pub intrinsics: Intrinsics,
    /// Where that stood.
    pub table_from_camera: Isometry3<f64>,
}

impl Photograph<'_> {
    /// Whether pixels and depths are as many as the camera has.
    pub(crate) fn is_whole(&self) -> bool {
        let Intrinsics { width, height, .. } = self.intrinsics;
        self.rgb.dimensions() == (width, height) && self.depth.len() == width as usize * height as usize
    }
}

/// Colours at places of a picture. Places beyond its edge have those of the edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Colors<'a> {
    rgb: &'a RgbImage,
}

impl<'a> Colors<'a> {
    pub(crate) fn of(rgb: &'a RgbImage) -> Self {
        Self { rgb }
    }

    fn pixel(&self, x: i64, y: i64) -> [f32; 3] {
        let (width, height) = self.rgb.dimensions();
        let inside = |c: i64, size: u32| c.clamp(0, i64::from(size.max(1)) - 1) as u32;
        // A whole picture has a pixel at every place inside.
        self.rgb.get_pixel_checked(inside(x, width), inside(y, height)).map_or([0.0; 3], |p| p.0.map(f32::from))
    }

    /// Between pixels, bilinear. `(0, 0)` is the centre of the first pixel.
    pub(crate) fn at(&self, u: f64, v: f64) -> [f32; 3] {
        let (left, top) = (u.floor(), v.floor());
        let (right_share, lower_share) = ((u - left) as f32, (v - top) as f32);
        let (x, y) = (left as i64, top as i64);
        let mix = |a: [f32; 3], b: [f32; 3], share: f32| [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]));
        let upper = mix(self.pixel(x, y), self.pixel(x + 1, y), right_share);
        let lower = mix(self.pixel(x, y + 1), self.pixel(x + 1, y + 1), right_share);
        mix(upper, lower, lower_share)
    }

    /// The mean over a square of `edge` pixels around a place, of enough samples that none of its pixels is passed over.
    pub(crate) fn around(&self, u: f64, v: f64, edge: f64) -> [f32; 3] {
        let count = (edge.ceil() as u32).clamp(1, 8);
        let mut sum = [0.0_f32; 3];
        for i in 0..count * count {
            let offset = |k: u32| ((f64::from(k) + 0.5) / f64::from(count) - 0.5) * edge;
            let color = self.at(u + offset(i % count), v + offset(i / count));
            sum = [0, 1, 2].map(|k| sum[k] + color[k]);
        }
        sum.map(|c| c / (count * count) as f32)
    }
}

/// Where a point of the table frame lies in a photograph: column, row, and depth in metres; `None` behind the camera.
pub(crate) fn project(
    intrinsics: &Intrinsics,
    camera_from_table: &Isometry3<f64>,
    point: &Point3<f64>,
) -> Option<(f64, f64, f64)> {
    let p = camera_from_table * point;
    intrinsics.project(&p).map(|(u, v)| (u, v, p.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_lie_between_those_of_the_pixels() {
        let rgb = RgbImage::from_fn(8, 4, |x, y| image::Rgb([10 * x as u8, 20 * y as u8, 7]));
        let colors = Colors::of(&rgb);
        assert_eq!(colors.at(3.25, 1.5), [32.5, 30.0, 7.0]);
        assert_eq!(colors.at(-3.0, 9.0), [0.0, 60.0, 7.0], "the edge goes on");
        let mean = colors.around(4.0, 2.0, 3.0);
        assert!((mean[0] - 40.0).abs() < 1e-4 && (mean[1] - 40.0).abs() < 1e-4, "{mean:?}");
    }
}
