//! Cameras whose lens bends rays: where a point of space lies in the picture as it was taken, and which ray a pixel sees.
//!
//! The models are those of OpenCV and ROS: Brown-Conrady (`plumb_bob`) [Brown 1966], the rational polynomial, and the
//! equidistant fisheye [Kannala 2006]; see [`Distortion`]. A view has a pinhole camera: sources bring pictures to one when they
//! are read. What a model says outside of the range in which it can be turned round is not used: such pixels see nothing.

mod distortion;
mod lens;

pub use distortion::Distortion;

use super::Intrinsics;
use lens::Lens;
use nalgebra::{Point3, Vector3};

/// Why numbers are no camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnusableCamera {
    /// A focal length or principal point is not a number that a camera can have.
    #[error("{field} is {value}")]
    Intrinsics {
        /// The field.
        field: &'static str,
        /// What it holds.
        value: f64,
    },
    /// The picture has no pixels.
    #[error("a picture of {width} x {height} pixels")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A lens model that is not known.
    #[error("the lens model `{0}` is not known; plumb_bob, rational_polynomial and equidistant (fisheye) are")]
    Model(String),
    /// Another number of coefficients than the model has.
    #[error("{found} coefficients for the lens model `{model}`, which has {expected}")]
    Coefficients {
        /// The model.
        model: String,
        /// Coefficients that are there.
        found: usize,
        /// Coefficients that it has.
        expected: &'static str,
    },
    /// A coefficient is not a finite number.
    #[error("coefficient {0} of the lens is not a finite number")]
    NotFinite(usize),
    /// The pose between two cameras is not finite.
    #[error("the pose between the depth and the colour camera is not finite")]
    Pose,
}

/// A camera: a pinhole behind a lens.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraModel {
    intrinsics: Intrinsics,
    lens: Lens,
}

impl CameraModel {
    /// The camera of `intrinsics`, whose pixels are those of the picture as it was taken, behind a lens with `distortion`.
    ///
    /// # Errors
    /// [`UnusableCamera`] if a number is not one that a camera can have.
    pub fn new(intrinsics: Intrinsics, distortion: Distortion) -> Result<Self, UnusableCamera> {
        check_intrinsics(&intrinsics)?;
        Ok(Self { intrinsics, lens: Lens::new(distortion)? })
    }

    /// The pinhole.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// The lens.
    pub fn distortion(&self) -> &Distortion {
        self.lens.distortion()
    }

    /// Pixel of a point in the camera frame; `None` behind the camera and outside of the lens model's range. It may lie
    /// beside the picture.
    pub fn pixel_of_point(&self, point: &Point3<f64>) -> Option<(f64, f64)> {
        if point.z <= 0.0 {
            return None;
        }
        let k = &self.intrinsics;
        let (x, y) = self.lens.distort(point.x / point.z, point.y / point.z)?;
        Some((k.fx * x + k.cx, k.fy * y + k.cy))
    }

    /// The ray that pixel `(u, v)` sees, in the camera frame with z = 1; `None` outside of the lens model's range.
    pub fn ray_of_pixel(&self, u: f64, v: f64) -> Option<Vector3<f64>> {
        let k = &self.intrinsics;
        let (x, y) = self.lens.undistort((u - k.cx) / k.fx, (v - k.cy) / k.fy)?;
        Some(Vector3::new(x, y, 1.0))
    }
}

/// Refuses numbers that are no pinhole camera.
///
/// # Errors
/// [`UnusableCamera`] naming the field.
pub fn check_intrinsics(k: &Intrinsics) -> Result<(), UnusableCamera> {
    if k.width == 0 || k.height == 0 {
        return Err(UnusableCamera::Size { width: k.width, height: k.height });
    }
    for (field, value) in [("fx", k.fx), ("fy", k.fy)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(UnusableCamera::Intrinsics { field, value });
        }
    }
    for (field, value) in [("cx", k.cx), ("cy", k.cy)] {
        if !value.is_finite() {
            return Err(UnusableCamera::Intrinsics { field, value });
        }
    }
    Ok(())
}
