//! OBJ: the mesh in objects by component, with a material library of the class colours.
//!
//! Vertices carry their own colour as three more numbers, which most readers take and the others pass over. A comment notes
//! the unit and the upward axis, which the format has no word for.

use crate::{Component, FileFrame, WriteError, components};
use semascan_model::{SemanticMesh, Taxonomy};
use std::io::{BufWriter, Write};

/// Writes the geometry in `frame`. `library` is the name of the file that [`write_materials`] goes to.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::Io`] if `out` fails.
pub fn write_mesh(
    out: impl Write,
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    library: &str,
    frame: FileFrame,
) -> Result<(), WriteError> {
    write_mesh_at(out, mesh, [0.0; 3], taxonomy, library, frame)
}

/// Writes the geometry of a mesh whose positions are relative to `shift`.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_mesh_at(
    out: impl Write,
    mesh: &SemanticMesh,
    shift: [f64; 3],
    taxonomy: &Taxonomy,
    library: &str,
    frame: FileFrame,
) -> Result<(), WriteError> {
    let components = components(mesh, taxonomy)?;
    let mut out = BufWriter::new(out);
    writeln!(out, "# semascan {}: unit {}", env!("CARGO_PKG_VERSION"), frame.name())?;
    writeln!(out, "mtllib {}", word(library))?;
    for v in mesh.vertices.iter() {
        let [r, g, b] = v.color.map(|c| f32::from(c) / 255.0);
        let place = frame.position([0, 1, 2].map(|axis| f64::from(v.position[axis]) + shift[axis]));
        if shift == [0.0; 3] {
            // Of the shortest digits that single precision needs.
            let [x, y, z] = place.map(|c| c as f32);
            writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
        } else {
            let [x, y, z] = place;
            writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
        }
    }
    for [x, y, z] in mesh.vertices.normals.iter().map(|normal| frame.direction(*normal)) {
        writeln!(out, "vn {x:.5} {y:.5} {z:.5}")?;
    }
    for Component { name, triangles, .. } in &components {
        let name = word(name);
        writeln!(out, "o {name}\nusemtl {name}")?;
        for [a, b, c] in triangles.iter().map(|t| t.map(|v| v + 1)) {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
    }
    Ok(out.flush()?)
}

/// Writes a material in the class colour for each component of the mesh.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::Io`] if `out` fails.
pub fn write_materials(out: impl Write, mesh: &SemanticMesh, taxonomy: &Taxonomy) -> Result<(), WriteError> {
    let mut out = BufWriter::new(out);
    writeln!(out, "# semascan {}", env!("CARGO_PKG_VERSION"))?;
    for Component { name, color, .. } in components(mesh, taxonomy)? {
        let [r, g, b] = color.map(|c| f32::from(c) / 255.0);
        writeln!(out, "newmtl {}\nKd {r:.4} {g:.4} {b:.4}\nKa 0 0 0\nKs 0 0 0\nillum 1\n", word(&name))?;
    }
    Ok(out.flush()?)
}

/// Names end at white space in OBJ.
fn word(name: &str) -> String {
    name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect()
}
