//! Point clouds: the last one of each topic, in the frame that is shown.

use crate::frames::{Frames, pose};
use glam::{DVec3, Vec3};
use semascan_foxglove_schema::PointCloud;
use semascan_foxglove_schema::packed_element_field::NumericType;
use semascan_model::{SemanticCloud, SemanticPoint};
use std::collections::BTreeMap;

/// Points whose distance to the next one is measured.
const PROBES: usize = 400;
/// Points among which the next one is looked for.
const AMONG: usize = 2_000_000;

/// The last point cloud of each topic.
#[derive(Debug, Default)]
pub(crate) struct Clouds {
    last: BTreeMap<String, PointCloud>,
}

impl Clouds {
    /// A cloud has come.
    pub(crate) fn take(&mut self, topic: &str, cloud: PointCloud) {
        self.last.insert(topic.to_owned(), cloud);
    }

    /// The points of all topics.
    pub(crate) fn cloud(&self, frames: &Frames) -> SemanticCloud {
        self.last.values().flat_map(|cloud| points(cloud, frames)).collect()
    }
}

/// The points of a message that have a place. A frame that no transform names is shown as it is.
fn points(message: &PointCloud, frames: &Frames) -> Vec<SemanticPoint> {
    let Some(frame_from_points) = pose(message.pose.as_ref()) else { return Vec::new() };
    let shown = frames.shown_from(&message.frame_id).unwrap_or_default() * frame_from_points;
    let column = |name: &str| {
        let field = message.fields.iter().find(|field| field.name == name)?;
        Some((field.offset as usize, field.r#type()))
    };
    let [x, y, z] = ["x", "y", "z"].map(column);
    let [red, green, blue] = ["red", "green", "blue"].map(column);
    let [component, defect, instance, views] = ["component", "defect", "instance", "views"].map(column);
    let [confidence, sigma] = ["confidence", "sigma"].map(column);
    let stride = message.point_stride as usize;
    if stride == 0 {
        return Vec::new();
    }
    let read = |point: &[u8]| {
        let number =
            |column: Option<(usize, NumericType)>| column.and_then(|(at, kind)| number(point.get(at..)?, kind));
        let place = DVec3::new(number(x)?, number(y)?, number(z)?);
        let place = Some(shown.transform_point3(place)).filter(|place| place.is_finite())?;
        let known = SemanticPoint::UNKNOWN;
        let byte = |column, unknown: u8| number(column).map_or(unknown, |value| value.clamp(0.0, 255.0) as u8);
        let whole = |column, unknown: u16| number(column).map_or(unknown, |value| value.clamp(0.0, 65535.0) as u16);
        Some(SemanticPoint {
            position: place.as_vec3().to_array(),
            color: [byte(red, 0xb4), byte(green, 0xb8), byte(blue, 0xbe)],
            label: whole(component, known.label),
            defect: whole(defect, known.defect),
            instance: whole(instance, known.instance),
            views: whole(views, known.views),
            confidence: number(confidence).map_or(known.confidence, |value| value.clamp(0.0, 1.0) as f32),
            sigma: number(sigma).map_or(known.sigma, |value| value as f32),
            ..known
        })
    };
    message.data.chunks_exact(stride).filter_map(read).collect()
}

/// The number at the start of `bytes`.
fn number(bytes: &[u8], kind: NumericType) -> Option<f64> {
    Some(match kind {
        NumericType::Unknown => return None,
        NumericType::Uint8 => f64::from(*bytes.first()?),
        NumericType::Int8 => f64::from(*bytes.first()? as i8),
        NumericType::Uint16 => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
        NumericType::Int16 => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
        NumericType::Uint32 => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
        NumericType::Int32 => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
        NumericType::Float32 => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
        NumericType::Float64 => f64::from_le_bytes(*bytes.first_chunk()?),
    })
}

/// Median distance of a point to the next one, metres; `None` of fewer than two.
pub(crate) fn spacing(cloud: &SemanticCloud) -> Option<f32> {
    let positions = &cloud.positions;
    let among = positions.len().div_ceil(AMONG).max(1);
    let nearest = |probe: usize| {
        let own = Vec3::from(positions[probe]);
        let others = positions.iter().enumerate().step_by(among).filter(|(other, _)| *other != probe);
        others.map(|(_, p)| own.distance_squared(Vec3::from(*p))).filter(|d| *d > 0.0).reduce(f32::min)
    };
    let step = positions.len().div_ceil(PROBES).max(1);
    let mut distances: Vec<f32> = (0..positions.len()).step_by(step).filter_map(nearest).collect();
    distances.sort_by(f32::total_cmp);
    distances.get(distances.len() / 2).map(|squared| squared.sqrt())
}
