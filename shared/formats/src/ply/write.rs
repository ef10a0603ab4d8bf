//! The writer, binary little endian: the semantic cloud and labelled meshes [Turk 1994].
//!
//! Class names travel as comments, `comment label 3 solenoid #rrggbb` and `comment defect 1 corrosion #rrggbb`; readers
//! that know nothing of them still see labels as numbers.

use super::header::Kind;
use crate::{WriteError, component};
use semascan_model::{ClassDef, POINT_COLUMNS, SemanticCloud, SemanticMesh, SemanticPoint, Taxonomy};
use std::io::{BufWriter, Write};

/// Properties of a vertex of a labelled mesh, in order.
const MESH_PROPERTIES: [(&str, &str); 5] =
    [("float32", "x"), ("float32", "y"), ("float32", "z"), ("uint16", "label"), ("uint16", "defect")];

/// Name of the column of positions.
const POSITION: &str = "position";

/// The one property of a face: `int32`, because some readers know no unsigned indices.
const FACE: (&str, &str) = ("list uint8 int32", "vertex_indices");

/// A triangle mesh with a label and a defect for every vertex.
#[derive(Clone, Copy, Debug)]
pub struct LabelledMesh<'a> {
    /// Vertices in metres, table frame.
    pub vertices: &'a [[f32; 3]],
    /// Vertex indices of each triangle, counter-clockwise from outside.
    pub triangles: &'a [[u32; 3]],
    /// Component class of each vertex.
    pub labels: &'a [u16],
    /// Defect class of each vertex.
    pub defects: &'a [u16],
}

/// Writes `cloud.ply`. `comments` are further `comment KEY VALUE` lines, `("voxel", "0.0005")` for instance.
///
/// # Errors
/// [`WriteError::Io`] if `out` fails.
pub fn write_cloud(
    out: impl Write,
    cloud: &SemanticCloud,
    taxonomy: &Taxonomy,
    comments: &[(String, String)],
) -> Result<(), WriteError> {
    write_cloud_at(out, cloud, [0.0; 3], taxonomy, comments)
}

/// Writes a cloud whose positions are relative to `shift`: in double precision where that is not zero.
///
/// # Errors
/// [`WriteError::Io`] if `out` fails.
pub fn write_cloud_at(
    out: impl Write,
    cloud: &SemanticCloud,
    shift: [f64; 3],
    taxonomy: &Taxonomy,
    comments: &[(String, String)],
) -> Result<(), WriteError> {
    let mut out = BufWriter::new(out);
    begin(&mut out, taxonomy, comments)?;
    element(&mut out, "vertex", cloud.len(), &point_properties(shift))?;
    out.write_all(b"end_header\n")?;
    let mut row = Vec::new();
    for point in cloud.iter() {
        write_point(&mut out, &point, shift, &mut row)?;
    }
    Ok(out.flush()?)
}

/// Writes `mesh.ply`: vertices as in `cloud.ply`, the mark of the unobserved among their flags, and faces.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::TooLarge`] past 2^31 - 1
/// vertices, [`WriteError::Io`] if `out` fails.
pub fn write_semantic_mesh(
    out: impl Write,
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    comments: &[(String, String)],
) -> Result<(), WriteError> {
    write_semantic_mesh_at(out, mesh, [0.0; 3], taxonomy, comments)
}

/// Writes a mesh whose positions are relative to `shift`: in double precision where that is not zero.
///
/// # Errors
/// As [`write_semantic_mesh`].
pub fn write_semantic_mesh_at(
    out: impl Write,
    mesh: &SemanticMesh,
    shift: [f64; 3],
    taxonomy: &Taxonomy,
    comments: &[(String, String)],
) -> Result<(), WriteError> {
    component::check(mesh)?;
    let limit = i32::MAX as usize;
    if mesh.len() > limit {
        return Err(WriteError::TooLarge { what: "the mesh", len: mesh.len(), limit });
    }
    let mut out = BufWriter::new(out);
    begin(&mut out, taxonomy, comments)?;
    element(&mut out, "vertex", mesh.len(), &point_properties(shift))?;
    element(&mut out, "face", mesh.triangles.len(), &[FACE])?;
    out.write_all(b"end_header\n")?;
    let mut row = Vec::new();
    for (v, point) in mesh.vertices.iter().enumerate() {
        write_point(&mut out, &SemanticPoint { flags: mesh.flags(v), ..point }, shift, &mut row)?;
    }
    write_faces(&mut out, &mesh.triangles)?;
    Ok(out.flush()?)
}

/// Writes a labelled mesh, `truth.ply` for instance.
///
/// # Errors
/// [`WriteError::Length`] or [`WriteError::Vertex`] if the mesh is inconsistent, [`WriteError::TooLarge`] past 2^31 - 1
/// vertices, [`WriteError::Io`] if `out` fails.
pub fn write_mesh(
    out: impl Write,
    mesh: &LabelledMesh<'_>,
    taxonomy: &Taxonomy,
    comments: &[(String, String)],
) -> Result<(), WriteError> {
    check(mesh)?;
    let mut out = BufWriter::new(out);
    begin(&mut out, taxonomy, comments)?;
    element(&mut out, "vertex", mesh.vertices.len(), &MESH_PROPERTIES)?;
    element(&mut out, "face", mesh.triangles.len(), &[FACE])?;
    out.write_all(b"end_header\n")?;
    for ((vertex, label), defect) in mesh.vertices.iter().zip(mesh.labels).zip(mesh.defects) {
        for coordinate in vertex {
            out.write_all(&coordinate.to_le_bytes())?;
        }
        for class in [label, defect] {
            out.write_all(&class.to_le_bytes())?;
        }
    }
    write_faces(&mut out, mesh.triangles)?;
    Ok(out.flush()?)
}

fn write_faces(out: &mut impl Write, triangles: &[[u32; 3]]) -> Result<(), WriteError> {
    for triangle in triangles {
        out.write_all(&[3])?;
        for vertex in triangle {
            out.write_all(&vertex.to_le_bytes())?;
        }
    }
    Ok(())
}

fn check(mesh: &LabelledMesh<'_>) -> Result<(), WriteError> {
    let vertices = mesh.vertices.len();
    let limit = i32::MAX as usize;
    if vertices > limit {
        return Err(WriteError::TooLarge { what: "the mesh", len: vertices, limit });
    }
    for (column, len) in [("labels", mesh.labels.len()), ("defects", mesh.defects.len())] {
        if len != vertices {
            return Err(WriteError::Length { column, len, vertices });
        }
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(WriteError::Vertex { triangle, vertex, vertices });
        }
    }
    Ok(())
}

fn begin(out: &mut impl Write, taxonomy: &Taxonomy, comments: &[(String, String)]) -> Result<(), WriteError> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    for (key, value) in comments {
        writeln!(out, "comment {} {}", one_line(key), one_line(value))?;
    }
    classes(out, "label", &taxonomy.components)?;
    classes(out, "defect", &taxonomy.defects)
}

fn classes(out: &mut impl Write, kind: &str, classes: &[ClassDef]) -> Result<(), WriteError> {
    for class in classes {
        let [r, g, b] = class.color;
        writeln!(out, "comment {kind} {} {} #{r:02x}{g:02x}{b:02x}", class.id, one_line(&class.name))?;
    }
    Ok(())
}

fn element(out: &mut impl Write, name: &str, count: usize, properties: &[(&str, &str)]) -> Result<(), WriteError> {
    writeln!(out, "element {name} {count}")?;
    for (kind, name) in properties {
        writeln!(out, "property {kind} {name}")?;
    }
    Ok(())
}

/// A line break in a name would end the comment and begin a header line of its own.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Types and names of the properties of a vertex of `cloud.ply` and `mesh.ply`, in order.
fn point_properties(shift: [f64; 3]) -> Vec<(&'static str, &'static str)> {
    let mut properties = Vec::new();
    for column in POINT_COLUMNS {
        let is_double = column.name == POSITION && shift != [0.0; 3];
        let kind = if is_double { "float64" } else { Kind::name_of(column.number_type) };
        properties.extend(column.number_names.iter().map(|name| (kind, *name)));
    }
    properties
}

/// Writes a point's row of columns; `row` is a buffer.
fn write_point(
    out: &mut impl Write,
    point: &SemanticPoint,
    shift: [f64; 3],
    row: &mut Vec<u8>,
) -> Result<(), WriteError> {
    row.clear();
    for column in POINT_COLUMNS {
        if column.name == POSITION && shift != [0.0; 3] {
            let shifted = [0, 1, 2].map(|axis| f64::from(point.position[axis]) + shift[axis]);
            row.extend(shifted.iter().flat_map(|c| c.to_le_bytes()));
        } else {
            (column.append)(point, row);
        }
    }
    Ok(out.write_all(row)?)
}
