//! Mesh files, and point clouds in PLY: OBJ, PLY, STL, glTF and GLB.
//!
//! The virtual cell's reader: unlike `semascan_formats::import`, which takes the geometry that figures are computed from, it
//! keeps materials and textures, because the cell takes pictures of them.
//!
//! Each reader yields [`Piece`]s, checked: every coordinate a usable number, every corner a vertex that is there. Files
//! are untrusted: whatever they hold, the answer is pieces or an error that names the file.

mod glb;
mod gltf;
mod obj;
mod ply;
mod stl;

use glam::{Vec2, Vec3};
use image::RgbImage;
use semascan_inspection::source::SourceError;
use std::path::Path;

/// Most triangles of a file.
const MAX_TRIANGLES: usize = 20_000_000;

/// One object of a file; without triangles it is a point cloud.
#[derive(Debug, Default)]
pub struct Piece {
    /// Name of the object, group or node.
    pub name: String,
    /// Vertices in the file's unit.
    pub positions: Vec<[f32; 3]>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of each triangle's corners, v upwards; may be empty.
    pub uvs: Vec<[Vec2; 3]>,
    /// Linear vertex colours; may be empty.
    pub colours: Vec<Vec3>,
    /// Linear base colour.
    pub base: Option<Vec3>,
    /// Picture that `uvs` refer to.
    pub texture: Option<RgbImage>,
    /// What PLY files of ours hold beside that, one a vertex; may be empty.
    pub semantics: Vec<VertexSemantics>,
}

/// Semantic properties of a vertex in a PLY file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VertexSemantics {
    /// Normal; zero where unknown.
    pub normal: [f32; 3],
    /// Component class, if the file has one.
    pub label: Option<u16>,
    /// Share of the component class; 1 where the file has none.
    pub confidence: Option<f32>,
    /// Marks, see [`semascan_model::PointFlags`].
    pub flags: u16,
}

/// Reads a file by its extension; pieces that hold nothing are left out.
///
/// # Errors
/// [`SourceError::Io`] or [`SourceError::Format`] with the file's name.
pub fn read(path: &Path) -> Result<Vec<Piece>, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let mut pieces = match extension.as_str() {
        "obj" => obj::read(path)?,
        "ply" => ply::read(path)?,
        "stl" => stl::read(path)?,
        "gltf" | "glb" => gltf::read(path)?,
        _ => return Err(refuse("is none of .obj, .ply, .stl, .gltf, .glb".into())),
    };
    pieces.retain(|p| !p.positions.is_empty());
    let count: usize = pieces.iter().map(|p| p.triangles.len()).sum();
    if count > MAX_TRIANGLES {
        return Err(refuse(format!("holds {count} triangles; {MAX_TRIANGLES} are the most")));
    }
    pieces.iter().try_for_each(check).map_err(refuse)?;
    Ok(pieces)
}

/// Opens and reads a whole file.
fn bytes(path: &Path) -> Result<Vec<u8>, SourceError> {
    std::fs::read(path).map_err(|source| SourceError::Io { path: path.to_owned(), source })
}

fn check(piece: &Piece) -> Result<(), String> {
    // Points of a cloud may be nowhere; what triangles are made of may not.
    let usable = |p: &[f32; 3]| p.iter().all(|x| x.is_finite() && x.abs() < 1e9);
    let bad = piece.positions.iter().position(|p| !usable(p)).filter(|_| !piece.triangles.is_empty());
    if let Some(i) = bad {
        return Err(format!("vertex {i} of {:?} has a coordinate that is no usable number", piece.name));
    }
    let n = piece.positions.len();
    match piece.triangles.iter().flatten().find(|&&i| i as usize >= n) {
        Some(i) => Err(format!("a face of {:?} names vertex {i}, of {n}", piece.name)),
        None => Ok(()),
    }
}

/// sRGB in 0..=1 to linear.
fn linear(c: [f32; 3]) -> Vec3 {
    Vec3::from_array(c.map(|v| v.clamp(0.0, 1.0).powf(2.2)))
}

/// Splits a polygon into a fan of triangles.
fn fan(polygon: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]])
}
