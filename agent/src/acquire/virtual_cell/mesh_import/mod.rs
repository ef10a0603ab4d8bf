//! Any mesh as the part: OBJ, PLY, STL, glTF and GLB files.
//!
//! Each reader yields [`Piece`]s; here they are checked, given normals and joined. Objects or nodes of a file become
//! component classes when there are between 2 and [`MAX_CLASSES`] of them; a file in one piece is one class. Files are
//! untrusted: whatever they hold, the answer is a mesh or an error that names the file.

mod glb;
mod gltf;
mod obj;
mod ply;
mod stl;

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};
use image::RgbImage;

use super::part::{SceneMesh, Tag};
use crate::acquire::AcquireError;

/// Most pieces that count as components of their own.
const MAX_CLASSES: usize = 64;
/// Most triangles of a file.
const MAX_TRIANGLES: usize = 20_000_000;
/// Cosine of the angle past which neighbouring triangles meet in a sharp edge.
const CREASE: f32 = 0.75;

/// One object of a file.
#[derive(Debug, Default)]
struct Piece {
    name: String,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Texture coordinates of each triangle's corners, v upwards; may be empty.
    uvs: Vec<[Vec2; 3]>,
    /// Linear vertex colours; may be empty.
    colours: Vec<Vec3>,
    /// Linear base colour.
    base: Option<Vec3>,
    texture: Option<RgbImage>,
}

/// A file's mesh in its own units: tags hold class, instance, texture and the index of a colour as finish.
#[derive(Debug)]
pub(super) struct Imported {
    pub(super) mesh: SceneMesh,
    pub(super) names: Vec<String>,
    pub(super) colours: Vec<Vec3>,
    pub(super) textures: Vec<RgbImage>,
}

/// Reads a mesh file by its extension.
///
/// # Errors
/// [`AcquireError::Io`] or [`AcquireError::Format`] with the file's name.
pub(super) fn read(path: &Path) -> Result<Imported, AcquireError> {
    let refuse = |reason: String| AcquireError::Format { path: path.to_owned(), reason };
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let pieces = match extension.as_str() {
        "obj" => obj::read(path)?,
        "ply" => ply::read(path)?,
        "stl" => stl::read(path)?,
        "gltf" | "glb" => gltf::read(path)?,
        _ => return Err(refuse("is none of .obj, .ply, .stl, .gltf, .glb".into())),
    };
    join(pieces).map_err(refuse)
}

/// Opens and reads a whole file.
fn bytes(path: &Path) -> Result<Vec<u8>, AcquireError> {
    std::fs::read(path).map_err(|source| AcquireError::Io { path: path.to_owned(), source })
}

fn join(pieces: Vec<Piece>) -> Result<Imported, String> {
    let pieces: Vec<Piece> = pieces.into_iter().filter(|p| !p.triangles.is_empty()).collect();
    let count: usize = pieces.iter().map(|p| p.triangles.len()).sum();
    if count == 0 {
        return Err("holds no triangles".into());
    }
    if count > MAX_TRIANGLES {
        return Err(format!("holds {count} triangles; {MAX_TRIANGLES} are the most"));
    }
    let mut classes: Vec<String> = Vec::new();
    for piece in &pieces {
        if !classes.contains(&piece.name) && classes.len() <= MAX_CLASSES {
            classes.push(piece.name.clone());
        }
    }
    let separate = (2..=MAX_CLASSES).contains(&classes.len());
    let mut out = Imported { mesh: SceneMesh::default(), names: Vec::new(), colours: Vec::new(), textures: Vec::new() };
    for (i, piece) in pieces.into_iter().enumerate() {
        check(&piece)?;
        let class = match separate {
            true => classes.iter().position(|n| *n == piece.name).unwrap_or(0) as u16 + 1,
            false => 1,
        };
        let texture =
            if piece.texture.is_some() && piece.uvs.len() == piece.triangles.len() { piece.texture } else { None };
        let has_colours = piece.colours.len() == piece.positions.len();
        // Texture and vertex colours multiply the base colour; alone, the base colour is a light grey.
        let fallback = if texture.is_some() || has_colours { Vec3::ONE } else { Vec3::splat(0.4) };
        out.colours.push(piece.base.unwrap_or(fallback));
        let mut tag = Tag { class, instance: class, finish: i as u16, texture: 0, in_truth: true };
        if let Some(image) = texture {
            out.textures.push(image);
            tag.texture = out.textures.len() as u16;
        }
        let first = out.mesh.vertices.len() as u32;
        out.mesh.normals.extend(corner_normals(&piece.positions, &piece.triangles));
        out.mesh.vertices.extend(&piece.positions);
        for (k, t) in piece.triangles.iter().enumerate() {
            out.mesh.triangles.push(t.map(|v| v + first));
            out.mesh.uvs.push(piece.uvs.get(k).copied().unwrap_or([Vec2::ZERO; 3]));
            out.mesh.tags.push(tag);
            out.mesh.tints.push(if has_colours { t.map(|v| piece.colours[v as usize]) } else { [Vec3::ONE; 3] });
        }
    }
    out.names = if separate { classes } else { vec![String::from("part")] };
    Ok(out)
}

fn check(piece: &Piece) -> Result<(), String> {
    if let Some(i) = piece.positions.iter().position(|p| !p.iter().all(|x| x.is_finite() && x.abs() < 1e9)) {
        return Err(format!("vertex {i} of {:?} has a coordinate that is no usable number", piece.name));
    }
    let n = piece.positions.len();
    match piece.triangles.iter().flatten().find(|&&i| i as usize >= n) {
        Some(i) => Err(format!("a face of {:?} names vertex {i}, of {n}", piece.name)),
        None => Ok(()),
    }
}

/// Normals at each triangle's corners: the mean over the triangles around a point that lie within the crease angle.
fn corner_normals(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[Vec3; 3]> {
    let at = |i: u32| Vec3::from_array(positions[i as usize]);
    let faces: Vec<Vec3> = triangles.iter().map(|&[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a))).collect();
    // Seams repeat vertices: what stands at one place counts as one.
    let mut around: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
    for (k, t) in triangles.iter().enumerate() {
        for &i in t {
            around.entry(positions[i as usize].map(f32::to_bits)).or_default().push(k as u32);
        }
    }
    let corner = |k: usize, i: u32| {
        let own = faces[k].normalize_or_zero();
        let fan = &around[&positions[i as usize].map(f32::to_bits)];
        // A fan of hundreds is no smooth surface, and would cost the square of its size.
        let fan = &fan[..fan.len().min(64)];
        let near = fan.iter().map(|&j| faces[j as usize]).filter(|f| f.normalize_or_zero().dot(own) > CREASE);
        (near.sum::<Vec3>() + faces[k] * 1e-3).normalize_or(own.normalize_or(Vec3::Z))
    };
    triangles.iter().enumerate().map(|(k, t)| t.map(|i| corner(k, i))).collect()
}

/// sRGB in 0..=1 to linear.
fn linear(c: [f32; 3]) -> Vec3 {
    Vec3::from_array(c.map(|v| v.clamp(0.0, 1.0).powf(2.2)))
}

/// Splits a polygon into a fan of triangles.
fn fan(polygon: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]])
}

#[cfg(test)]
mod tests;
