//! The reader: clouds and meshes that [`super::write_cloud`] and its neighbours write, and those of other programs as far as
//! they go.
//!
//! What a file lacks gets the value that says nothing (no class, no evidence); what is not read is said.

use super::header::{Element, Header};
use super::polygons::{Polygons, faces, strips};
use super::values::Values;
use super::vertices::vertices;
use crate::ReadError;
use crate::geometry::{Geometry, MAX_VERTICES, Piece, linear};
use crate::offset::{kept_shift, relative};
use semascan_model::LengthUnit;
use semascan_model::{ClassDef, SemanticMesh, Taxonomy};

/// What a file holds.
#[derive(Clone, Debug)]
pub struct PlyModel {
    /// Positions of the vertices as the file has them, in its unit.
    pub positions: Vec<[f64; 3]>,
    /// Vertices and, if the file has faces, triangles; positions are relative to `shift`.
    pub mesh: SemanticMesh,
    /// What was taken off positions so that single precision holds them; zero for models near the origin.
    pub shift: [f64; 3],
    /// Classes that its comments name; `none` alone where there are no such comments.
    pub taxonomy: Taxonomy,
    /// Other comments as key and value: `voxel` and `0.0005`, for instance.
    pub comments: Vec<(String, String)>,
    /// What of the file was not read, a sentence each.
    pub warnings: Vec<String>,
    pub(super) columns: Vec<&'static str>,
}

impl PlyModel {
    /// The value of a comment.
    pub fn comment(&self, key: &str) -> Option<&str> {
        self.comments.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// Whether the file has a column of [`POINT_COLUMNS`](semascan_model::POINT_COLUMNS), by its name, with all its numbers.
    pub fn has(&self, column: &str) -> bool {
        self.columns.contains(&column)
    }

    /// The shape, and what evaluation and simulation take of the columns.
    pub(crate) fn into_geometry(self) -> Geometry {
        let [normal, color, label, confidence, flags] =
            ["normal", "color", "label", "confidence", "flags"].map(|column| self.has(column));
        // What notes a voxel edge is our own.
        let unit =
            self.comment("unit").and_then(LengthUnit::parse).or_else(|| self.voxel().map(|_| LengthUnit::Metres));
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
            unit,
            warnings: self.warnings,
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
        shift: [0.0; 3],
        taxonomy: Taxonomy { components: Vec::new(), defects: Vec::new() },
        comments: Vec::new(),
        warnings: Vec::new(),
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
    let mut values = Values::new(&bytes[header.length..], header.format);
    let mut unread = Vec::new();
    for element in &header.elements {
        // Every element takes a byte at least: a header that promises more is wrong, and could fill the memory.
        if element.count > values.left() && element.count > 0 {
            return Err(format!("{} elements `{}` do not fit", element.count, element.name));
        }
        if element.name == "vertex" && element.count > MAX_VERTICES {
            return Err(format!("it holds {} vertices; {MAX_VERTICES} are the most", element.count));
        }
        match element.name.as_str() {
            "vertex" => vertices(&mut values, element, &mut model, &mut unread)?,
            "face" => faces(&mut values, element, &mut polygons, &mut unread)?,
            "tristrips" => strips(&mut values, element, &mut polygons)?,
            _ => skip(&mut values, element, &mut unread)?,
        }
    }
    if !unread.is_empty() {
        model.warnings.push(format!("is not read: {}", unread.join(", ")));
    }
    model.warnings.extend(values.uncounted());
    model.mesh.triangles = polygons.triangles(&model.positions, &mut model.warnings)?;
    model.shift = kept_shift(&model.positions);
    if model.shift != [0.0; 3] {
        model.mesh.vertices.positions = relative(&model.positions, 1.0, model.shift);
    }
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

/// Passes over an element that means nothing here.
fn skip(values: &mut Values<'_>, element: &Element, unread: &mut Vec<String>) -> Result<(), String> {
    if element.properties.is_empty() || element.count == 0 {
        return Ok(());
    }
    unread.push(format!("{} elements `{}`", element.count, element.name));
    for index in 0..element.count {
        values.record(&element.name, index, |values| element.properties.iter().try_for_each(|p| values.pass(p)))?;
    }
    Ok(())
}
