//! What a PLY file says of the grid of its points and of the camera, beside the points themselves.
//!
//! The grid's size stands in `obj_info num_cols` and `num_rows` (Stanford's range grids, Photoneo), in comments of the same
//! words or `width` and `height`, or as `viewportx` and `viewporty` in the element `camera` of the Point Cloud Library, which
//! also has the camera's place and, row by row, its rotation. Only the header and the camera's numbers are read here.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use std::str::SplitWhitespace;

/// Most bytes of a header.
const LARGEST_HEADER: usize = 64 << 10;

/// What a file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PlyGrid {
    /// Columns and rows.
    pub(crate) size: Option<(u32, u32)>,
    /// Pose of the camera in the frame of the points, in the file's unit.
    pub(crate) viewpoint: Option<Isometry3<f64>>,
    /// Whether it has a camera, whose numbers may be past the bytes that were read.
    pub(crate) has_camera: bool,
    /// Number of points.
    pub(crate) points: usize,
    /// Number of faces: a file with faces is a model and no picture.
    pub(crate) faces: usize,
    /// Whether points have labels: such a cloud is a result and no picture.
    pub(crate) has_labels: bool,
}

/// An element of the header.
#[derive(Debug, Default)]
struct Element {
    name: String,
    count: usize,
    /// Name and bytes of each property; no bytes for a list.
    properties: Vec<(String, Option<usize>)>,
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Storage {
    Text,
    Little,
    Big,
}

impl PlyGrid {
    /// What the bytes of a file, or its first ones, say; `None` if that is no PLY file.
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let (lines, body) = header(bytes)?;
        let mut storage = Storage::Text;
        let mut elements: Vec<Element> = Vec::new();
        let (mut columns, mut rows) = (None, None);
        for line in lines {
            let mut words = line.split_whitespace();
            match words.next() {
                Some("format") => {
                    storage = match words.next() {
                        Some("binary_little_endian") => Storage::Little,
                        Some("binary_big_endian") => Storage::Big,
                        _ => Storage::Text,
                    }
                }
                Some("obj_info" | "comment") => match (words.next(), words.next().map(str::parse::<u32>)) {
                    (Some("num_cols" | "width"), Some(Ok(number))) => columns = Some(number),
                    (Some("num_rows" | "height"), Some(Ok(number))) => rows = Some(number),
                    _ => {}
                },
                Some("element") => {
                    let name = words.next().unwrap_or_default().to_owned();
                    let count = words.next().and_then(|count| count.parse().ok()).unwrap_or(0);
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                Some("property") => {
                    if let (Some(element), Some(property)) = (elements.last_mut(), property(words)) {
                        element.properties.push(property);
                    }
                }
                _ => {}
            }
        }
        let element = |name: &str| elements.iter().find(|element| element.name == name);
        let vertex = element("vertex");
        let mut grid = Self {
            size: columns.zip(rows),
            viewpoint: None,
            has_camera: element("camera").is_some_and(|camera| camera.count == 1),
            points: vertex.map_or(0, |vertex| vertex.count),
            faces: element("face").map_or(0, |face| face.count),
            has_labels: vertex.is_some_and(|vertex| vertex.properties.iter().any(|(name, _)| name == "label")),
        };
        if let Some(camera) = camera(&elements, body, storage) {
            grid.size = grid.size.or(camera.size);
            grid.viewpoint = camera.viewpoint;
        }
        // A grid of one row is what writers make of a cloud without order.
        grid.size = grid.size.filter(|(columns, rows)| {
            *columns > 1 && *rows > 1 && u64::from(*columns) * u64::from(*rows) == grid.points as u64
        });
        Some(grid)
    }
}

/// The lines of the header, and what follows it; `None` if there is none.
fn header(bytes: &[u8]) -> Option<(Vec<&str>, &[u8])> {
    let head = bytes.get(..LARGEST_HEADER).unwrap_or(bytes);
    const END: &[u8] = b"end_header";
    let end = head.windows(END.len()).position(|window| window == END)?;
    let after = end + END.len();
    let line_end = head.get(after..)?.iter().position(|b| *b == b'\n')?;
    let text = std::str::from_utf8(head.get(..end)?).ok()?;
    let is_ply = text.lines().next().is_some_and(|line| line.trim().eq_ignore_ascii_case("ply"));
    is_ply.then(|| (text.lines().collect(), bytes.get(after + line_end + 1..).unwrap_or_default()))
}

/// Name and bytes of a property.
fn property(mut words: SplitWhitespace<'_>) -> Option<(String, Option<usize>)> {
    let bytes = match words.next()? {
        "list" => None,
        "char" | "uchar" | "int8" | "uint8" => Some(1),
        "short" | "ushort" | "int16" | "uint16" => Some(2),
        "int" | "uint" | "float" | "int32" | "uint32" | "float32" => Some(4),
        "double" | "float64" | "int64" | "uint64" => Some(8),
        _ => return None,
    };
    Some((words.next_back()?.to_owned(), bytes))
}

/// The element `camera`.
struct Camera {
    size: Option<(u32, u32)>,
    viewpoint: Option<Isometry3<f64>>,
}

/// Reads the element `camera`; `None` if there is none, or lists before it hide where it is.
fn camera(elements: &[Element], body: &[u8], storage: Storage) -> Option<Camera> {
    let place = elements.iter().position(|element| element.name == "camera" && element.count == 1)?;
    let (before, camera) = (elements.get(..place)?, elements.get(place)?);
    let record = |element: &Element| element.properties.iter().map(|(_, bytes)| *bytes).sum::<Option<usize>>();
    let values: Vec<f64> = if storage == Storage::Text {
        let lines = before.iter().try_fold(0_usize, |sum, element| sum.checked_add(element.count))?;
        let text = body.split(|b| *b == b'\n').filter(|line| !line.trim_ascii().is_empty()).nth(lines)?;
        std::str::from_utf8(text).ok()?.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?
    } else {
        let mut start = 0_usize;
        for element in before {
            start = start.checked_add(element.count.checked_mul(record(element)?)?)?;
        }
        let mut rest = body.get(start..start.checked_add(record(camera)?)?)?;
        let mut values = Vec::new();
        for (name, bytes) in &camera.properties {
            let (number, after) = rest.split_at_checked((*bytes)?)?;
            rest = after;
            values.push(value(number, storage, name.starts_with("viewport")));
        }
        values
    };
    let number = |name: &str| {
        let place = camera.properties.iter().position(|(property, _)| property == name)?;
        values.get(place).copied().filter(|value| value.is_finite())
    };
    let pixels = |name: &str| number(name).filter(|n| (1.0..=65_535.0).contains(n)).map(|n| n as u32);
    let viewpoint = || {
        let rows = ["x_axisx", "x_axisy", "x_axisz", "y_axisx", "y_axisy", "y_axisz", "z_axisx", "z_axisy", "z_axisz"];
        let rows: Vec<f64> = rows.iter().map(|name| number(name)).collect::<Option<_>>()?;
        let rotation = Matrix3::from_row_slice(&rows);
        if (rotation * rotation.transpose() - Matrix3::identity()).norm() > 1e-2 || rotation.determinant() < 0.0 {
            return None;
        }
        let translation = Translation3::new(number("view_px")?, number("view_py")?, number("view_pz")?);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&rotation));
        Some(Isometry3::from_parts(translation, rotation))
    };
    Some(Camera { size: pixels("viewportx").zip(pixels("viewporty")), viewpoint: viewpoint() })
}

/// A stored number; whole ones have 4 bytes or fewer.
fn value(bytes: &[u8], storage: Storage, is_whole: bool) -> f64 {
    let mut ordered = bytes.to_vec();
    if storage == Storage::Big {
        ordered.reverse();
    }
    match (ordered.as_slice(), is_whole) {
        (&[a, b, c, d], true) => i32::from_le_bytes([a, b, c, d]).into(),
        (&[a, b, c, d], false) => f32::from_le_bytes([a, b, c, d]).into(),
        (&[a, b, c, d, e, f, g, h], _) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        (&[a, b], _) => u16::from_le_bytes([a, b]).into(),
        (&[a], _) => a.into(),
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// As the Point Cloud Library writes it.
    fn by_pcl(format: &str, columns: u32, rows: u32) -> Vec<u8> {
        let axes: String = ["x", "y", "z"]
            .iter()
            .flat_map(|axis| ["x", "y", "z"].map(|of| format!("property float {axis}_axis{of}\n")))
            .collect();
        format!(
            "ply\nformat {format} 1.0\ncomment PCL generated\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nelement camera 1\nproperty float view_px\nproperty float view_py\nproperty float view_pz\n\
             {axes}property float focal\nproperty float scalex\nproperty float scaley\nproperty float centerx\n\
             property float centery\nproperty int viewportx\nproperty int viewporty\nproperty float k1\nproperty float k2\n\
             end_header\n",
            columns * rows
        )
        .into_bytes()
    }

    #[test]
    fn grid_and_camera_of_the_point_cloud_library_are_read_in_every_format() {
        // A quarter turn about z.
        let numbers = [0.1, 0.2, 0.3, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let mut bytes = by_pcl(format, 3, 2);
            let is_big = format == "binary_big_endian";
            if format == "ascii" {
                bytes.extend("0 0 nan\n".repeat(6).bytes());
                let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
                bytes.extend(format!("{} 3 2 0 0\n", words.join(" ")).bytes());
            } else {
                let ordered = |value: [u8; 4]| if is_big { [value[3], value[2], value[1], value[0]] } else { value };
                bytes.extend([0; 6 * 12]);
                bytes.extend(numbers.iter().flat_map(|n| ordered((*n as f32).to_le_bytes())));
                bytes.extend([3_i32, 2].iter().flat_map(|n| ordered(n.to_le_bytes())));
                bytes.extend([0; 8]);
            }
            let grid = PlyGrid::read(&bytes).expect("a PLY file");
            assert_eq!((grid.size, grid.points), (Some((3, 2)), 6), "{format}");
            let viewpoint = grid.viewpoint.expect("a camera");
            assert!((viewpoint.translation.y - 0.2).abs() < 1e-6, "{format}");
            let angle = viewpoint.rotation.scaled_axis().z;
            assert!((angle - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{format}: {angle}");
        }
    }

    #[test]
    fn a_grid_that_is_not_that_of_the_points_is_none() {
        let text =
            |info: &str| format!("ply\nformat ascii 1.0\n{info}\nelement vertex 6\nproperty float x\nend_header\n");
        let size = |info: &str| PlyGrid::read(text(info).as_bytes()).expect("a PLY file").size;
        assert_eq!(size("obj_info num_cols 3\nobj_info num_rows 2"), Some((3, 2)));
        assert_eq!(size("comment width 2\ncomment height 3"), Some((2, 3)));
        assert_eq!([size("obj_info num_cols 3"), size("comment width 6\ncomment height 1")], [None; 2]);
        assert_eq!(size("obj_info num_cols 4\nobj_info num_rows 2"), None);
        assert_eq!(PlyGrid::read(b"solid\nend_header\n"), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(count in prop::num::u64::ANY, body in prop::collection::vec(any::<u8>(), 0..60)) {
            let mut bytes = by_pcl("binary_little_endian", 1, 1);
            bytes.extend(body.clone());
            let _ = PlyGrid::read(&bytes);
            let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty double x\n\
                                element camera 1\nproperty float view_px\nend_header\n");
            let _ = PlyGrid::read(&[head.as_bytes(), &body].concat());
            let _ = PlyGrid::read(&body);
        }
    }
}
