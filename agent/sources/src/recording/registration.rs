//! The colour and the depth of a recorded view in one camera ([`Aligner`]), by the calibrations that the messages carry.

use crate::camera_model::{Aligner, CameraModel, Distortion};
use crate::messages::Calibration;
use image::RgbImage;
use nalgebra::Isometry3;
use semascan_perception::view::{DepthImage, Intrinsics};

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

/// Brings colour and depth into one camera.
#[derive(Debug, Default)]
pub(crate) struct Registrar {
    aligner: Aligner,
}

impl Registrar {
    /// Intrinsics, colour and depth of a view, all in the colour camera; the error says what is wrong.
    pub(crate) fn depth_in_color(
        &mut self,
        (color_camera, rgb): (Camera<'_>, RgbImage),
        (depth_camera, depth): (Camera<'_>, DepthImage),
        depth_frame: DepthFrame,
    ) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
        let topics = (color_camera.topic, depth_camera.topic);
        let color_model = color_camera.model(rgb.dimensions())?;
        let depth_model = depth_camera.model((depth.width, depth.height))?;
        let color_from_depth = match depth_frame {
            DepthFrame::Color => Isometry3::identity(),
            DepthFrame::Apart { color_from_depth } => color_from_depth,
            DepthFrame::Unknown => {
                return Err(format!(
                    "nothing says where the camera of {} is to that of the colours: record their transform, or depth that is \
                     aligned to colour (depth=TOPIC names it)",
                    topics.1
                ));
            }
        };
        self.aligner.align(topics, (color_model, rgb), (depth_model, depth), &color_from_depth)
    }
}

impl Camera<'_> {
    /// The camera whose pictures have this size.
    fn model(&self, (width, height): (u32, u32)) -> Result<CameraModel, String> {
        let Self { topic, calibration, is_rectified } = self;
        if (calibration.width, calibration.height) != (width, height) {
            return Err(format!(
                "{topic} has pictures of {width} x {height} pixels, and its calibration is for {} x {}",
                calibration.width, calibration.height
            ));
        }
        let refused =
            |reason: String| format!("the calibration of {topic} cannot be used ({reason}): is the camera calibrated?");
        let [fx, skew, cx, _, fy, cy, ..] = calibration.k;
        let [pfx, pskew, pcx, _, _, pfy, pcy, ..] = calibration.p;
        let takes_p = *is_rectified && pfx > 0.0;
        let (intrinsics, skew) = if takes_p {
            (Intrinsics { width, height, fx: pfx, fy: pfy, cx: pcx, cy: pcy }, pskew)
        } else {
            (Intrinsics { width, height, fx, fy, cx, cy }, skew)
        };
        if skew != 0.0 {
            return Err(refused(format!("its axes are askew by {skew}")));
        }
        let distortion = if *is_rectified {
            Distortion::None
        } else {
            Distortion::named(&calibration.distortion_model, &calibration.distortion)
                .map_err(|error| refused(error.to_string()))?
        };
        CameraModel::new(intrinsics, distortion).map_err(|error| refused(error.to_string()))
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
    ) -> Result<(Intrinsics, DepthImage), String> {
        let camera = |topic, calibration| Camera { topic, calibration, is_rectified };
        let depth_image = DepthImage { width: 4, height: 3, metres: vec![0.5; 12] };
        let color = (camera("/color", color), RgbImage::new(4, 3));
        let registered = Registrar::default().depth_in_color(color, (camera("/depth", depth), depth_image), frame);
        registered.map(|(intrinsics, _, depth)| (intrinsics, depth))
    }

    #[test]
    fn aligned_pictures_stay_and_a_camera_that_is_none_is_refused() {
        let plain = calibration(60.0, &[0.0; 5]);
        let (found, depth) = registered(&plain, &plain, false, DepthFrame::Color).expect("aligned");
        assert_eq!((found.fx, found.cx, found.cy), (60.0, 1.5, 1.0));
        assert_eq!(depth.metres, [0.5; 12]);
        let said = registered(&plain, &plain, false, DepthFrame::Unknown).expect_err("nothing says where");
        assert!(said.contains("/depth") && said.contains("aligned"), "{said}");
        let bent = calibration(60.0, &[0.1]);
        let said = registered(&bent, &plain, false, DepthFrame::Color).expect_err("one coefficient is no plumb bob");
        assert!(said.contains("/color"), "{said}");
        let (rectified, _) = registered(&bent, &bent, true, DepthFrame::Color).expect("rectified");
        assert_eq!((rectified.fx, rectified.fy, rectified.cx), (50.0, 51.0, 1.0));
        let none = Calibration { k: [0.0; 9], ..plain.clone() };
        assert!(registered(&none, &none, false, DepthFrame::Color).expect_err("zero").contains("calibrated"));
        let small = Calibration { width: 2, ..plain.clone() };
        assert!(registered(&small, &plain, false, DepthFrame::Color).expect_err("size").contains("2 x 3"));
    }

    #[test]
    fn depth_of_another_camera_is_brought_to_the_colours_and_what_it_did_not_see_stays_unmeasured() {
        let plain = calibration(60.0, &[]);
        // A camera one pixel to the right at this depth, 0.1 m nearer.
        let color_from_depth = Isometry3::translation(0.5 / 60.0, 0.0, 0.1);
        let (_, depth) = registered(&plain, &plain, false, DepthFrame::Apart { color_from_depth }).expect("registered");
        let measured: Vec<f32> = depth.metres.iter().copied().filter(|z| *z > 0.0).collect();
        assert!(measured.len() >= 6 && measured.iter().all(|z| (z - 0.6).abs() < 1e-6), "{:?}", depth.metres);
        assert!((0..3).all(|row| depth.metres[4 * row] == 0.0), "{:?}", depth.metres);
        // A distorted lens, one that magnifies: all in the pinhole of the colours.
        let bent = calibration(60.0, &[0.01, 0.0, 0.0, 0.0, 0.0]);
        let (found, depth) = registered(&bent, &calibration(61.0, &[]), false, DepthFrame::Color).expect("registered");
        assert_eq!((found.fx, depth.width), (60.0, 4));
        assert!(depth.metres.iter().filter(|z| (**z - 0.5).abs() < 1e-6).count() >= 10, "{:?}", depth.metres);
    }
}
