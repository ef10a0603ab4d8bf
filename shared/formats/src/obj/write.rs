//! OBJ: the mesh in objects by component, with a material library of the class colours or of one picture for all.
//!
//! Vertices carry their own colour as three more numbers, which most readers take and the others pass over; not under a picture,
//! which many readers multiply by them. A comment notes the unit and the upward axis, which the format has no word for.

use crate::{Component, FileFrame, MeshTexture, WriteError, components};
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
    write(out, mesh, shift, taxonomy, library, frame, None)
}

/// Writes the geometry of a mesh with a picture, whose positions are relative to `shift`. `library` is the name of the file that
/// [`write_textured_materials`] goes to.
///
/// # Errors
/// As [`write_mesh`], and [`WriteError::Length`] if the picture does not have a place for every vertex.
pub fn write_textured_mesh_at(
    out: impl Write,
    mesh: &SemanticMesh,
    texture: &MeshTexture<'_>,
    shift: [f64; 3],
    taxonomy: &Taxonomy,
    library: &str,
    frame: FileFrame,
) -> Result<(), WriteError> {
    texture.check(mesh.len())?;
    write(out, mesh, shift, taxonomy, library, frame, Some(texture))
}

fn write(
    out: impl Write,
    mesh: &SemanticMesh,
    shift: [f64; 3],
    taxonomy: &Taxonomy,
    library: &str,
    frame: FileFrame,
    texture: Option<&MeshTexture<'_>>,
) -> Result<(), WriteError> {
    let components = components(mesh, taxonomy)?;
    let mut out = BufWriter::new(out);
    writeln!(out, "# semascan {}: unit {}", env!("CARGO_PKG_VERSION"), frame.name())?;
    if let Some(texture) = texture {
        writeln!(out, "# {}", about(texture))?;
    }
    writeln!(out, "mtllib {}", word(library))?;
    for v in mesh.vertices.iter() {
        let place = frame.position([0, 1, 2].map(|axis| f64::from(v.position[axis]) + shift[axis]));
        if shift == [0.0; 3] {
            // Of the shortest digits that single precision needs.
            let [x, y, z] = place.map(|c| c as f32);
            write!(out, "v {x} {y} {z}")?;
        } else {
            let [x, y, z] = place;
            write!(out, "v {x} {y} {z}")?;
        }
        if texture.is_none() {
            let [r, g, b] = v.color.map(|c| f32::from(c) / 255.0);
            write!(out, " {r:.4} {g:.4} {b:.4}")?;
        }
        writeln!(out)?;
    }
    // Rows of a picture count upwards here.
    for [u, v] in texture.into_iter().flat_map(|texture| texture.places) {
        writeln!(out, "vt {u:.6} {:.6}", 1.0 - v)?;
    }
    for [x, y, z] in mesh.vertices.normals.iter().map(|normal| frame.direction(*normal)) {
        writeln!(out, "vn {x:.5} {y:.5} {z:.5}")?;
    }
    for Component { name, triangles, .. } in &components {
        let name = word(name);
        writeln!(out, "o {name}\nusemtl {name}")?;
        for [a, b, c] in triangles.iter().map(|t| t.map(|v| v + 1)) {
            match texture {
                None => writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?,
                Some(_) => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?,
            }
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

/// Writes a material for each component of the mesh, all with the picture in the file `picture` beside the library.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::Io`] if `out` fails.
pub fn write_textured_materials(
    out: impl Write,
    mesh: &SemanticMesh,
    texture: &MeshTexture<'_>,
    taxonomy: &Taxonomy,
    picture: &str,
) -> Result<(), WriteError> {
    let mut out = BufWriter::new(out);
    writeln!(out, "# semascan {}: {}", env!("CARGO_PKG_VERSION"), about(texture))?;
    for Component { name, .. } in components(mesh, taxonomy)? {
        // Readers multiply the picture by the colour.
        let (name, picture) = (word(&name), word(picture));
        writeln!(out, "newmtl {name}\nKd 1 1 1\nKa 0 0 0\nKs 0 0 0\nillum 1\nmap_Kd {picture}\n")?;
    }
    Ok(out.flush()?)
}

/// What a picture is, as a comment.
fn about(texture: &MeshTexture<'_>) -> String {
    let ((width, height), [r, g, b]) = (texture.size, texture.unseen_color);
    format!(
        "texture {width} x {height}, texel {:.3} mm, {:.1} % of the surface unseen: color {r} {g} {b}, alpha 0",
        texture.texel * 1e3,
        texture.unseen * 1e2
    )
}

/// Names end at white space in OBJ.
fn word(name: &str) -> String {
    name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect()
}
