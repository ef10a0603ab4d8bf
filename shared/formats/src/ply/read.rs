//! The reader: clouds and meshes that [`super::write_cloud`] and its neighbours write, and those of other programs as far as
//! they go.
//!
//! Known columns (the table [`POINT_COLUMNS`]) are read whatever the type of their numbers, also under the name
//! `scalar_...` that CloudCompare gives them; what a file lacks gets the value that says nothing (no class, no evidence).

use super::header::{Element, Format, Header, Kind, Property};
use crate::ReadError;
use crate::geometry::{Geometry, Piece, linear};
use crate::polygon::Triangulation;
use semascan_model::{
    ClassDef, NumberType, POINT_COLUMNS, PointColumn, PointFlags, SemanticCloud, SemanticMesh, SemanticPoint, Taxonomy,
};

/// What a file holds.
#[derive(Clone, Debug)]
pub struct PlyModel {
    /// Positions of the vertices as the file has them, in its unit.
    pub positions: Vec<[f64; 3]>,
    /// Vertices and, if the file has faces, triangles.
    pub mesh: SemanticMesh,
    /// Classes that its comments name; `none` alone where there are no such comments.
    pub taxonomy: Taxonomy,
    /// Other comments as key and value: `voxel` and `0.0005`, for instance.
    pub comments: Vec<(String, String)>,
    columns: Vec<&'static str>,
}

impl PlyModel {
    /// The value of a comment.
    pub fn comment(&self, key: &str) -> Option<&str> {
        self.comments.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// Whether the file has a column of [`POINT_COLUMNS`], by its name, with all its numbers.
    pub fn has(&self, column: &str) -> bool {
        self.columns.contains(&column)
    }

    /// The shape, and what evaluation and simulation take of the columns.
    pub(crate) fn into_geometry(self) -> Geometry {
        let [normal, color, label, confidence, flags] =
            ["normal", "color", "label", "confidence", "flags"].map(|column| self.has(column));
        let SemanticMesh { vertices, triangles, .. } = self.mesh;
        let known = normal && vertices.normals.iter().any(|n| *n != [0.0; 3]);
        Geometry {
            positions: self.positions,
            normals: if known { vertices.normals } else { Vec::new() },
            colors: if color { linear_colors(&vertices.colors) } else { Vec::new() },
            labels: if label { vertices.labels } else { Vec::new() },
            confidence: if confidence { vertices.confidence } else { Vec::new() },
            flags: if flags { vertices.flags } else { Vec::new() },
            pieces: vec![Piece { name: "mesh".into(), triangles: 0..triangles.len(), ..Piece::default() }],
            triangles,
            ..Geometry::default()
        }
    }

    /// Voxel edge in metres, if the file notes a sensible one.
    pub fn voxel(&self) -> Option<f32> {
        self.comment("voxel")?.parse().ok().map(|v: f64| v as f32).filter(|v| v.is_finite() && *v > 0.0)
    }
}

/// Reads the bytes of the file `name`.
///
/// # Errors
/// [`ReadError::Format`] that says what is wrong: no PLY, a header that promises more than there is, a face that names a
/// vertex that is not there.
pub fn read(name: &str, bytes: &[u8]) -> Result<PlyModel, ReadError> {
    model(bytes).map_err(|reason| ReadError::format(name, "PLY", &reason))
}

fn model(bytes: &[u8]) -> Result<PlyModel, String> {
    let header = Header::read(bytes)?;
    let mut model = PlyModel {
        positions: Vec::new(),
        mesh: SemanticMesh::default(),
        taxonomy: Taxonomy { components: Vec::new(), defects: Vec::new() },
        comments: Vec::new(),
        columns: Vec::new(),
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
    let mut polygons = Polygons::default();
    let mut values = Values { rest: &bytes[header.length..], format: header.format };
    for element in &header.elements {
        // Every element takes a byte at least: a header that promises more is wrong, and could fill the memory.
        if element.count > values.rest.len() && element.count > 0 {
            return Err(format!("{} elements `{}` do not fit", element.count, element.name));
        }
        match element.name.as_str() {
            "vertex" => vertices(&mut values, element, &mut model)?,
            "face" => faces(&mut values, element, &mut polygons)?,
            _ => skip(&mut values, element)?,
        }
    }
    model.mesh.triangles = polygons.triangles(&model.positions)?;
    Ok(model)
}

/// Linear light of stored colours: a table of the 256 levels.
fn linear_colors(colors: &[[u8; 3]]) -> Vec<[f32; 3]> {
    let levels: Vec<f32> = (0..=255_u8).map(|level| linear([f32::from(level) / 255.0; 3])[0]).collect();
    colors.iter().map(|color| color.map(|level| levels[usize::from(level)])).collect()
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
    fn next(&mut self, kind: Kind) -> Result<f64, String> {
        if self.format == Format::Ascii {
            let start = self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or("it ends early")?;
            let word = &self.rest[start..];
            let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            self.rest = &word[end..];
            let text = std::str::from_utf8(&word[..end]).unwrap_or_default();
            return text.parse().map_err(|_| format!("`{text}` is not a number"));
        }
        let (value, rest) = self.rest.split_at_checked(kind.size()).ok_or("it ends early")?;
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
    fn length(&mut self, kind: Kind) -> Result<usize, String> {
        let n = self.next(kind)?;
        // Each entry takes a byte at least.
        if !(0.0..=self.rest.len() as f64).contains(&n) { Err(format!("a list of {n}")) } else { Ok(n as usize) }
    }

    /// Passes over a property.
    fn pass(&mut self, property: &Property) -> Result<(), String> {
        let n = property.list.map_or(Ok(1), |kind| self.length(kind))?;
        (0..n).try_for_each(|_| self.next(property.kind).map(drop))
    }
}

fn skip(values: &mut Values<'_>, element: &Element) -> Result<(), String> {
    if element.properties.is_empty() {
        return Ok(());
    }
    (0..element.count).try_for_each(|_| element.properties.iter().try_for_each(|p| values.pass(p)))
}

/// Where a property of a vertex goes.
struct Target {
    column: &'static PointColumn,
    /// Which number of the column it is.
    number: usize,
}

impl Target {
    /// `None` for lists and for what is not known.
    fn of(property: &Property) -> Option<Self> {
        // CloudCompare names scalar fields so.
        let name = property.name.strip_prefix("scalar_").unwrap_or(&property.name);
        let number = |column: &PointColumn| column.number_names.iter().position(|n| *n == name);
        let found = POINT_COLUMNS.iter().find_map(|column| Some(Self { column, number: number(column)? }));
        found.filter(|_| property.list.is_none())
    }
}

fn vertices(values: &mut Values<'_>, element: &Element, model: &mut PlyModel) -> Result<(), String> {
    let targets: Vec<Option<Target>> = element.properties.iter().map(Target::of).collect();
    let given = |column: &PointColumn| {
        let mut numbers = 0..column.number_names.len();
        numbers.all(|k| targets.iter().flatten().any(|t| t.column.name == column.name && t.number == k))
    };
    model.columns = POINT_COLUMNS.iter().filter(|c| given(c)).map(|c| c.name).collect();
    if element.count > 0 && !model.has("position") {
        return Err("vertices have no x, y and z".into());
    }
    let mesh = &mut model.mesh;
    mesh.vertices = SemanticCloud::with_capacity(element.count);
    model.positions = Vec::with_capacity(element.count);
    for index in 0..element.count {
        let (mut point, mut position) = (SemanticPoint::UNKNOWN, [0.0; 3]);
        for (property, target) in element.properties.iter().zip(&targets) {
            let Some(Target { column, number }) = target else {
                values.pass(property).map_err(|e| format!("vertex {index}: {e}"))?;
                continue;
            };
            let value = values.next(property.kind).map_err(|e| format!("vertex {index}: {e}"))?;
            if column.name == "position" {
                position[*number] = value;
            }
            let is_level = column.number_type == NumberType::U8;
            (column.set)(&mut point, *number, if is_level { level(property.kind, value) } else { value });
        }
        model.positions.push(position);
        mesh.boundary.push(point.flags.has(PointFlags::BOUNDARY));
        point.flags.0 &= !PointFlags::BOUNDARY;
        mesh.vertices.push(point);
    }
    Ok(())
}

/// A colour's level in 0..=255: numbers with a fraction go from 0 to 1, wider whole ones to their largest.
fn level(kind: Kind, value: f64) -> f64 {
    match kind {
        Kind::F32 | Kind::F64 => (value * 255.0).round(),
        Kind::U16 => (value / 257.0).round(),
        _ => value,
    }
}

/// Faces as they are in the file, which may name vertices before it has them.
#[derive(Default)]
struct Polygons {
    /// Vertex indices of all faces, one after the other.
    corners: Vec<u32>,
    /// End of each face in `corners`.
    ends: Vec<usize>,
}

impl Polygons {
    fn triangles(&self, positions: &[[f64; 3]]) -> Result<Vec<[u32; 3]>, String> {
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut triangulation = Triangulation::default();
        let (mut start, mut places) = (0, Vec::new());
        for &end in &self.ends {
            let face = &self.corners[start..end];
            start = end;
            places.clear();
            for &vertex in face {
                let place = positions.get(vertex as usize);
                places.push(*place.ok_or_else(|| format!("a face names vertex {vertex} of {}", positions.len()))?);
            }
            triangles.extend(triangulation.split(&places).iter().map(|t| t.map(|k| face[k as usize])));
        }
        Ok(triangles)
    }
}

fn faces(values: &mut Values<'_>, element: &Element, polygons: &mut Polygons) -> Result<(), String> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for index in 0..element.count {
        for property in &element.properties {
            match property.list {
                Some(length) if property.name == "vertex_indices" || property.name == "vertex_index" => {
                    let n = values.length(length).map_err(|e| format!("face {index}: {e}"))?;
                    for _ in 0..n {
                        let v = values.next(property.kind).map_err(|e| format!("face {index}: {e}"))?;
                        polygons.corners.push(if v >= 0.0 { v as u32 } else { u32::MAX });
                    }
                    polygons.ends.push(polygons.corners.len());
                }
                _ => values.pass(property).map_err(|e| format!("face {index}: {e}"))?,
            }
        }
    }
    Ok(())
}
