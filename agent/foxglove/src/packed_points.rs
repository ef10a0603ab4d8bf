//! Points packed as `foxglove.PointCloud` has them: one after the other, each with the same fields.

use crate::TABLE;
use crate::schema::packed_element_field::NumericType;
use crate::schema::{PackedElementField, PointCloud};
use prost_types::Timestamp;
use semascan_model::{PointFlags, SemanticCloud};

/// Bytes of a point.
pub(crate) const STRIDE: usize = 32;

/// Names, places in a point, and types of its fields. The colour is read from the fields of these names.
const FIELDS: [(&str, u32, NumericType); 13] = [
    ("x", 0, NumericType::Float32),
    ("y", 4, NumericType::Float32),
    ("z", 8, NumericType::Float32),
    ("red", 12, NumericType::Uint8),
    ("green", 13, NumericType::Uint8),
    ("blue", 14, NumericType::Uint8),
    ("alpha", 15, NumericType::Uint8),
    ("component", 16, NumericType::Uint16),
    ("defect", 18, NumericType::Uint16),
    ("confidence", 20, NumericType::Float32),
    ("sigma", 24, NumericType::Float32),
    ("views", 28, NumericType::Uint16),
    ("instance", 30, NumericType::Uint16),
];

/// The points of `cloud`, but for those that are kept out of meshes and scenes.
pub(crate) fn pack(cloud: &SemanticCloud) -> Vec<u8> {
    let kept = cloud.iter().filter(|point| !point.flags.has(PointFlags::LEFT_OUT));
    let mut bytes = Vec::with_capacity(cloud.len() * STRIDE);
    for point in kept {
        point.position.iter().for_each(|metres| bytes.extend(metres.to_le_bytes()));
        bytes.extend(point.color);
        bytes.push(u8::MAX);
        bytes.extend(point.label.to_le_bytes());
        bytes.extend(point.defect.to_le_bytes());
        bytes.extend(point.confidence.to_le_bytes());
        bytes.extend(point.sigma.to_le_bytes());
        bytes.extend(point.views.to_le_bytes());
        bytes.extend(point.instance.to_le_bytes());
    }
    bytes
}

/// The cloud of packed points.
pub(crate) fn cloud(timestamp: Timestamp, data: Vec<u8>) -> PointCloud {
    let field = |(name, offset, kind): (&str, u32, NumericType)| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: kind.into(),
    };
    PointCloud {
        timestamp: Some(timestamp),
        frame_id: TABLE.to_owned(),
        pose: Some(crate::drawing::identity()),
        point_stride: STRIDE as u32,
        fields: FIELDS.into_iter().map(field).collect(),
        data,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    #[test]
    fn a_point_has_its_numbers_where_the_fields_say_and_outliers_are_left_out() {
        let point = SemanticPoint {
            position: [1.0, -2.0, 0.5],
            color: [1, 2, 3],
            label: 4,
            defect: 2,
            confidence: 0.75,
            sigma: 0.125,
            views: 9,
            instance: 3,
            ..SemanticPoint::UNKNOWN
        };
        let outlier = SemanticPoint { flags: PointFlags(PointFlags::NOISE), ..point };
        let bytes = pack(&[point, outlier].into_iter().collect());
        assert_eq!(bytes.len(), STRIDE);
        let number = |name: &str| {
            let (_, offset, kind) = FIELDS.into_iter().find(|field| field.0 == name).expect("a field");
            let at = &bytes[offset as usize..];
            match kind {
                NumericType::Uint8 => f32::from(at[0]),
                NumericType::Uint16 => f32::from(u16::from_le_bytes([at[0], at[1]])),
                _ => f32::from_le_bytes([at[0], at[1], at[2], at[3]]),
            }
        };
        let names =
            ["x", "y", "z", "red", "blue", "alpha", "component", "defect", "confidence", "sigma", "views", "instance"];
        let values = [1.0, -2.0, 0.5, 1.0, 3.0, 255.0, 4.0, 2.0, 0.75, 0.125, 9.0, 3.0];
        assert_eq!(names.map(number), values);
    }
}
