//! Messages of Foxglove's schemas as Protocol Buffers (<https://docs.foxglove.dev/docs/visualization/message-schemas>), which
//! `semascan-foxglove` generates.

use super::error::MessageError;
use super::types::{Calibration, Header, Stamp, StampedTransform, frame_name, isometry};
use super::{CompressedPicture, Kind, Parsed, RawPicture};
use prost::Message;
use prost_types::Timestamp;
use semascan_foxglove::schema::{CameraCalibration, CompressedImage, FrameTransform, FrameTransforms, RawImage};

/// The message of type `kind`.
pub(crate) fn parse(kind: Kind, message: &[u8]) -> Result<Parsed<'static>, MessageError> {
    Ok(match kind {
        Kind::Image => {
            let RawImage { timestamp, frame_id, width, height, encoding, step, data } = decode(message)?;
            Parsed::Raw(RawPicture {
                header: header(timestamp, &frame_id),
                width,
                height,
                encoding: encoding.into(),
                big_endian: false,
                step,
                data: data.into(),
            })
        }
        Kind::CompressedImage => {
            let CompressedImage { timestamp, data, format, frame_id } = decode(message)?;
            let header = header(timestamp, &frame_id);
            Parsed::Compressed(CompressedPicture { header, format: format.into(), data: data.into() })
        }
        Kind::Calibration => {
            let found: CameraCalibration = decode(message)?;
            let header = header(found.timestamp, &found.frame_id);
            Parsed::Calibration(calibration(
                header,
                (found.width, found.height),
                found.distortion_model,
                found.d,
                &found.k,
                &found.p,
            )?)
        }
        Kind::Transforms => {
            let found: FrameTransforms = decode(message)?;
            Parsed::Transforms(found.transforms.into_iter().map(transform).collect::<Result<_, _>>()?)
        }
        Kind::Transform => Parsed::Transforms(vec![transform(decode(message)?)?]),
        Kind::JointStates | Kind::PointCloud | Kind::Text => {
            let reason = "Foxglove has no such schema".to_owned();
            return Err(MessageError::Encoding { encoding: "Protocol Buffers", reason });
        }
    })
}

fn decode<M: Message + Default>(message: &[u8]) -> Result<M, MessageError> {
    M::decode(message)
        .map_err(|error| MessageError::Encoding { encoding: "Protocol Buffers", reason: error.to_string() })
}

fn stamp(timestamp: Option<Timestamp>) -> Stamp {
    timestamp.map_or(Stamp::default(), |time| Stamp::new(time.seconds, u32::try_from(time.nanos).unwrap_or(0)))
}

fn header(timestamp: Option<Timestamp>, frame: &str) -> Header {
    Header { stamp: stamp(timestamp), frame: frame_name(frame) }
}

/// A calibration from its lists, whose lengths only the schema's comments say; P may be left out.
pub(super) fn calibration(
    header: Header,
    (width, height): (u32, u32),
    distortion_model: String,
    distortion: Vec<f64>,
    k: &[f64],
    p: &[f64],
) -> Result<Calibration, MessageError> {
    let k = k.try_into().map_err(|_| MessageError::field("K", format!("has {} values for 9", k.len())))?;
    let p = match p {
        [] => [0.0; 12],
        p => p.try_into().map_err(|_| MessageError::field("P", format!("has {} values for 12", p.len())))?,
    };
    Ok(Calibration { header, width, height, distortion_model, distortion, k, p })
}

fn transform(found: FrameTransform) -> Result<StampedTransform, MessageError> {
    let translation = found.translation.ok_or_else(|| MessageError::field("translation", "is missing"))?;
    let rotation = found.rotation.ok_or_else(|| MessageError::field("rotation", "is missing"))?;
    let translation = [translation.x, translation.y, translation.z];
    Ok(StampedTransform {
        stamp: stamp(found.timestamp),
        parent: frame_name(&found.parent_frame_id),
        child: frame_name(&found.child_frame_id),
        parent_from_child: isometry(translation, [rotation.x, rotation.y, rotation.z, rotation.w])?,
    })
}
