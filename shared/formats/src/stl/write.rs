//! Binary STL. The format holds one nameless solid a file, hence a file for each component, or one for the whole mesh whose
//! triangles carry their class in the two bytes that most programs pass over. The header notes the unit, the upward axis and
//! where the origin lies, which the format has no word for.

use crate::component::check;
use crate::{FileFrame, WriteError};
use semascan_model::{LengthUnit, SemanticMesh};
use std::io::{BufWriter, Write};

/// Writes the triangles of component class `label`, or all, in `frame` and under `name` (as much as 80 bytes hold).
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::TooLarge`] past 2^32 - 1
/// triangles, [`WriteError::Io`] if `out` fails.
pub fn write_mesh(
    out: impl Write,
    mesh: &SemanticMesh,
    label: Option<u16>,
    name: &str,
    frame: FileFrame,
) -> Result<(), WriteError> {
    write_mesh_at(out, mesh, [0.0; 3], label, name, frame)
}

/// Writes a mesh whose positions are relative to `shift`, metres. Single precision cannot hold their sum, so it is not
/// added: the header notes it as the place of the file's origin, in metres along the axes of the file.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_mesh_at(
    out: impl Write,
    mesh: &SemanticMesh,
    shift: [f64; 3],
    label: Option<u16>,
    name: &str,
    frame: FileFrame,
) -> Result<(), WriteError> {
    check(mesh)?;
    let labelled = mesh.triangles.iter().map(|t| (*t, mesh.triangle_label(*t)));
    let chosen: Vec<([u32; 3], u16)> = labelled.filter(|(_, l)| label.is_none_or(|chosen| chosen == *l)).collect();
    let limit = u32::MAX as usize;
    let count =
        u32::try_from(chosen.len()).map_err(|_| WriteError::TooLarge { what: "the mesh", len: chosen.len(), limit })?;
    let mut out = BufWriter::new(out);
    // A file that begins with `solid` is taken for text.
    let mut header = [b' '; 80];
    let origin = if shift == [0.0; 3] {
        String::new()
    } else {
        // A negative zero is written as zero.
        let [x, y, z] = FileFrame { unit: LengthUnit::Metres, ..frame }.position(shift).map(|c| c + 0.0);
        format!("origin {x} {y} {z} m, ")
    };
    for (byte, c) in header.iter_mut().zip(format!("semascan: unit {}, {origin}{name}", frame.name()).bytes()) {
        *byte = if c.is_ascii_graphic() { c } else { b' ' };
    }
    out.write_all(&header)?;
    out.write_all(&count.to_le_bytes())?;
    for (triangle, label) in chosen {
        let Some(corners) = mesh.corners(triangle) else { continue };
        let [a, b, c] = corners.map(|corner| frame.position(corner.map(f64::from)).map(|c| c as f32));
        let sub = |p: [f32; 3], q: [f32; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let (u, v) = (sub(b, a), sub(c, a));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = cross.iter().map(|c| c * c).sum::<f32>().sqrt();
        let normal = if length > 0.0 { cross.map(|c| c / length) } else { [0.0; 3] };
        for value in [normal, a, b, c].iter().flatten() {
            out.write_all(&value.to_le_bytes())?;
        }
        out.write_all(&label.to_le_bytes())?;
    }
    Ok(out.flush()?)
}
