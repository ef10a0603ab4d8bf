//! What messages from outside become: a few types of our own, whoever wrote them.

use super::error::MessageError;
use crate::camera_model::DepthEncoding;
use image::RgbImage;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use semascan_perception::view::DepthImage;

/// How far from 1 the length of a quaternion may be that was written in single precision or rounded.
const UNIT_LENGTH: f64 = 1e-2;

/// A time on the clock of whoever wrote the message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp {
    /// Nanoseconds since the clock's origin.
    pub nanoseconds: i64,
}

impl Stamp {
    /// The time `seconds` and `nanoseconds` after the origin; what no clock shows becomes the last time there is.
    pub fn new(seconds: i64, nanoseconds: u32) -> Self {
        Self { nanoseconds: seconds.saturating_mul(1_000_000_000).saturating_add(i64::from(nanoseconds)) }
    }

    /// Seconds since the origin.
    pub fn seconds(self) -> f64 {
        self.nanoseconds as f64 * 1e-9
    }

    /// How far two times are apart, in nanoseconds.
    pub fn distance(self, other: Self) -> u64 {
        self.nanoseconds.abs_diff(other.nanoseconds)
    }

    /// Whether the writer left the time out: most leave a 0 then.
    pub fn is_missing(self) -> bool {
        self.nanoseconds == 0
    }
}

/// When a message is of, and in which frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The time.
    pub stamp: Stamp,
    /// Name of the frame.
    pub frame: String,
}

/// A colour picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorPicture {
    /// Time, and the camera's frame.
    pub header: Header,
    /// The picture.
    pub rgb: RgbImage,
}

/// A depth picture as it was written.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthPicture {
    /// Time, and the camera's frame.
    pub header: Header,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Depth along the optical axis, row-major.
    pub samples: DepthSamples,
}

/// The values of a depth picture.
#[derive(Clone, Debug, PartialEq)]
pub enum DepthSamples {
    /// Whole numbers of a unit, millimetres unless the camera says otherwise; 0 = not measured.
    Integers(Vec<u16>),
    /// Metres; what is no number above 0 was not measured.
    Floats(Vec<f32>),
}

/// What one of the values of a depth picture is, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthUnit {
    /// Of whole numbers.
    pub integer: f64,
    /// Of floating-point numbers.
    pub float: f64,
}

impl Default for DepthUnit {
    /// That of ROS [REP 118]: millimetres and metres.
    fn default() -> Self {
        Self { integer: 1e-3, float: 1.0 }
    }
}

impl DepthPicture {
    /// The depth in metres; what `device` does not measure is 0.
    pub fn in_metres(&self, unit: DepthUnit, device: Option<&DepthEncoding>) -> DepthImage {
        let measured = |stored: f64, unit: f64| {
            let z = (stored * unit) as f32;
            let is_length = z.is_finite() && z > 0.0;
            if is_length && device.is_none_or(|device| device.measures(stored, z)) { z } else { 0.0 }
        };
        let metres = match &self.samples {
            DepthSamples::Integers(values) => values.iter().map(|z| measured(f64::from(*z), unit.integer)).collect(),
            DepthSamples::Floats(values) => values.iter().map(|z| measured(f64::from(*z), unit.float)).collect(),
        };
        DepthImage { width: self.width, height: self.height, metres }
    }
}

/// The calibration of a camera, as ROS and Foxglove write it.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Time, and the camera's frame.
    pub header: Header,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Name of the distortion model, as `plumb_bob`; empty where there is none.
    pub distortion_model: String,
    /// Coefficients of the distortion model.
    pub distortion: Vec<f64>,
    /// Camera matrix of the raw pictures, row-major.
    pub k: [f64; 9],
    /// Camera matrix of the rectified pictures, row-major 3 x 4; zero where the camera has none.
    pub p: [f64; 12],
}

/// A pose between two frames at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedTransform {
    /// The time.
    pub stamp: Stamp,
    /// Name of the parent frame.
    pub parent: String,
    /// Name of the child frame.
    pub child: String,
    /// Maps coordinates of the child frame to the parent frame.
    pub parent_from_child: Isometry3<f64>,
}

/// Positions of joints.
#[derive(Clone, Debug, PartialEq)]
pub struct JointStates {
    /// The time.
    pub stamp: Stamp,
    /// Name and position of each joint: radians or metres.
    pub positions: Vec<(String, f64)>,
}

/// A point cloud in the grid that it was written in.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudPicture {
    /// Time, and the frame of the points.
    pub header: Header,
    /// Columns.
    pub width: u32,
    /// Rows; 1 where the cloud is in no order.
    pub height: u32,
    /// Points, row-major; NaN where nothing was measured.
    pub positions: Vec<[f32; 3]>,
    /// Colours, where the cloud has them.
    pub colors: Option<Vec<[u8; 3]>>,
}

/// The name of a frame as trees of transforms know it: ROS 1 wrote some with a slash in front.
pub(crate) fn frame_name(name: &str) -> String {
    name.strip_prefix('/').unwrap_or(name).to_owned()
}

/// A pose from its numbers; `[x, y, z, w]` is the rotation's order.
pub(crate) fn isometry(translation: [f64; 3], [x, y, z, w]: [f64; 4]) -> Result<Isometry3<f64>, MessageError> {
    if !translation.iter().all(|t| t.is_finite()) {
        return Err(MessageError::field("translation", "is no number of metres"));
    }
    let quaternion = Quaternion::new(w, x, y, z);
    let is_unit = (quaternion.norm() - 1.0).abs() <= UNIT_LENGTH;
    if !is_unit {
        return Err(MessageError::field("rotation", "is a quaternion whose length is not 1"));
    }
    let rotation = UnitQuaternion::new_normalize(quaternion);
    let [x, y, z] = translation;
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}
