//! PLY, text or binary: the clouds and meshes that [`crate::export::ply`] writes, and those of other programs as far as they
//! go (G. Turk, "The PLY polygon file format", 1994).
//!
//! Known columns are read whatever their number type; what a file lacks gets the value that says nothing (no class, no
//! evidence). Polygons become fans of triangles.

use super::ImportError;
use crate::model::{ClassDef, PointFlags, SemanticCloud, SemanticMesh, SemanticPoint, Taxonomy};

/// What a file holds.
#[derive(Clone, Debug)]
pub struct PlyModel {
    /// Vertices and, if the file has faces, triangles.
    pub mesh: SemanticMesh,
    /// Classes that its comments name; `none` alone where there are no such comments.
    pub taxonomy: Taxonomy,
    /// Other comments as key and value: `voxel` and `0.0005`, for instance.
    pub comments: Vec<(String, String)>,
}

impl PlyModel {
    /// The value of a comment.
    pub fn comment(&self, key: &str) -> Option<&str> {
        self.comments.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// Voxel edge in metres, if the file notes a sensible one.
    pub fn voxel(&self) -> Option<f32> {
        self.comment("voxel")?.parse().ok().map(|v: f64| v as f32).filter(|v| v.is_finite() && *v > 0.0)
    }
}

/// Reads a file.
///
/// # Errors
/// [`ImportError::Format`] that says what is wrong: no PLY, a header that promises more than there is, a face that names a
/// vertex that is not there.
pub fn read(bytes: &[u8]) -> Result<PlyModel, ImportError> {
    let header = Header::read(bytes)?;
    let mut model = PlyModel {
        mesh: SemanticMesh::default(),
        taxonomy: Taxonomy { components: Vec::new(), defects: Vec::new() },
        comments: Vec::new(),
    };
    for comment in &header.comments {
        match class(comment) {
            Some(("label", class)) => model.taxonomy.components.push(class),
            Some((_, class)) => model.taxonomy.defects.push(class),
            None => {
                let (key, value) = comment.split_once(' ').unwrap_or((comment, ""));
                model.comments.push((key.to_owned(), value.trim().to_owned()));
            }
        }
    }
    for classes in [&mut model.taxonomy.components, &mut model.taxonomy.defects] {
        // Dense, or not at all: the rest of the system counts on `list[i].id == i`.
        if classes.iter().enumerate().any(|(i, c)| usize::from(c.id) != i) || classes.is_empty() {
            classes.clear();
            classes.push(ClassDef::new(0, "none", [0x8c, 0x93, 0x9c]));
        }
    }
    let mut values = Values { rest: &bytes[header.length..], format: header.format };
    for element in &header.elements {
        // Every element takes a byte at least: a header that promises more is wrong, and could fill the memory.
        if element.count > values.rest.len() && element.count > 0 {
            return Err(refuse(format!("{} elements `{}` do not fit", element.count, element.name)));
        }
        match element.name.as_str() {
            "vertex" => vertices(&mut values, element, &mut model.mesh)?,
            "face" => faces(&mut values, element, &mut model.mesh.triangles)?,
            _ => skip(&mut values, element)?,
        }
    }
    let count = model.mesh.len();
    if let Some(bad) = model.mesh.triangles.iter().flatten().find(|v| **v as usize >= count) {
        return Err(refuse(format!("a face names vertex {bad} of {count}")));
    }
    Ok(model)
}

fn refuse(reason: impl Into<String>) -> ImportError {
    ImportError::Format { format: "PLY", reason: reason.into() }
}

/// `label 3 solenoid #rrggbb`.
fn class(comment: &str) -> Option<(&'static str, ClassDef)> {
    let (kind, rest) =
        ["label", "defect"].into_iter().find_map(|k| Some((k, comment.strip_prefix(k)?.strip_prefix(' ')?)))?;
    let (id, rest) = rest.split_once(' ')?;
    let (name, color) = rest.rsplit_once(" #")?;
    let color = u32::from_str_radix(color.trim(), 16).ok().filter(|c| *c <= 0xff_ffff)?.to_be_bytes();
    Some((kind, ClassDef::new(id.parse().ok()?, name, [color[1], color[2], color[3]])))
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    /// Type of the length, for lists.
    list: Option<Kind>,
    kind: Kind,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Header {
    format: Format,
    comments: Vec<String>,
    elements: Vec<Element>,
    /// Bytes up to the first value.
    length: usize,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        let mut header = Self { format: Format::Ascii, comments: Vec::new(), elements: Vec::new(), length: 0 };
        let (mut first, mut format) = (true, None);
        loop {
            let rest = &bytes[header.length..];
            let end = rest.iter().position(|b| *b == b'\n').ok_or_else(|| refuse("the header has no end"))?;
            let line = String::from_utf8_lossy(&rest[..end]);
            let line = line.trim_end_matches('\r');
            header.length += end + 1;
            if std::mem::take(&mut first) {
                if line != "ply" {
                    return Err(refuse("it does not begin with `ply`"));
                }
                continue;
            }
            let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
            let rest = rest.trim();
            match word {
                "end_header" => break,
                "comment" => header.comments.push(rest.to_owned()),
                "format" => {
                    format = Some(match rest {
                        "ascii 1.0" => Format::Ascii,
                        "binary_little_endian 1.0" => Format::Little,
                        "binary_big_endian 1.0" => Format::Big,
                        other => return Err(refuse(format!("format `{other}` is unknown"))),
                    });
                }
                "element" => {
                    let parsed = rest.rsplit_once(' ').and_then(|(name, n)| Some((name.trim(), n.parse().ok()?)));
                    let (name, count) = parsed.ok_or_else(|| refuse(format!("`{line}`")))?;
                    header.elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                "property" => {
                    let property = property(rest).ok_or_else(|| refuse(format!("`{line}`")))?;
                    header
                        .elements
                        .last_mut()
                        .ok_or_else(|| refuse("a property of nothing"))?
                        .properties
                        .push(property);
                }
                // `obj_info` and what else programs add.
                _ => {}
            }
        }
        header.format = format.ok_or_else(|| refuse("the header names no format"))?;
        Ok(header)
    }
}

fn property(text: &str) -> Option<Property> {
    let words: Vec<&str> = text.split_whitespace().collect();
    match words[..] {
        ["list", length, kind, name] => {
            Some(Property { name: name.into(), list: Some(Kind::parse(length)?), kind: Kind::parse(kind)? })
        }
        [kind, name] => Some(Property { name: name.into(), list: None, kind: Kind::parse(kind)? }),
        _ => None,
    }
}

impl Kind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// The values after the header, one after the other.
struct Values<'a> {
    rest: &'a [u8],
    format: Format,
}

impl Values<'_> {
    fn next(&mut self, kind: Kind) -> Result<f64, ImportError> {
        if self.format == Format::Ascii {
            let start =
                self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(|| refuse("it ends early"))?;
            let word = &self.rest[start..];
            let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            self.rest = &word[end..];
            let text = std::str::from_utf8(&word[..end]).unwrap_or_default();
            return text.parse().map_err(|_| refuse(format!("`{text}` is not a number")));
        }
        let (value, rest) = self.rest.split_at_checked(kind.size()).ok_or_else(|| refuse("it ends early"))?;
        self.rest = rest;
        let mut b = [0; 8];
        b[..value.len()].copy_from_slice(value);
        if self.format == Format::Big {
            b[..value.len()].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        Ok(match kind {
            Kind::I8 => i8::from_le_bytes([b0]).into(),
            Kind::U8 => b0.into(),
            Kind::I16 => i16::from_le_bytes([b0, b1]).into(),
            Kind::U16 => u16::from_le_bytes([b0, b1]).into(),
            Kind::I32 => i32::from_le_bytes([b0, b1, b2, b3]).into(),
            Kind::U32 => u32::from_le_bytes([b0, b1, b2, b3]).into(),
            Kind::F32 => f32::from_le_bytes([b0, b1, b2, b3]).into(),
            Kind::F64 => f64::from_le_bytes(b),
        })
    }

    /// Length of a list.
    fn length(&mut self, kind: Kind) -> Result<usize, ImportError> {
        let n = self.next(kind)?;
        // Each entry takes a byte at least.
        if n < 0.0 || n > self.rest.len() as f64 { Err(refuse(format!("a list of {n}"))) } else { Ok(n as usize) }
    }

    /// Passes over a property.
    fn pass(&mut self, property: &Property) -> Result<(), ImportError> {
        let n = property.list.map_or(Ok(1), |kind| self.length(kind))?;
        (0..n).try_for_each(|_| self.next(property.kind).map(drop))
    }
}

fn skip(values: &mut Values<'_>, element: &Element) -> Result<(), ImportError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    (0..element.count).try_for_each(|_| element.properties.iter().try_for_each(|p| values.pass(p)))
}

/// Which field of a point a property goes to.
fn vertices(values: &mut Values<'_>, element: &Element, mesh: &mut SemanticMesh) -> Result<(), ImportError> {
    type Set = fn(&mut SemanticPoint, f64);
    let set = |name: &str| -> Option<Set> {
        Some(match name {
            "x" => |p, v| p.position[0] = v as f32,
            "y" => |p, v| p.position[1] = v as f32,
            "z" => |p, v| p.position[2] = v as f32,
            "nx" => |p, v| p.normal[0] = v as f32,
            "ny" => |p, v| p.normal[1] = v as f32,
            "nz" => |p, v| p.normal[2] = v as f32,
            "red" => |p, v| p.color[0] = v as u8,
            "green" => |p, v| p.color[1] = v as u8,
            "blue" => |p, v| p.color[2] = v as u8,
            "label" => |p, v| p.label = v as u16,
            "confidence" => |p, v| p.confidence = v as f32,
            "defect" => |p, v| p.defect = v as u16,
            "defect_confidence" => |p, v| p.defect_confidence = v as f32,
            "sigma" => |p, v| p.sigma = v as f32,
            "defect_sigma" => |p, v| p.defect_sigma = v as f32,
            "instance" => |p, v| p.instance = v as u16,
            "views" => |p, v| p.views = v as u16,
            "flags" => |p, v| p.flags = PointFlags(v as u16),
            _ => return None,
        })
    };
    let setters: Vec<Option<Set>> =
        element.properties.iter().map(|p| if p.list.is_some() { None } else { set(&p.name) }).collect();
    if !["x", "y", "z"].iter().all(|axis| element.properties.iter().any(|p| p.name == *axis && p.list.is_none())) {
        return Err(refuse("vertices have no x, y and z"));
    }
    mesh.vertices = SemanticCloud::with_capacity(element.count);
    for _ in 0..element.count {
        let mut point = NOTHING;
        for (property, set) in element.properties.iter().zip(&setters) {
            match set {
                Some(set) => set(&mut point, values.next(property.kind)?),
                None => values.pass(property)?,
            }
        }
        mesh.boundary.push(point.flags.has(PointFlags::BOUNDARY));
        point.flags.0 &= !PointFlags::BOUNDARY;
        mesh.vertices.push(point);
    }
    Ok(())
}

/// A point of which nothing but its position will be known.
const NOTHING: SemanticPoint = SemanticPoint {
    position: [0.0; 3],
    normal: [0.0; 3],
    color: [160; 3],
    label: 0,
    confidence: 0.0,
    defect: 0,
    defect_confidence: 0.0,
    sigma: 0.0,
    defect_sigma: 0.0,
    instance: 0,
    views: 1,
    flags: PointFlags(0),
};

fn faces(values: &mut Values<'_>, element: &Element, triangles: &mut Vec<[u32; 3]>) -> Result<(), ImportError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut corners: Vec<u32> = Vec::new();
    for _ in 0..element.count {
        for property in &element.properties {
            match property.list {
                Some(length) if property.name == "vertex_indices" || property.name == "vertex_index" => {
                    let n = values.length(length)?;
                    corners.clear();
                    for _ in 0..n {
                        let v = values.next(property.kind)?;
                        corners.push(if v >= 0.0 { v as u32 } else { u32::MAX });
                    }
                    triangles.extend((2..n).map(|i| [corners[0], corners[i - 1], corners[i]]));
                }
                _ => values.pass(property)?,
            }
        }
    }
    Ok(())
}
