//! `sensor_msgs/PointCloud2`: points as records whose fields the message names.

use super::Message;
use super::error::MessageError;
use super::types::{CloudPicture, Header};

/// The number of the type of single-precision numbers.
const FLOAT32: u8 = 7;
/// The number of the type of double-precision numbers.
const FLOAT64: u8 = 8;
/// Bytes of a packed colour.
const PACKED_COLOR: usize = 4;

/// A cloud as its message has it.
#[derive(Clone, Debug)]
pub(crate) struct PointCloud<'a> {
    pub(crate) header: Header,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) fields: Vec<PointField<'a>>,
    pub(crate) big_endian: bool,
    pub(crate) point_step: u32,
    pub(crate) row_step: u32,
    pub(crate) data: &'a [u8],
}

/// A field of each point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PointField<'a> {
    pub(crate) name: &'a str,
    /// Byte of the point's record at which it begins.
    pub(crate) offset: u32,
    pub(crate) datatype: u8,
}

impl PointCloud<'_> {
    /// The points. The memory that they take is at most five times that of the message.
    pub(crate) fn decode(self) -> Result<Message, MessageError> {
        let Self { width, height, big_endian, .. } = self;
        let point_step = self.point_step as usize;
        let row = (width as usize).saturating_mul(point_step);
        let row_step = if self.row_step == 0 { row } else { self.row_step as usize };
        let last = row_step.saturating_mul((height as usize).saturating_sub(1));
        let is_empty = point_step == 0 || width == 0 || height == 0;
        if is_empty || row_step < row || last.saturating_add(row) > self.data.len() {
            let reason = format!("has {} bytes for {width} x {height} points of {point_step}", self.data.len());
            return Err(MessageError::field("data", reason));
        }
        let coordinates = [self.coordinate("x")?, self.coordinate("y")?, self.coordinate("z")?];
        let color = self.color()?;
        let count = width as usize * height as usize;
        let mut positions = Vec::with_capacity(count);
        let mut colors = Vec::with_capacity(if color.is_some() { count } else { 0 });
        for bytes in self.data.chunks(row_step).take(height as usize) {
            for point in bytes.chunks_exact(point_step).take(width as usize) {
                positions.push(coordinates.map(|coordinate| coordinate.read(point, big_endian)));
                if let Some(at) = color {
                    colors.push(packed_color(point, at, big_endian));
                }
            }
        }
        let colors = color.map(|_| colors);
        Ok(Message::Cloud(CloudPicture { header: self.header, width, height, positions, colors }))
    }

    fn coordinate(&self, name: &'static str) -> Result<Coordinate, MessageError> {
        let found = self.fields.iter().find(|field| field.name == name);
        let field = found.ok_or_else(|| MessageError::field("fields", format!("{name} is not among them")))?;
        let double = match field.datatype {
            FLOAT32 => false,
            FLOAT64 => true,
            other => {
                let reason = format!("{name} is of type {other}; 7 (float) and 8 (double) are read");
                return Err(MessageError::field("fields", reason));
            }
        };
        let coordinate = Coordinate { at: field.offset as usize, double };
        self.check_inside(coordinate.at, if double { 8 } else { 4 }, name)?;
        Ok(coordinate)
    }

    /// Where each point's colour is, `0x00RRGGBB`, in a field that is called a float for historical reasons.
    fn color(&self) -> Result<Option<usize>, MessageError> {
        let Some(field) = self.fields.iter().find(|field| ["rgb", "rgba"].contains(&field.name)) else {
            return Ok(None);
        };
        let at = field.offset as usize;
        self.check_inside(at, PACKED_COLOR, "rgb")?;
        Ok(Some(at))
    }

    fn check_inside(&self, at: usize, size: usize, name: &str) -> Result<(), MessageError> {
        if at.saturating_add(size) <= self.point_step as usize {
            return Ok(());
        }
        Err(MessageError::field("fields", format!("{name} reaches beyond the point's {} bytes", self.point_step)))
    }
}

/// Where a coordinate is within a point's record.
#[derive(Clone, Copy, Debug)]
struct Coordinate {
    at: usize,
    double: bool,
}

impl Coordinate {
    /// The coordinate of a point; NaN past the end, which was ruled out.
    fn read(self, point: &[u8], big_endian: bool) -> f32 {
        let bytes = point.get(self.at..).unwrap_or_default();
        if self.double {
            let Some((bytes, _)) = bytes.split_first_chunk::<8>() else { return f32::NAN };
            return if big_endian { f64::from_be_bytes(*bytes) } else { f64::from_le_bytes(*bytes) } as f32;
        }
        let Some((bytes, _)) = bytes.split_first_chunk::<4>() else { return f32::NAN };
        if big_endian { f32::from_be_bytes(*bytes) } else { f32::from_le_bytes(*bytes) }
    }
}

fn packed_color(point: &[u8], at: usize, big_endian: bool) -> [u8; 3] {
    match point.get(at..at + PACKED_COLOR) {
        Some(&[_, r, g, b]) if big_endian => [r, g, b],
        Some(&[b, g, r, _]) => [r, g, b],
        _ => [0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(data: &[u8], point_step: u32) -> PointCloud<'_> {
        let field = |name, offset, datatype| PointField { name, offset, datatype };
        PointCloud {
            header: Header::default(),
            width: 2,
            height: 1,
            fields: vec![field("x", 0, 7), field("y", 4, 7), field("z", 8, 7), field("rgb", 12, 7)],
            big_endian: false,
            point_step,
            row_step: 0,
            data,
        }
    }

    #[test]
    fn points_and_their_colours_are_read() {
        let mut data = Vec::new();
        for (point, color) in [([1.0_f32, 2.0, 3.0], 0x00c8_0a14_u32), ([f32::NAN; 3], 0)] {
            data.extend(point.iter().flat_map(|c| c.to_le_bytes()));
            data.extend(color.to_le_bytes());
        }
        match cloud(&data, 16).decode().expect("a cloud") {
            Message::Cloud(cloud) => {
                assert_eq!(cloud.positions[0], [1.0, 2.0, 3.0]);
                assert!(cloud.positions[1][2].is_nan());
                assert_eq!(cloud.colors.expect("colours")[0], [200, 10, 20]);
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_reaches_beyond_the_data_is_refused() {
        assert!(cloud(&[0; 31], 16).decode().is_err());
        assert!(cloud(&[0; 64], 12).decode().expect_err("rgb").to_string().contains("rgb"));
        assert!(cloud(&[0; 64], 0).decode().is_err());
        let far = PointCloud { width: u32::MAX, height: u32::MAX, ..cloud(&[0; 64], 16) };
        assert!(far.decode().is_err());
        let mut bare = cloud(&[0; 64], 16);
        bare.fields.truncate(2);
        assert!(bare.decode().expect_err("no z").to_string().contains('z'));
    }
}
