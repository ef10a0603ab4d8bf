//! PLY, text or binary: the clouds and meshes that [`crate::export::ply`] writes, and those of other programs as far as they
//! go [Turk 1994].
//!
//! Known columns are read whatever their number type; what a file lacks gets the value that says nothing (no class, no
//! evidence). Polygons become fans of triangles.

mod header;

use super::ImportError;
use header::{Element, Format, Header, Kind, Property};
use semascan_model::{ClassDef, PointFlags, SemanticCloud, SemanticMesh, SemanticPoint, Taxonomy};

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
