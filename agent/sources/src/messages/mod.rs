//! Messages of other people's programs, decoded into a few types of our own: ROS 2 (CDR), ROS 1, and Foxglove's schemas as
//! Protocol Buffers and JSON. Recordings and live streams carry the same messages.
//!
//! They come from outside: every length is checked before anything is allocated, and what cannot be read is an error that
//! names the field.
//!
//! | file | what |
//! |---|---|
//! | `types.rs` | what messages become |
//! | `fields.rs` | fields one after the other: CDR and packed |
//! | `ros.rs`, `protobuf.rs`, `json.rs` | messages of each encoding |
//! | `raw_picture.rs`, `compressed_picture.rs`, `point_cloud.rs` | pictures and clouds out of their bytes |

mod compressed_picture;
mod error;
pub(crate) mod fields;
mod json;
mod point_cloud;
mod protobuf;
mod raw_picture;
mod ros;
#[cfg(test)]
mod tests;
mod types;

pub(crate) use compressed_picture::CompressedPicture;
pub use error::MessageError;
pub(crate) use raw_picture::RawPicture;
pub(crate) use types::frame_name;
pub use types::{
    Calibration, CloudPicture, ColorPicture, DepthPicture, DepthSamples, DepthUnit, Header, JointStates, Stamp,
    StampedTransform,
};

use fields::Fields;
use point_cloud::PointCloud;

/// What a message is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// A picture as it is in memory.
    Image,
    /// A picture as JPEG or PNG.
    CompressedImage,
    /// A camera's calibration.
    Calibration,
    /// One pose between two frames.
    Transform,
    /// Several of them.
    Transforms,
    /// Positions of joints.
    JointStates,
    /// A point cloud.
    PointCloud,
    /// A text.
    Text,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 8] = [
        Self::Image,
        Self::CompressedImage,
        Self::Calibration,
        Self::Transform,
        Self::Transforms,
        Self::JointStates,
        Self::PointCloud,
        Self::Text,
    ];
}

/// How a message is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Encoding {
    /// ROS 2.
    Cdr,
    /// ROS 1.
    Ros1,
    /// Protocol Buffers, of Foxglove's schemas.
    Protobuf,
    /// JSON, of Foxglove's schemas.
    Json,
}

impl Encoding {
    /// Every encoding.
    pub const ALL: [Self; 4] = [Self::Cdr, Self::Ros1, Self::Protobuf, Self::Json];
}

/// Types of ROS, without the `msg/` that ROS 2 puts in the middle.
const ROS: &[(&str, Kind)] = &[
    ("sensor_msgs/Image", Kind::Image),
    ("sensor_msgs/CompressedImage", Kind::CompressedImage),
    ("sensor_msgs/CameraInfo", Kind::Calibration),
    ("geometry_msgs/TransformStamped", Kind::Transform),
    ("tf2_msgs/TFMessage", Kind::Transforms),
    ("tf/tfMessage", Kind::Transforms),
    ("sensor_msgs/JointState", Kind::JointStates),
    ("sensor_msgs/PointCloud2", Kind::PointCloud),
    ("std_msgs/String", Kind::Text),
];

/// Foxglove's schemas.
const FOXGLOVE: &[(&str, Kind)] = &[
    ("foxglove.RawImage", Kind::Image),
    ("foxglove.CompressedImage", Kind::CompressedImage),
    ("foxglove.CameraCalibration", Kind::Calibration),
    ("foxglove.FrameTransform", Kind::Transform),
    ("foxglove.FrameTransforms", Kind::Transforms),
];

/// The kind and encoding of the messages of a channel, by the name of their type and of their encoding; `None` for what
/// is not decoded.
pub fn of_channel(type_name: &str, encoding: &str) -> Option<(Kind, Encoding)> {
    let (types, encoding) = match encoding {
        "cdr" => (ROS, Encoding::Cdr),
        "ros1" => (ROS, Encoding::Ros1),
        "protobuf" => (FOXGLOVE, Encoding::Protobuf),
        "json" => (FOXGLOVE, Encoding::Json),
        _ => return None,
    };
    let name = type_name.replacen("/msg/", "/", 1);
    let (_, kind) = types.iter().find(|(known, _)| *known == name)?;
    Some((*kind, encoding))
}

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// A colour picture.
    Color(ColorPicture),
    /// A depth picture.
    Depth(DepthPicture),
    /// A point cloud.
    Cloud(CloudPicture),
    /// A camera's calibration.
    Calibration(Calibration),
    /// Poses between frames.
    Transforms(Vec<StampedTransform>),
    /// Positions of joints.
    Joints(JointStates),
    /// A text.
    Text(String),
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Content {
    /// Colours.
    Color,
    /// Depth.
    Depth,
    /// Points, perhaps with colours.
    Cloud,
}

impl Message {
    /// What it shows, where it is a picture.
    pub fn content(&self) -> Option<Content> {
        match self {
            Self::Color(_) => Some(Content::Color),
            Self::Depth(_) => Some(Content::Depth),
            Self::Cloud(_) => Some(Content::Cloud),
            Self::Calibration(_) | Self::Transforms(_) | Self::Joints(_) | Self::Text(_) => None,
        }
    }
}

/// Decodes a message.
///
/// # Errors
/// [`MessageError`] naming the field at fault.
pub fn decode(kind: Kind, encoding: Encoding, message: &[u8]) -> Result<Message, MessageError> {
    Ok(match parse(kind, encoding, message)? {
        Parsed::Raw(picture) => picture.decode()?,
        Parsed::Compressed(picture) => picture.decode()?,
        Parsed::Cloud(cloud) => cloud.decode()?,
        Parsed::Calibration(calibration) => Message::Calibration(calibration),
        Parsed::Transforms(transforms) => Message::Transforms(transforms),
        Parsed::Joints(joints) => Message::Joints(joints),
        Parsed::Text(text) => Message::Text(text),
    })
}

/// A message whose fields are known; the pixels of a picture are not decoded.
#[derive(Clone, Debug)]
pub(crate) enum Parsed<'a> {
    Raw(RawPicture<'a>),
    Compressed(CompressedPicture<'a>),
    Cloud(PointCloud<'a>),
    Calibration(Calibration),
    Transforms(Vec<StampedTransform>),
    Joints(JointStates),
    Text(String),
}

impl Parsed<'_> {
    /// Header and content of a picture; `None` for other messages.
    pub(crate) fn picture(&self) -> Option<Result<(&Header, Content), MessageError>> {
        match self {
            Self::Raw(picture) => Some(picture.content().map(|content| (&picture.header, content))),
            Self::Compressed(picture) => Some(picture.content().map(|content| (&picture.header, content))),
            Self::Cloud(cloud) => Some(Ok((&cloud.header, Content::Cloud))),
            Self::Calibration(_) | Self::Transforms(_) | Self::Joints(_) | Self::Text(_) => None,
        }
    }
}

/// Reads the fields of a message.
pub(crate) fn parse(kind: Kind, encoding: Encoding, message: &[u8]) -> Result<Parsed<'_>, MessageError> {
    match encoding {
        Encoding::Cdr => ros::parse(kind, Fields::cdr(message)?),
        Encoding::Ros1 => ros::parse(kind, Fields::packed(message)),
        Encoding::Protobuf => protobuf::parse(kind, message),
        Encoding::Json => json::parse(kind, message),
    }
}
