//! LAS and LAZ, the exchange format of surveying (ASPRS): a point cloud, plain or compressed. Read only.
//!
//! Coordinates are in the unit of the file's map, which is not read: it is asked for, as of other files without a unit. Points that
//! are marked as withheld are deleted ones. Classes are those of landscapes, and mean nothing here.

use crate::ReadError;
use crate::geometry::{Geometry, MAX_VERTICES, linear};
use ::las::{Header, PointDataBuilder, Reader};
use std::io::Cursor;

/// The first bytes.
const MAGIC: &[u8] = b"LASF";
/// Points that are unpacked at once.
const PIECE: u64 = 1 << 16;
/// Most points of a file a byte of it: a compressed point takes more than this, but where neighbours are alike.
const POINTS_A_BYTE: u64 = 64;

/// Reads a file; `name` is for messages.
///
/// # Errors
/// [`ReadError::Format`] naming what is wrong.
pub fn read(name: &str, bytes: &[u8]) -> Result<Geometry, ReadError> {
    cloud(bytes).map_err(|reason| ReadError::Format { file: name.to_owned(), reason: format!("LAS: {reason}") })
}

fn cloud(bytes: &[u8]) -> Result<Geometry, String> {
    if !bytes.starts_with(MAGIC) {
        return Err("does not begin as such a file".to_owned());
    }
    check_chunks(bytes)?;
    let failed = |error: ::las::Error| error.to_string();
    let mut file = Reader::new(Cursor::new(bytes.to_vec())).map_err(failed)?;
    check_count(file.header(), bytes.len())?;
    let has_colors = file.header().point_format().has_color;
    let (mut geometry, mut colors, mut withheld) = (Geometry::default(), Vec::new(), 0_u64);
    let mut piece = PointDataBuilder::new().for_header(file.header()).build();
    while file.fill_points(PIECE, &mut piece).map_err(failed)? > 0 {
        for point in piece.points() {
            let point = point.map_err(failed)?;
            if point.is_withheld {
                withheld += 1;
                continue;
            }
            geometry.positions.push([point.x, point.y, point.z]);
            if has_colors {
                colors.push(point.color.map_or([0; 3], |color| [color.red, color.green, color.blue]));
            }
        }
    }
    if geometry.positions.is_empty() {
        return Err("there is no point in it".to_owned());
    }
    // The format has 16 bits; many writers fill eight of them.
    let brightest = colors.iter().flatten().copied().max().unwrap_or(0);
    let white = if brightest > 255 { 65535.0 } else { 255.0 };
    geometry.colors = colors.iter().map(|color| linear(color.map(|c| f32::from(c) / white))).collect();
    if withheld > 0 {
        geometry.warnings.push(format!("{withheld} points are marked as withheld and left out"));
    }
    Ok(geometry)
}

/// Refuses a table of compressed pieces that asks for more memory than there is file.
fn check_chunks(bytes: &[u8]) -> Result<(), String> {
    let number =
        |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk::<4>()).map_or(0, |b| u32::from_le_bytes(*b));
    // The highest bits of the point format say that points are compressed; they begin with the table's place, or end with it.
    let is_compressed = bytes.get(104).is_some_and(|format| format & 0xC0 != 0);
    let start = number(96) as usize;
    if !is_compressed || bytes.len() < start.saturating_add(8) {
        return Ok(());
    }
    let place =
        |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()).map_or(-1, |b| i64::from_le_bytes(*b));
    let at_start = place(start);
    let table = if at_start == -1 { place(bytes.len() - 8) } else { at_start };
    let chunks = usize::try_from(table).ok().and_then(|table| table.checked_add(4)).map_or(0, number);
    if chunks as usize > bytes.len() {
        return Err(format!("says that it holds {chunks} pieces in {} bytes", bytes.len()));
    }
    Ok(())
}

/// Refuses more points than a file of this length holds.
fn check_count(header: &Header, length: usize) -> Result<(), String> {
    let count = header.number_of_points();
    let most = (MAX_VERTICES as u64).min(length as u64 * POINTS_A_BYTE);
    if count > most { Err(format!("says that it holds {count} points; {most} are the most")) } else { Ok(()) }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use ::las::point::Format;
    use ::las::{Builder, Color, Point, Transform, Vector, Writer};
    use proptest::prelude::*;

    /// Points with their colours in 16 bits and whether they are withheld, to a tenth of a millimetre.
    fn file(points: &[([f64; 3], [u16; 3], bool)], is_compressed: bool) -> Vec<u8> {
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format::new(2).expect("a format with colours");
        builder.point_format.is_compressed = is_compressed;
        let transform = Transform { scale: 1e-4, offset: 0.0 };
        builder.transforms = Vector { x: transform, y: transform, z: transform };
        let mut writer =
            Writer::new(Cursor::new(Vec::new()), builder.into_header().expect("a header")).expect("a writer");
        for (position, [red, green, blue], is_withheld) in points {
            let [x, y, z] = *position;
            let color = Some(Color { red: *red, green: *green, blue: *blue });
            writer
                .write_point(Point { x, y, z, color, is_withheld: *is_withheld, ..Point::default() })
                .expect("a point");
        }
        writer.into_inner().expect("written").into_inner()
    }

    #[test]
    fn points_are_read_plain_and_compressed_and_withheld_ones_are_left_out() {
        let points = [
            ([1.25, -2.5, 300.0], [65535, 0, 0], false),
            ([0.0, 0.0, 0.0], [1, 2, 3], true),
            ([0.5, 0.25, 0.125], [0, 65535, 0], false),
        ];
        for is_compressed in [false, true] {
            let geometry = read("field.laz", &file(&points, is_compressed)).expect("points");
            assert_eq!((geometry.unit, geometry.positions.len()), (None, 2), "its unit is asked for");
            for (found, expected) in geometry.positions.iter().zip([[1.25, -2.5, 300.0], [0.5, 0.25, 0.125]]) {
                assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
            }
            assert_eq!(geometry.colors, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
            assert_eq!(geometry.warnings, ["1 points are marked as withheld and left out"]);
        }
        let dim = read("dim.las", &file(&[([0.0; 3], [255, 0, 0], false)], false)).expect("a point");
        assert_eq!(dim.colors, [[1.0, 0.0, 0.0]], "eight bits in sixteen");
    }

    #[test]
    fn what_is_none_or_cut_or_empty_is_refused_by_name() {
        let whole = file(&[([0.0; 3], [1; 3], false); 100], false);
        let said = |bytes: &[u8]| read("field.las", bytes).expect_err("refused").to_string();
        assert!(said(b"LAZ?").contains("field.las") && said(b"LAZ?").contains("does not begin"));
        assert!(!said(&whole[..whole.len() - 100]).is_empty());
        assert!(said(&file(&[], false)).contains("no point"));
    }

    proptest! {
        #[test]
        fn broken_bytes_never_panic(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), end in any::<prop::sample::Index>()) {
            for is_compressed in [false, true] {
                let mut bytes = file(&[([0.5; 3], [1, 2, 3], false); 60], is_compressed);
                for (at, value) in &flips {
                    let at = at.index(bytes.len());
                    bytes[at] = *value;
                }
                let length = end.index(bytes.len());
                let _ = read("x.laz", &bytes);
                let _ = read("x.laz", &bytes[..length]);
            }
        }
    }
}
