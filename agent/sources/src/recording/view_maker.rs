//! The pictures of a view, decoded and brought into one camera. Recordings and live streams share it.

use super::index::{CalibrationStream, Index, Picture, PictureStream};
use super::plan::PlannedView;
use super::registration::{Camera, DepthFrame, Registrar};
use super::topics::{Chosen, is_aligned, is_rectified};
use crate::OpenOptions;
use crate::bop::mask;
use crate::camera_model::DepthEncoding;
use crate::messages::{CloudPicture, ColorPicture, Content, DepthUnit, Message, MessageError, Stamp, decode};
use crate::pinhole_fit::pinhole;
use crate::recorded_pose::{OF_ROBOTS, evidence};
use image::RgbImage;
use semascan_inspection::source::SourceError;
use semascan_inspection::spec::CameraMask;
use semascan_perception::view::{DepthImage, Intrinsics, View};
use std::sync::Arc;

/// What is shown where nothing has a colour.
const GREY: [u8; 3] = [128; 3];

/// The chosen streams by their places in the index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Topics {
    pub(crate) color: Option<usize>,
    pub(crate) depth: usize,
    pub(crate) color_calibration: Option<usize>,
    pub(crate) depth_calibration: Option<usize>,
}

/// Makes views of the pictures of the chosen streams.
#[derive(Debug)]
pub(crate) struct ViewMaker {
    topics: Topics,
    unit: DepthUnit,
    /// The depth camera, and who says so.
    device: Option<(&'static DepthEncoding, &'static str)>,
    /// Pixels that show the robot, row-major.
    ignore: Option<Vec<bool>>,
    registrar: Registrar,
}

impl ViewMaker {
    /// For the chosen streams of `index`, as the options ask for it; and what was said of the unit of depth.
    ///
    /// # Errors
    /// [`SourceError`] naming a camera mask that cannot be read.
    pub(crate) fn new(
        index: &Index,
        chosen: &Chosen<'_>,
        options: &OpenOptions,
    ) -> Result<(Self, String), SourceError> {
        let device = depth_camera(index, chosen.depth, options);
        let (unit, said) = depth_unit(index, chosen.depth, options);
        let ignore = match &options.camera_mask {
            CameraMask::File(file) => Some(mask::read(file)?.inside),
            CameraMask::None | CameraMask::Auto => None,
        };
        Ok((Self { topics: Topics::of(index, chosen), unit, device, ignore, registrar: Registrar::default() }, said))
    }

    /// The depth camera, for people, where it is known.
    pub(crate) fn depth_camera(&self) -> Option<String> {
        self.device.map(|(device, said)| format!("{device}, {said}"))
    }

    /// The chosen streams.
    pub(crate) fn topics(&self) -> Topics {
        self.topics
    }

    /// The view of planned pictures, whose bytes these are, as the `number`-th of its source; the error says what is wrong with it.
    pub(crate) fn view(
        &mut self,
        index: &Index,
        number: u32,
        planned: &PlannedView,
        color: Option<&[u8]>,
        depth: &[u8],
    ) -> Result<View, String> {
        let topics = self.topics;
        let color = match (topics.color, planned.color.zip(color)) {
            (Some(place), Some((picture, bytes))) => match message(stream(index, place)?, picture, bytes)? {
                Message::Color(color) => Some(color),
                _ => return Err("a colour picture became something else".to_owned()),
            },
            _ => None,
        };
        let (intrinsics, rgb, mut depth) = match (message(stream(index, topics.depth)?, planned.depth, depth)?, color) {
            (Message::Depth(depth), Some(color)) => self.registered(
                index,
                color,
                depth.in_metres(self.unit, self.device.map(|(device, _)| device)),
                planned.depth.stamp,
            )?,
            (Message::Cloud(cloud), color) => of_cloud(cloud, color, self.unit.float)?,
            _ => return Err("a depth picture has no colours".to_owned()),
        };
        self.take_robot_out(&mut depth)?;
        if depth.metres.iter().all(|z| *z <= 0.0) {
            let device = self.depth_camera().map(|said| format!("; the depth camera: {said}")).unwrap_or_default();
            return Err(format!("no depth in the whole picture at {:.3} s{device}", planned.depth.stamp.seconds()));
        }
        let pose = evidence(planned.table_from_camera, OF_ROBOTS);
        Ok(View {
            index: number,
            stamp: Some(planned.depth.stamp.seconds()),
            intrinsics,
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose,
            labels: None,
            truth: None,
        })
    }

    /// Colour and depth in the colour camera.
    fn registered(
        &mut self,
        index: &Index,
        color: ColorPicture,
        depth: DepthImage,
        stamp: Stamp,
    ) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
        let Topics { color: color_stream, depth: depth_stream, color_calibration, depth_calibration } = self.topics;
        let color_stream = stream(index, color_stream.ok_or("it has no colours")?)?;
        let depth_stream = stream(index, depth_stream)?;
        let color_camera = camera(index, color_stream, color_calibration, stamp)?;
        let mut depth_camera = camera(index, depth_stream, depth_calibration, stamp)?;
        // What is aligned to a rectified picture is rectified.
        depth_camera.is_rectified |= is_aligned(&depth_stream.topic) && color_camera.is_rectified;
        let depth_frame = if is_aligned(&depth_stream.topic) || color_stream.frame == depth_stream.frame {
            DepthFrame::Color
        } else {
            match index.transforms.pose(&color_stream.frame, &depth_stream.frame, stamp) {
                Ok(color_from_depth) => DepthFrame::Apart { color_from_depth },
                Err(_) => DepthFrame::Unknown,
            }
        };
        self.registrar.depth_in_color((color_camera, color.rgb), (depth_camera, depth), depth_frame)
    }

    /// Depth of pixels that show the robot becomes unmeasured.
    fn take_robot_out(&self, depth: &mut DepthImage) -> Result<(), String> {
        let Some(ignore) = &self.ignore else { return Ok(()) };
        if ignore.len() != depth.metres.len() {
            return Err(format!("{} pixels, but the camera mask has {}", depth.metres.len(), ignore.len()));
        }
        for (z, _) in depth.metres.iter_mut().zip(ignore).filter(|(_, ignored)| **ignored) {
            *z = 0.0;
        }
        Ok(())
    }
}

/// Decodes a picture of a stream.
fn message(stream: &PictureStream, picture: Picture, bytes: &[u8]) -> Result<Message, String> {
    let said = |error: MessageError| format!("{} at {:.3} s: {error}", stream.topic, picture.stamp.seconds());
    decode(stream.kind, stream.encoding, bytes).map_err(said)
}

fn stream(index: &Index, place: usize) -> Result<&PictureStream, String> {
    index.pictures.get(place).ok_or_else(|| "its topic is gone".to_owned())
}

/// The camera of a stream as it was at a time.
fn camera<'a>(
    index: &'a Index,
    stream: &'a PictureStream,
    calibration: Option<usize>,
    stamp: Stamp,
) -> Result<Camera<'a>, String> {
    let calibrations = calibration.and_then(|place| index.calibrations.get(place));
    let calibration = calibrations.and_then(|calibrations| calibrations.at(stamp));
    let calibration = calibration.ok_or_else(|| format!("{} has no calibration", stream.topic))?;
    Ok(Camera { topic: &stream.topic, calibration, is_rectified: is_rectified(&stream.topic) })
}

impl Topics {
    fn of(index: &Index, chosen: &Chosen<'_>) -> Self {
        let stream = |wanted: &PictureStream| index.pictures.iter().position(|stream| std::ptr::eq(stream, wanted));
        let calibration =
            |wanted: &CalibrationStream| index.calibrations.iter().position(|stream| std::ptr::eq(stream, wanted));
        Self {
            color: chosen.color.and_then(stream),
            depth: stream(chosen.depth).unwrap_or_default(),
            color_calibration: chosen.color_calibration.and_then(calibration),
            depth_calibration: chosen.depth_calibration.and_then(calibration),
        }
    }
}

/// An organized cloud as a view: the pinhole is read off its points. Where it has no colours of its own they are those of the
/// picture that belongs to it, if that has its size.
fn of_cloud(
    cloud: CloudPicture,
    color: Option<ColorPicture>,
    unit: f64,
) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
    let CloudPicture { width, height, positions, colors, .. } = cloud;
    let positions: Vec<[f32; 3]> =
        positions.into_iter().map(|point| point.map(|c| (f64::from(c) * unit) as f32)).collect();
    let intrinsics = pinhole(width, height, &positions)?.intrinsics;
    let measured = |p: &[f32; 3]| p.iter().all(|c| c.is_finite()) && p[2] > 0.0;
    let metres = positions.iter().map(|p| if measured(p) { p[2] } else { 0.0 }).collect();
    let rgb = match (colors, color) {
        (None, Some(color)) if color.rgb.dimensions() == (width, height) => color.rgb,
        (colors, _) => {
            let pixels = colors.unwrap_or_else(|| vec![GREY; positions.len()]);
            RgbImage::from_raw(width, height, pixels.into_iter().flatten().collect())
                .ok_or("there is not one colour for each point")?
        }
    };
    Ok((intrinsics, rgb, DepthImage { width, height, metres }))
}

/// The depth camera of a stream, and who says so.
fn depth_camera(
    index: &Index,
    depth: &PictureStream,
    options: &OpenOptions,
) -> Option<(&'static DepthEncoding, &'static str)> {
    let said = options.recording.device.map(|device| (device, "as said"));
    said.or_else(|| {
        let of_stream = |(device, _): &&(String, String)| depth.topic.starts_with(&format!("{device}/"));
        let (_, product) = index.products.iter().find(of_stream)?;
        Some((DepthEncoding::of_product(product)?, "as the camera states"))
    })
}

/// What a depth of 1 is: as asked for, as the camera states it, or as ROS has it.
fn depth_unit(index: &Index, depth: &PictureStream, options: &OpenOptions) -> (DepthUnit, String) {
    let both = |metres: f64| DepthUnit { integer: metres, float: metres };
    if let Some(millimetres) = options.depth_scale {
        return (both(millimetres * 1e-3), format!("{millimetres} mm, as said"));
    }
    if let Some(unit) = options.unit {
        return (both(unit.in_metres()), format!("{}, as said", unit.name()));
    }
    let of_camera = index.depth_units.iter().find(|(stream, _)| depth.topic.starts_with(&format!("{stream}/")));
    match (depth.content, of_camera, options.recording.device) {
        (Content::Cloud, ..) => (DepthUnit::default(), "m, as ROS has it".to_owned()),
        (_, Some((_, unit)), _) => {
            (DepthUnit { integer: *unit, ..DepthUnit::default() }, format!("{} mm, as the camera states", 1e3 * unit))
        }
        (_, None, Some(device)) => {
            let unit = DepthUnit { integer: device.metres_per_unit, float: device.metres_per_float() };
            let (integer, float) = (1e3 * unit.integer, 1e3 * unit.float);
            (unit, format!("whole numbers are {integer} mm, others {float} mm, as {} has it", device.name))
        }
        (_, None, None) => (DepthUnit::default(), "whole numbers are mm, others m, as ROS has it".to_owned()),
    }
}
