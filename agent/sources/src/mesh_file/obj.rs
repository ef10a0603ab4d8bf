//! Wavefront OBJ with its material library, by the `tobj` crate.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::{Piece, bytes, linear};
use semascan_inspection::source::SourceError;

/// Each object or group of the file; a missing material library or texture leaves the part grey.
pub(super) fn read(path: &Path) -> Result<Vec<Piece>, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let text = bytes(path)?;
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let folder = path.parent().unwrap_or(Path::new("."));
    let library = |name: &Path| tobj::load_mtl(folder.join(name));
    let (models, materials) = tobj::load_obj_buf(&mut text.as_slice(), &options, library)
        .map_err(|e| refuse(format!("is no usable OBJ: {e}")))?;
    // A material library that cannot be read costs the colours, not the part.
    let materials = materials.unwrap_or_default();
    let mut pieces = Vec::new();
    for model in models {
        let mesh = model.mesh;
        let material = mesh.material_id.and_then(|i| materials.get(i));
        let texture = material.and_then(|m| m.diffuse_texture.as_ref()).and_then(|name| {
            let file = folder.join(name);
            image::open(&file).map(|i| i.to_rgb8()).map_err(|e| tracing::warn!("{}: {e}", file.display())).ok()
        });
        let uv = |i: u32| {
            let i = 2 * i as usize;
            mesh.texcoords.get(i..i + 2).map_or(Vec2::ZERO, |c| Vec2::new(c[0], c[1]))
        };
        let whole =
            |indices: &[u32]| -> Vec<[u32; 3]> { indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect() };
        let base = material.and_then(|m| m.diffuse).map(linear);
        pieces.push(Piece {
            name: model.name,
            positions: mesh.positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
            triangles: whole(&mesh.indices),
            uvs: whole(&mesh.texcoord_indices).into_iter().map(|t| t.map(uv)).collect(),
            colours: mesh.vertex_color.chunks_exact(3).map(|c| linear([c[0], c[1], c[2]])).collect(),
            // A texture carries the colour itself; libraries often leave an arbitrary grey beside it.
            base: if texture.is_some() { Some(Vec3::ONE) } else { base },
            texture,
            semantics: Vec::new(),
        });
    }
    Ok(pieces)
}
