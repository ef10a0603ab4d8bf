//! E57, the exchange format of laser scanners (ASTM E2807): all scans of a file as one cloud, each at its pose. Read only.
//!
//! Lengths are metres, as the standard has it. Spherical coordinates become Cartesian ones; what is marked invalid, or is only a
//! direction, was not measured and is left out, which is said. The scanners' pictures are not read.

use crate::ReadError;
use crate::geometry::{Geometry, MAX_VERTICES, linear};
use ::e57::{CartesianCoordinate, E57Reader, PointCloud};
use semascan_model::LengthUnit;
use std::io::Cursor;

/// The first bytes.
const MAGIC: &[u8] = b"ASTM-E57";
/// Bytes of a file's head.
const HEAD: usize = 48;
/// Most scans of a file.
const MOST_SCANS: usize = 10_000;

/// Reads a file; `name` is for messages.
///
/// # Errors
/// [`ReadError::Format`] naming what is wrong.
pub fn read(name: &str, bytes: &[u8]) -> Result<Geometry, ReadError> {
    cloud(bytes).map_err(|reason| ReadError::Format { file: name.to_owned(), reason: format!("E57: {reason}") })
}

fn cloud(bytes: &[u8]) -> Result<Geometry, String> {
    check_head(bytes)?;
    let mut file = E57Reader::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let scans = file.pointclouds();
    if scans.len() > MOST_SCANS {
        return Err(format!("holds {} scans; {MOST_SCANS} are the most", scans.len()));
    }
    check_counts(&scans, bytes.len())?;
    let has_colors = !scans.is_empty() && scans.iter().all(PointCloud::has_color);
    let mut geometry = Geometry { unit: Some(LengthUnit::Metres), ..Geometry::default() };
    let (mut unmeasured, mut colorless) = (0_u64, 0_u64);
    for (place, scan) in scans.iter().enumerate() {
        let failed = |error: ::e57::Error| format!("scan {place}: {error}");
        let mut points = file.pointcloud_simple(scan).map_err(failed)?;
        points.spherical_to_cartesian(true);
        points.apply_pose(true);
        points.normalize_color(true);
        for point in points {
            let point = point.map_err(failed)?;
            let CartesianCoordinate::Valid { x, y, z } = point.cartesian else {
                unmeasured += 1;
                continue;
            };
            geometry.positions.push([x, y, z]);
            if has_colors {
                colorless += u64::from(point.color.is_none());
                let color = point.color.map_or([0.5; 3], |color| [color.red, color.green, color.blue]);
                geometry.colors.push(linear(color));
            }
        }
    }
    if geometry.positions.is_empty() {
        return Err(format!("no point in {} scans", scans.len()));
    }
    if unmeasured > 0 {
        geometry.warnings.push(format!("{unmeasured} points were not measured and are left out"));
    }
    if colorless > 0 {
        geometry.warnings.push(format!("{colorless} points have no colour and are grey"));
    }
    Ok(geometry)
}

/// Refuses a head that asks for more memory than there is file.
fn check_head(bytes: &[u8]) -> Result<(), String> {
    if bytes.len() < HEAD || !bytes.starts_with(MAGIC) {
        return Err("does not begin as such a file".to_owned());
    }
    let number =
        |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()).map_or(0, |b| u64::from_le_bytes(*b));
    let (length, xml) = (number(16), number(32));
    if length > bytes.len() as u64 {
        return Err(format!("is cut off: {} of {length} bytes", bytes.len()));
    }
    if xml > bytes.len() as u64 {
        return Err(format!("its head says {xml} bytes of XML, of {} in all", bytes.len()));
    }
    Ok(())
}

/// Refuses more points than a file of this length holds: each takes a bit at least.
fn check_counts(scans: &[PointCloud], length: usize) -> Result<(), String> {
    let mut all = 0_u64;
    for scan in scans {
        all = all.saturating_add(scan.records);
    }
    let most = (MAX_VERTICES as u64).min(length as u64 * 8);
    if all > most { Err(format!("says that it holds {all} points; {most} are the most")) } else { Ok(()) }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use ::e57::{E57Writer, Quaternion, Record, RecordValue, Transform, Translation};
    use proptest::prelude::*;

    /// The place of a scan, and its points with their colours (0 to 255).
    type Scan<'a> = ([f64; 3], &'a [([f32; 3], [i64; 3])]);

    /// A file with these scans.
    fn file(scans: &[Scan<'_>]) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut out, "file").expect("a writer");
        for (place, points) in scans {
            let prototype = vec![
                Record::CARTESIAN_X_F32,
                Record::CARTESIAN_Y_F32,
                Record::CARTESIAN_Z_F32,
                Record::COLOR_RED_U8,
                Record::COLOR_GREEN_U8,
                Record::COLOR_BLUE_U8,
            ];
            let mut scan = writer.add_pointcloud("scan", prototype).expect("a scan");
            scan.set_transform(Some(Transform {
                rotation: Quaternion { w: 0.0, x: 0.0, y: 0.0, z: 1.0 },
                translation: Translation { x: place[0], y: place[1], z: place[2] },
            }));
            for (position, color) in *points {
                let mut values: Vec<RecordValue> = position.iter().map(|c| RecordValue::Single(*c)).collect();
                values.extend(color.iter().map(|c| RecordValue::Integer(*c)));
                scan.add_point(values).expect("a point");
            }
            scan.finalize().expect("a scan");
        }
        writer.finalize().expect("written");
        drop(writer);
        out.into_inner()
    }

    #[test]
    fn scans_are_one_cloud_each_at_its_pose() {
        // Half a turn about z, then the place.
        let bytes = file(&[
            ([1.0, 0.0, 0.0], &[([0.25, 0.5, 2.0], [255, 0, 0]), ([0.0, 0.0, 0.0], [0, 255, 0])]),
            ([0.0, 0.0, 5.0], &[([1.0, 0.0, 0.0], [0, 0, 0])]),
        ]);
        let geometry = read("hall.e57", &bytes).expect("scans");
        assert_eq!(geometry.unit, Some(LengthUnit::Metres));
        assert_eq!(geometry.positions, [[0.75, -0.5, 2.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 5.0]]);
        assert_eq!(geometry.colors, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]);
        assert!(geometry.triangles.is_empty() && geometry.warnings.is_empty(), "{:?}", geometry.warnings);
    }

    #[test]
    fn what_is_none_or_cut_or_empty_is_refused_by_name() {
        let whole = file(&[([0.0; 3], &[([0.0; 3], [1, 2, 3]); 100])]);
        let said = |bytes: &[u8]| read("hall.e57", bytes).expect_err("refused").to_string();
        assert!(said(b"ASTM").contains("hall.e57") && said(b"ASTM").contains("does not begin"));
        assert!(said(&whole[..whole.len() - 100]).contains("cut off"));
        assert!(said(&file(&[])).contains("no point"));
    }

    proptest! {
        #[test]
        fn broken_bytes_never_panic(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), end in any::<prop::sample::Index>()) {
            let mut bytes = file(&[([0.0; 3], &[([0.5; 3], [1, 2, 3]); 40])]);
            for (at, value) in flips {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            let length = end.index(bytes.len());
            let _ = read("x.e57", &bytes);
            let _ = read("x.e57", &bytes[..length]);
        }
    }
}
