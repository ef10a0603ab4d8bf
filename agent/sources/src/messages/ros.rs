//! Messages of ROS 1 and ROS 2. Their types have the same fields in the same order, but for a number in front of ROS 1's
//! headers; only how a field is written differs (`fields`).

use super::error::MessageError;
use super::fields::Fields;
use super::point_cloud::{PointCloud, PointField};
use super::types::{Calibration, Header, JointStates, StampedTransform, frame_name, isometry};
use super::{CompressedPicture, Kind, Parsed, RawPicture};

/// Bytes of the smallest transform of a list: three texts that are empty and seven numbers.
const LEAST_TRANSFORM: usize = 8 + 4 + 4 + 7 * 8;

/// The message of type `kind` that `fields` hold.
pub(crate) fn parse(kind: Kind, mut fields: Fields<'_>) -> Result<Parsed<'_>, MessageError> {
    let fields = &mut fields;
    Ok(match kind {
        Kind::Image => {
            let header = header(fields)?;
            let (height, width) = (fields.u32("height")?, fields.u32("width")?);
            let encoding = fields.text("encoding")?.into();
            let big_endian = fields.u8("is_bigendian")? != 0;
            let step = fields.u32("step")?;
            let data = fields.bytes("data")?.into();
            Parsed::Raw(RawPicture { header, width, height, encoding, big_endian, step, data })
        }
        Kind::CompressedImage => {
            let header = header(fields)?;
            let format = fields.text("format")?.into();
            Parsed::Compressed(CompressedPicture { header, format, data: fields.bytes("data")?.into() })
        }
        Kind::Calibration => {
            let header = header(fields)?;
            let (height, width) = (fields.u32("height")?, fields.u32("width")?);
            let distortion_model = fields.text("distortion_model")?.to_owned();
            let distortion = fields.f64_sequence("d")?;
            let k = fields.f64_array("k")?;
            let _rectification: [f64; 9] = fields.f64_array("r")?;
            let p = fields.f64_array("p")?;
            Parsed::Calibration(Calibration { header, width, height, distortion_model, distortion, k, p })
        }
        Kind::Transforms => {
            let count = fields.count(LEAST_TRANSFORM, "transforms")?;
            Parsed::Transforms((0..count).map(|_| transform(fields)).collect::<Result<_, _>>()?)
        }
        Kind::Transform => Parsed::Transforms(vec![transform(fields)?]),
        Kind::JointStates => {
            let header = header(fields)?;
            let count = fields.count(4, "name")?;
            let names = (0..count).map(|_| fields.text("name").map(str::to_owned)).collect::<Result<Vec<_>, _>>()?;
            let positions = fields.f64_sequence("position")?;
            if !positions.is_empty() && positions.len() != names.len() {
                let reason = format!("has {} values for {} joints", positions.len(), names.len());
                return Err(MessageError::field("position", reason));
            }
            let positions = names.into_iter().zip(positions).collect();
            Parsed::Joints(JointStates { stamp: header.stamp, positions })
        }
        Kind::PointCloud => {
            let header = header(fields)?;
            let (height, width) = (fields.u32("height")?, fields.u32("width")?);
            let count = fields.count(13, "fields")?;
            let point_fields = (0..count).map(|_| point_field(fields)).collect::<Result<_, _>>()?;
            let big_endian = fields.u8("is_bigendian")? != 0;
            let (point_step, row_step) = (fields.u32("point_step")?, fields.u32("row_step")?);
            let data = fields.bytes("data")?;
            let cloud =
                PointCloud { header, width, height, fields: point_fields, big_endian, point_step, row_step, data };
            Parsed::Cloud(cloud)
        }
        Kind::Text => Parsed::Text(fields.text("data")?.to_owned()),
    })
}

fn header(fields: &mut Fields<'_>) -> Result<Header, MessageError> {
    if fields.is_packed() {
        fields.u32("header.seq")?;
    }
    let stamp = fields.stamp("header.stamp")?;
    Ok(Header { stamp, frame: frame_name(fields.text("header.frame_id")?) })
}

fn transform(fields: &mut Fields<'_>) -> Result<StampedTransform, MessageError> {
    let Header { stamp, frame: parent } = header(fields)?;
    let child = frame_name(fields.text("child_frame_id")?);
    let translation = fields.f64_array("translation")?;
    let parent_from_child = isometry(translation, fields.f64_array("rotation")?)?;
    Ok(StampedTransform { stamp, parent, child, parent_from_child })
}

fn point_field<'a>(fields: &mut Fields<'a>) -> Result<PointField<'a>, MessageError> {
    let name = fields.text("fields.name")?;
    let offset = fields.u32("fields.offset")?;
    let datatype = fields.u8("fields.datatype")?;
    fields.u32("fields.count")?;
    Ok(PointField { name, offset, datatype })
}
