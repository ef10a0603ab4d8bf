//! Depth of a camera beside the colour camera, as the colour camera would have measured it.
//!
//! Each depth pixel is a small plane ([`LocalPlane`]) as large as the pixel, a little larger so that neighbours leave no gap
//! by rounding or noise; it is drawn into the colour picture, and of the planes in a pixel the nearest stays. So a
//! depth picture that is coarser than the colour picture makes no holes, what a nearer surface hides stays hidden, and
//! what was not measured, or not seen by both cameras, has no depth.

use super::UnusableCamera;
use super::local_plane::LocalPlane;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use semascan_perception::view::{DepthImage, Intrinsics, SizeMismatch, check_intrinsics};
use std::ops::Range;

/// Half the edge of a depth pixel as it is drawn, in depth pixels.
const HALF: f64 = 0.5 + 0.15;
/// Most columns or rows of the colour picture that a depth pixel may cover: one that covers more is nearly in the colour
/// camera, where no sensor measures.
const MOST_COVERED: f64 = 64.0;

/// How depth of one camera becomes depth of another.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthRegistration {
    depth: Intrinsics,
    color: Intrinsics,
    color_from_depth: Isometry3<f64>,
    /// `color_from_depth` as a matrix.
    rotation: Matrix3<f64>,
}

impl DepthRegistration {
    /// From the pinhole `depth` to the pinhole `color`; `color_from_depth` brings points of the depth camera's frame into
    /// that of the colour camera, in metres. Pictures of lenses are brought to pinholes before.
    ///
    /// # Errors
    /// [`UnusableCamera`] if a number is not one that a camera can have.
    pub fn new(depth: Intrinsics, color: Intrinsics, color_from_depth: Isometry3<f64>) -> Result<Self, UnusableCamera> {
        check_intrinsics(&depth)?;
        check_intrinsics(&color)?;
        let rotation = color_from_depth.rotation.to_rotation_matrix().into_inner();
        let translation = color_from_depth.translation.vector;
        if !rotation.iter().chain(translation.iter()).all(|value| value.is_finite()) {
            return Err(UnusableCamera::Pose);
        }
        Ok(Self { depth, color, color_from_depth, rotation })
    }

    /// The camera of the depth that comes out.
    pub fn color(&self) -> &Intrinsics {
        &self.color
    }

    /// The depth picture as the colour camera would have measured it.
    ///
    /// # Errors
    /// [`SizeMismatch`] if it is not one of the depth camera.
    pub fn register(&self, depth: &DepthImage) -> Result<DepthImage, SizeMismatch> {
        let Intrinsics { width, height, .. } = self.depth;
        let pixels = width as usize * height as usize;
        if (depth.width, depth.height) != (width, height) || depth.metres.len() != pixels {
            return Err(SizeMismatch { part: "depth picture", found: depth.metres.len(), width, height });
        }
        let (columns, rows) = (self.color.width, self.color.height);
        let mut metres = vec![0.0; columns as usize * rows as usize];
        for v in 0..height {
            for u in 0..width {
                let Some(plane) = LocalPlane::at(depth, u, v) else { continue };
                if !self.draw(u, v, &plane, &mut metres) {
                    self.draw(u, v, &plane.facing(), &mut metres);
                }
            }
        }
        Ok(DepthImage { width: columns, height: rows, metres })
    }

    /// Draws the pixel `(u, v)` of the depth picture, which shows `plane`, into the colour camera's depth. `false` if the plane
    /// is seen from its edge by one of the cameras, or is behind it.
    fn draw(&self, u: u32, v: u32, plane: &LocalPlane, metres: &mut [f32]) -> bool {
        let (u, v) = (f64::from(u), f64::from(v));
        let Some((columns, rows)) = self.covered(u, v, plane) else { return false };
        // The plane n P = 1 in the depth camera's frame; there the inverse depth of a ray is its product with n.
        let k = &self.depth;
        let [by_column, by_row] = plane.slope;
        let at_principal_point = plane.inverse - by_column * (u - k.cx) - by_row * (v - k.cy);
        let normal = self.rotation * Vector3::new(by_column * k.fx, by_row * k.fy, at_principal_point);
        let translation = self.color_from_depth.translation.vector;
        let scale = 1.0 + normal.dot(&translation);
        if scale < 1e-9 {
            return false;
        }
        let normal = normal / scale;
        for row in rows {
            for column in columns.clone() {
                let ray = self.color.unproject(f64::from(column), f64::from(row), 1.0).coords;
                let inverse = normal.dot(&ray);
                if inverse <= 0.0 {
                    continue;
                }
                // The pixel's own point is in the depth picture where the plane's pixel is, or it is another pixel's.
                let point = self.rotation.tr_mul(&(ray / inverse - translation));
                let Some((at_u, at_v)) = k.project(&Point3::from(point)) else { continue };
                if (at_u - u).abs() > HALF || (at_v - v).abs() > HALF {
                    continue;
                }
                let z = (1.0 / inverse) as f32;
                let at = row as usize * self.color.width as usize + column as usize;
                if let Some(nearest) = metres.get_mut(at)
                    && z.is_finite()
                    && (*nearest == 0.0 || z < *nearest)
                {
                    *nearest = z;
                }
            }
        }
        true
    }

    /// Columns and rows of the colour picture that the corners of a depth pixel lie in; `None` if one has no place there.
    /// Beside the picture they are empty.
    fn covered(&self, u: f64, v: f64, plane: &LocalPlane) -> Option<(Range<u32>, Range<u32>)> {
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut top, mut bottom) = (f64::INFINITY, f64::NEG_INFINITY);
        for (to_right, to_bottom) in [(-HALF, -HALF), (HALF, -HALF), (-HALF, HALF), (HALF, HALF)] {
            let z = plane.depth_at(to_right, to_bottom);
            if !(z.is_finite() && z > 0.0) {
                return None;
            }
            let corner = self.color_from_depth * self.depth.unproject(u + to_right, v + to_bottom, z);
            let (x, y) = self.color.project(&corner)?;
            (left, right) = (left.min(x), right.max(x));
            (top, bottom) = (top.min(y), bottom.max(y));
        }
        if right - left > MOST_COVERED || bottom - top > MOST_COVERED {
            return None;
        }
        Some((pixels(left, right, self.color.width), pixels(top, bottom, self.color.height)))
    }
}

/// Pixels whose centres lie from `first` to `last`, of `size` in all.
fn pixels(first: f64, last: f64, size: u32) -> Range<u32> {
    let end = f64::from(size);
    first.ceil().clamp(0.0, end) as u32..(last.floor() + 1.0).clamp(0.0, end) as u32
}
