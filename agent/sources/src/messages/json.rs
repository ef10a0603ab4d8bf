//! Messages of Foxglove's schemas as JSON: the same fields, bytes in Base64.

use super::error::MessageError;
use super::protobuf::calibration;
use super::types::{Header, Stamp, StampedTransform, frame_name, isometry};
use super::{CompressedPicture, Kind, Parsed, RawPicture};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// A time.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct Time {
    #[serde(alias = "seconds")]
    sec: i64,
    #[serde(alias = "nanos")]
    nsec: u32,
}

/// `foxglove.RawImage`.
#[derive(Debug, Deserialize)]
struct RawImage {
    #[serde(default)]
    timestamp: Time,
    #[serde(default)]
    frame_id: String,
    width: u32,
    height: u32,
    encoding: String,
    #[serde(default)]
    step: u32,
    data: String,
}

/// `foxglove.CompressedImage`.
#[derive(Debug, Deserialize)]
struct CompressedImage {
    #[serde(default)]
    timestamp: Time,
    #[serde(default)]
    frame_id: String,
    data: String,
    format: String,
}

/// `foxglove.CameraCalibration`.
#[derive(Debug, Deserialize)]
struct CameraCalibration {
    #[serde(default)]
    timestamp: Time,
    #[serde(default)]
    frame_id: String,
    width: u32,
    height: u32,
    #[serde(default)]
    distortion_model: String,
    #[serde(default, rename = "D")]
    d: Vec<f64>,
    #[serde(rename = "K")]
    k: Vec<f64>,
    #[serde(default, rename = "P")]
    p: Vec<f64>,
}

/// `foxglove.FrameTransform`.
#[derive(Debug, Deserialize)]
struct FrameTransform {
    #[serde(default)]
    timestamp: Time,
    parent_frame_id: String,
    child_frame_id: String,
    translation: Vector,
    rotation: Rotation,
}

/// `foxglove.FrameTransforms`.
#[derive(Debug, Deserialize)]
struct FrameTransforms {
    transforms: Vec<FrameTransform>,
}

#[derive(Debug, Deserialize)]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Debug, Deserialize)]
struct Rotation {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// The message of type `kind`.
pub(crate) fn parse(kind: Kind, message: &[u8]) -> Result<Parsed<'static>, MessageError> {
    Ok(match kind {
        Kind::Image => {
            let found: RawImage = decode(message)?;
            Parsed::Raw(RawPicture {
                header: header(found.timestamp, &found.frame_id),
                width: found.width,
                height: found.height,
                encoding: found.encoding.into(),
                big_endian: false,
                step: found.step,
                data: base64(&found.data)?.into(),
            })
        }
        Kind::CompressedImage => {
            let found: CompressedImage = decode(message)?;
            let header = header(found.timestamp, &found.frame_id);
            let data = base64(&found.data)?.into();
            Parsed::Compressed(CompressedPicture { header, format: found.format.into(), data })
        }
        Kind::Calibration => {
            let found: CameraCalibration = decode(message)?;
            let header = header(found.timestamp, &found.frame_id);
            let size = (found.width, found.height);
            Parsed::Calibration(calibration(header, size, found.distortion_model, found.d, &found.k, &found.p)?)
        }
        Kind::Transforms => {
            let found: FrameTransforms = decode(message)?;
            Parsed::Transforms(found.transforms.iter().map(transform).collect::<Result<_, _>>()?)
        }
        Kind::Transform => Parsed::Transforms(vec![transform(&decode(message)?)?]),
        Kind::JointStates | Kind::PointCloud | Kind::Text => {
            let reason = "Foxglove has no such schema".to_owned();
            return Err(MessageError::Encoding { encoding: "JSON", reason });
        }
    })
}

fn decode<M: DeserializeOwned>(message: &[u8]) -> Result<M, MessageError> {
    serde_json::from_slice(message)
        .map_err(|error| MessageError::Encoding { encoding: "JSON", reason: error.to_string() })
}

fn base64(text: &str) -> Result<Vec<u8>, MessageError> {
    STANDARD.decode(text).map_err(|error| MessageError::field("data", format!("is no Base64: {error}")))
}

fn header(time: Time, frame: &str) -> Header {
    Header { stamp: Stamp::new(time.sec, time.nsec), frame: frame_name(frame) }
}

fn transform(found: &FrameTransform) -> Result<StampedTransform, MessageError> {
    let Vector { x, y, z } = found.translation;
    let rotation = [found.rotation.x, found.rotation.y, found.rotation.z, found.rotation.w];
    Ok(StampedTransform {
        stamp: Stamp::new(found.timestamp.sec, found.timestamp.nsec),
        parent: frame_name(&found.parent_frame_id),
        child: frame_name(&found.child_frame_id),
        parent_from_child: isometry([x, y, z], rotation)?,
    })
}
