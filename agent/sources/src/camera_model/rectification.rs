//! Pictures of a camera with a lens, as a pinhole with the same focal lengths would have taken them. Where each pixel of the
//! new picture comes from is computed once a source.
//!
//! Colour is interpolated between four pixels. Depth is that of the nearest pixel, a fraction of a pixel further on its own
//! surface: never between two surfaces. A pixel whose ray the lens model does not cover, or that comes from beside the
//! picture, sees nothing: it is black and has no depth.

use super::local_plane::LocalPlane;
use super::{CameraModel, Distortion};
use image::RgbImage;
use nalgebra::Point3;
use rayon::prelude::*;
use semascan_perception::view::{DepthImage, Intrinsics, SizeMismatch};

/// How pictures of a camera become those of a pinhole.
#[derive(Clone, Debug)]
pub struct Rectification {
    pinhole: Intrinsics,
    /// Where each pixel comes from, column and row, row by row; NaN where it sees nothing.
    origins: Vec<[f32; 2]>,
}

impl Rectification {
    /// The way from `camera` to a pinhole with its intrinsics; `None` if it is one.
    pub fn of(camera: &CameraModel) -> Option<Self> {
        if *camera.distortion() == Distortion::None {
            return None;
        }
        let pinhole = *camera.intrinsics();
        let (width, height) = (pinhole.width as usize, pinhole.height as usize);
        let mut origins = vec![[f32::NAN; 2]; width * height];
        origins.par_chunks_mut(width).enumerate().for_each(|(v, row)| {
            for (u, origin) in row.iter_mut().enumerate() {
                let ray: Point3<f64> = pinhole.unproject(u as f64, v as f64, 1.0);
                let Some((x, y)) = camera.pixel_of_point(&ray) else { continue };
                if pinhole.pixel(x, y).is_some() {
                    *origin = [x as f32, y as f32];
                }
            }
        });
        Some(Self { pinhole, origins })
    }

    /// The camera of the pictures that come out.
    pub fn pinhole(&self) -> &Intrinsics {
        &self.pinhole
    }

    /// Share of the pixels of the pictures that come out that see nothing, 0 to 1.
    pub fn unseen(&self) -> f64 {
        let unseen = self.origins.iter().filter(|[x, _]| x.is_nan()).count();
        unseen as f64 / self.origins.len().max(1) as f64
    }

    /// Colour as the pinhole would have taken it.
    ///
    /// # Errors
    /// [`SizeMismatch`] if the picture is not one of the camera.
    pub fn color(&self, picture: &RgbImage) -> Result<RgbImage, SizeMismatch> {
        let Intrinsics { width, height, .. } = self.pinhole;
        if picture.dimensions() != (width, height) {
            let found = picture.pixels().len();
            return Err(SizeMismatch { part: "colour picture", found, width, height });
        }
        let mut out = RgbImage::new(width, height);
        let row_length = 3 * width as usize;
        out.par_chunks_mut(row_length).zip(self.origins.par_chunks(width as usize)).for_each(|(row, origins)| {
            for (pixel, origin) in row.chunks_exact_mut(3).zip(origins) {
                if !origin[0].is_nan() {
                    pixel.copy_from_slice(&between(picture, *origin));
                }
            }
        });
        Ok(out)
    }

    /// Depth as the pinhole would have measured it. It runs along the optical axis, which both cameras share, so it is the
    /// same number in another pixel.
    ///
    /// # Errors
    /// [`SizeMismatch`] if the picture is not one of the camera.
    pub fn depth(&self, depth: &DepthImage) -> Result<DepthImage, SizeMismatch> {
        let Intrinsics { width, height, .. } = self.pinhole;
        if (depth.width, depth.height) != (width, height) || depth.metres.len() != self.origins.len() {
            return Err(SizeMismatch { part: "depth picture", found: depth.metres.len(), width, height });
        }
        let metres = self.origins.par_iter().map(|[x, y]| {
            let (nearest_x, nearest_y) = (x.round(), y.round());
            if x.is_nan() {
                return 0.0;
            }
            // A place in the picture may round to a negative zero, no further.
            let plane = LocalPlane::at(depth, nearest_x as u32, nearest_y as u32);
            let z = plane.map_or(0.0, |plane| plane.depth_at((x - nearest_x).into(), (y - nearest_y).into()) as f32);
            if z.is_finite() && z > 0.0 { z } else { 0.0 }
        });
        Ok(DepthImage { width, height, metres: metres.collect() })
    }
}

/// The colour at a place between four pixels; beside the outermost centres that of the outermost pixel.
fn between(picture: &RgbImage, [x, y]: [f32; 2]) -> [u8; 3] {
    let (width, height) = picture.dimensions();
    let x = x.clamp(0.0, (width - 1) as f32);
    let y = y.clamp(0.0, (height - 1) as f32);
    let (left, top) = (x as u32, y as u32);
    let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
    let (to_right, to_bottom) = (x - left as f32, y - top as f32);
    let corners = [(left, top), (right, top), (left, bottom), (right, bottom)].map(|(u, v)| picture.get_pixel(u, v).0);
    let weights = [
        (1.0 - to_right) * (1.0 - to_bottom),
        to_right * (1.0 - to_bottom),
        (1.0 - to_right) * to_bottom,
        to_right * to_bottom,
    ];
    let mut out = [0; 3];
    for (channel, value) in out.iter_mut().enumerate() {
        let sum: f32 = corners.iter().zip(weights).map(|(corner, weight)| f32::from(corner[channel]) * weight).sum();
        *value = (sum + 0.5) as u8;
    }
    out
}
