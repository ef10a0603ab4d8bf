//! The colour and the depth of a view in one camera without distortion, which the product needs.
//!
//! So far this is checked and not made: pictures that are distorted, and depth that another camera measured, are refused with
//! what could be recorded instead. [`depth_in_color`] is the one place that knows.

use crate::messages::Calibration;
use image::RgbImage;
use nalgebra::Isometry3;
use semascan_perception::view::{DepthImage, Intrinsics};

/// Differences that two calibrations of the same camera have by rounding: focal lengths relatively, and pixels.
const SAME_CAMERA: (f64, f64) = (1e-4, 0.05);
/// Metres and radians between two frames that are one.
const SAME_FRAME: (f64, f64) = (1e-4, 1e-3);
/// Coefficients of distortion that are 0.
const NO_DISTORTION: f64 = 1e-9;

/// A camera and the pictures that it took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera<'a> {
    pub(crate) topic: &'a str,
    pub(crate) calibration: &'a Calibration,
    /// Whether the pictures are rectified: the calibration's P is theirs, and its distortion is not.
    pub(crate) is_rectified: bool,
}

/// Where the depth lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DepthFrame {
    /// In the colour camera, as the recording says.
    Color,
    /// Somewhere else.
    Apart { color_from_depth: Isometry3<f64> },
    /// Nothing says where.
    Unknown,
}

/// Intrinsics, colour and depth of a view, all in the colour camera; the error says what to record instead.
pub(crate) fn depth_in_color(
    (color_camera, rgb): (Camera<'_>, RgbImage),
    (depth_camera, depth): (Camera<'_>, DepthImage),
    depth_frame: DepthFrame,
) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
    let color = color_camera.pinhole(rgb.dimensions())?;
    let measured = depth_camera.pinhole((depth.width, depth.height))?;
    let advice = "record depth that is aligned to colour, or name its topic with depth=TOPIC";
    let topic = depth_camera.topic;
    match depth_frame {
        DepthFrame::Color => {}
        DepthFrame::Apart { color_from_depth } => {
            let (shift, turn) = (color_from_depth.translation.vector.norm(), color_from_depth.rotation.angle());
            if shift > SAME_FRAME.0 || turn > SAME_FRAME.1 {
                return Err(format!(
                    "the depth of {topic} was measured by another camera, {:.1} mm and {:.2} deg from that of the \
                     colours: {advice}",
                    1e3 * shift,
                    turn.to_degrees()
                ));
            }
        }
        DepthFrame::Unknown => {
            return Err(format!("nothing says where the camera of {topic} is to that of the colours: {advice}"));
        }
    }
    let lengths = |k: &Intrinsics| [k.fx, k.fy];
    let centre = |k: &Intrinsics| [k.cx, k.cy];
    let is_same_length =
        lengths(&color).iter().zip(lengths(&measured)).all(|(a, b)| (a - b).abs() <= SAME_CAMERA.0 * a);
    let is_same_centre = centre(&color).iter().zip(centre(&measured)).all(|(a, b)| (a - b).abs() <= SAME_CAMERA.1);
    if (color.width, color.height) != (measured.width, measured.height) || !is_same_length || !is_same_centre {
        return Err(format!(
            "the depth of {topic} has {} x {} pixels and the focal length {:.1}, the colours {} x {} and {:.1}: {advice}",
            measured.width, measured.height, measured.fx, color.width, color.height, color.fx
        ));
    }
    Ok((color, rgb, depth))
}

impl Camera<'_> {
    /// The camera as a pinhole without distortion whose pictures have this size.
    fn pinhole(&self, (width, height): (u32, u32)) -> Result<Intrinsics, String> {
        let Self { topic, calibration, is_rectified } = self;
        if (calibration.width, calibration.height) != (width, height) {
            return Err(format!(
                "{topic} has pictures of {width} x {height} pixels, and its calibration is for {} x {}",
                calibration.width, calibration.height
            ));
        }
        let [fx, skew, cx, _, fy, cy, ..] = calibration.k;
        let raw = Intrinsics { width, height, fx, fy, cx, cy };
        let [pfx, pskew, pcx, _, _, pfy, pcy, ..] = calibration.p;
        let rectified = Intrinsics { width, height, fx: pfx, fy: pfy, cx: pcx, cy: pcy };
        let (camera, skew) = if *is_rectified && pfx > 0.0 { (rectified, pskew) } else { (raw, skew) };
        if !is_rectified && calibration.distortion.iter().any(|d| d.abs() > NO_DISTORTION || !d.is_finite()) {
            return Err(format!(
                "the pictures of {topic} are distorted ({}): record the rectified ones (image_rect)",
                calibration.distortion_model
            ));
        }
        let is_length = |f: f64| f.is_finite() && f > 0.0;
        if !is_length(camera.fx)
            || !is_length(camera.fy)
            || !camera.cx.is_finite()
            || !camera.cy.is_finite()
            || skew != 0.0
        {
            return Err(format!(
                "the calibration of {topic} is not that of a pinhole camera: is the camera calibrated?"
            ));
        }
        Ok(camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Header;

    fn calibration(fx: f64, distortion: &[f64]) -> Calibration {
        Calibration {
            header: Header::default(),
            width: 4,
            height: 3,
            distortion_model: "plumb_bob".into(),
            distortion: distortion.to_vec(),
            k: [fx, 0.0, 1.5, 0.0, fx, 1.0, 0.0, 0.0, 1.0],
            p: [50.0, 0.0, 1.0, 0.0, 0.0, 51.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
    }

    fn registered(
        color: &Calibration,
        depth: &Calibration,
        is_rectified: bool,
        frame: DepthFrame,
    ) -> Result<Intrinsics, String> {
        let camera = |topic, calibration| Camera { topic, calibration, is_rectified };
        let depth_image = DepthImage { width: 4, height: 3, metres: vec![0.5; 12] };
        let color = (camera("/color", color), RgbImage::new(4, 3));
        depth_in_color(color, (camera("/depth", depth), depth_image), frame).map(|(intrinsics, ..)| intrinsics)
    }

    #[test]
    fn aligned_pictures_pass_and_others_say_what_to_record() {
        let plain = calibration(60.0, &[0.0; 5]);
        let found = registered(&plain, &plain, false, DepthFrame::Color).expect("aligned");
        assert_eq!((found.fx, found.cx, found.cy), (60.0, 1.5, 1.0));
        let apart = |x: f64| DepthFrame::Apart { color_from_depth: Isometry3::translation(x, 0.0, 0.0) };
        assert!(registered(&plain, &plain, false, apart(0.0)).is_ok());
        let said = registered(&plain, &plain, false, apart(0.015)).expect_err("another camera");
        assert!(said.contains("15.0 mm") && said.contains("/depth") && said.contains("aligned"), "{said}");
        assert!(registered(&plain, &plain, false, DepthFrame::Unknown).is_err());
        let said = registered(&plain, &calibration(61.0, &[]), false, DepthFrame::Color).expect_err("another lens");
        assert!(said.contains("61.0"), "{said}");
        let bent = calibration(60.0, &[0.1]);
        let said = registered(&bent, &plain, false, DepthFrame::Color).expect_err("distorted");
        assert!(said.contains("plumb_bob"), "{said}");
        let rectified = registered(&bent, &bent, true, DepthFrame::Color).expect("rectified");
        assert_eq!((rectified.fx, rectified.fy, rectified.cx), (50.0, 51.0, 1.0));
        let none = Calibration { k: [0.0; 9], ..plain.clone() };
        assert!(registered(&none, &none, false, DepthFrame::Color).expect_err("zero").contains("calibrated"));
        let small = Calibration { width: 2, ..plain.clone() };
        assert!(registered(&small, &plain, false, DepthFrame::Color).expect_err("size").contains("2 x 3"));
    }
}
