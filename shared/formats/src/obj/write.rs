//! OBJ: the mesh in groups by component, with a material library of the class colours.
//!
//! Vertices carry their own colour as three more numbers, which most readers take and the others pass over. Positions are
//! in metres, table frame, z up.

use crate::{Component, WriteError, components};
use semascan_model::{SemanticMesh, Taxonomy};
use std::io::{BufWriter, Write};

/// Writes the geometry. `library` is the name of the file that [`write_materials`] goes to.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::Io`] if `out` fails.
pub fn write_mesh(out: impl Write, mesh: &SemanticMesh, taxonomy: &Taxonomy, library: &str) -> Result<(), WriteError> {
    write_mesh_at(out, mesh, [0.0; 3], taxonomy, library)
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
) -> Result<(), WriteError> {
    let components = components(mesh, taxonomy)?;
    let mut out = BufWriter::new(out);
    writeln!(out, "# semascan {}: metres, table frame, z up", env!("CARGO_PKG_VERSION"))?;
    writeln!(out, "mtllib {}", word(library))?;
    for v in mesh.vertices.iter() {
        let ([x, y, z], [r, g, b]) = (v.position, v.color.map(|c| f32::from(c) / 255.0));
        if shift == [0.0; 3] {
            writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
        } else {
            let [x, y, z] = [0, 1, 2].map(|axis| f64::from(v.position[axis]) + shift[axis]);
            writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
        }
    }
    for [x, y, z] in &mesh.vertices.normals {
        writeln!(out, "vn {x:.5} {y:.5} {z:.5}")?;
    }
    for Component { name, triangles, .. } in &components {
        let name = word(name);
        writeln!(out, "g {name}\nusemtl {name}")?;
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
