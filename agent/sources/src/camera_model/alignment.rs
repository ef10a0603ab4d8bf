//! The colour and the depth of a view in one camera without distortion, which the product needs: lenses are undistorted, and depth
//! of another camera is registered to the colours. What is computed for a camera is kept while its calibration stays the same.

use super::{CameraModel, DepthRegistration, Rectification};
use image::RgbImage;
use nalgebra::Isometry3;
use semascan_perception::view::{DepthImage, Intrinsics};

/// Differences that two calibrations of the same camera have by rounding: focal lengths relatively, and pixels.
const SAME_CAMERA: (f64, f64) = (1e-4, 0.05);
/// Metres and radians between two frames that are one.
const SAME_FRAME: (f64, f64) = (1e-4, 1e-3);

/// Brings colour and depth into one camera.
#[derive(Debug, Default)]
pub(crate) struct Aligner {
    color: Option<Straightened>,
    depth: Option<Straightened>,
    /// Between the cameras that it was made for.
    registration: Option<DepthRegistration>,
}

/// A camera, and the way from its pictures to those of a pinhole.
#[derive(Debug)]
struct Straightened {
    model: CameraModel,
    /// `None` where the pictures are those of a pinhole.
    rectification: Option<Rectification>,
}

impl Aligner {
    /// Intrinsics, colour and depth of a view, all in the colour camera; the error says what is wrong, and of the pictures of which
    /// of the two `names`.
    pub(crate) fn align(
        &mut self,
        names: (&str, &str),
        (color_model, rgb): (CameraModel, RgbImage),
        (depth_model, depth): (CameraModel, DepthImage),
        color_from_depth: &Isometry3<f64>,
    ) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
        let (color, measured) = (*color_model.intrinsics(), *depth_model.intrinsics());
        let rgb = match &Straightened::kept(&mut self.color, color_model).rectification {
            Some(rectification) => rectification.color(&rgb).map_err(|error| format!("{}: {error}", names.0))?,
            None => rgb,
        };
        let depth = match &Straightened::kept(&mut self.depth, depth_model).rectification {
            Some(rectification) => rectification.depth(&depth).map_err(|error| format!("{}: {error}", names.1))?,
            None => depth,
        };
        if is_one(&color, &measured, color_from_depth) {
            return Ok((color, rgb, depth));
        }
        let wanted = DepthRegistration::new(measured, color, *color_from_depth).map_err(|error| error.to_string())?;
        let registration = match self.registration.take() {
            Some(kept) if kept == wanted => self.registration.insert(kept),
            _ => self.registration.insert(wanted),
        };
        let depth = registration.register(&depth).map_err(|error| format!("{}: {error}", names.1))?;
        Ok((color, rgb, depth))
    }
}

impl Straightened {
    /// What is kept of a camera, made anew where it is another one.
    fn kept(place: &mut Option<Self>, model: CameraModel) -> &Self {
        match place.take() {
            Some(kept) if kept.model == model => place.insert(kept),
            _ => {
                let rectification = Rectification::of(&model);
                place.insert(Self { model, rectification })
            }
        }
    }
}

/// Whether two pinholes at a pose to each other are one.
fn is_one(color: &Intrinsics, depth: &Intrinsics, color_from_depth: &Isometry3<f64>) -> bool {
    let (shift, turn) = (color_from_depth.translation.vector.norm(), color_from_depth.rotation.angle());
    let is_same = |a: f64, b: f64, most: f64| (a - b).abs() <= most;
    (color.width, color.height) == (depth.width, depth.height)
        && is_same(color.fx, depth.fx, SAME_CAMERA.0 * color.fx)
        && is_same(color.fy, depth.fy, SAME_CAMERA.0 * color.fy)
        && is_same(color.cx, depth.cx, SAME_CAMERA.1)
        && is_same(color.cy, depth.cy, SAME_CAMERA.1)
        && shift <= SAME_FRAME.0
        && turn <= SAME_FRAME.1
}
