//! STL, text or binary, by the `stl_io` crate: one piece without colour.

use std::io::Cursor;
use std::path::Path;

use super::{Piece, bytes};
use semascan_inspection::source::SourceError;

/// The file's one solid.
pub(super) fn read(path: &Path) -> Result<Vec<Piece>, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let mesh =
        stl_io::read_stl(&mut Cursor::new(bytes(path)?)).map_err(|e| refuse(format!("is no usable STL: {e}")))?;
    Ok(vec![Piece {
        name: "solid".into(),
        positions: mesh.vertices.iter().map(|v| v.0).collect(),
        triangles: mesh.faces.iter().map(|f| f.vertices.map(|i| i as u32)).collect(),
        ..Piece::default()
    }])
}
