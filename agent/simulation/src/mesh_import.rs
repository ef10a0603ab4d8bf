//! Any mesh file as the part.
//!
//! Pieces of a file are given normals and joined. Objects or nodes of a file become component classes when there are
//! between 2 and [`MAX_CLASSES`] of them; a file in one piece is one class.

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};
use image::RgbImage;

use super::part::{SceneMesh, Tag};
use semascan_inspection::source::SourceError;
use semascan_sources::mesh_file::{self, Piece};

/// Most pieces that count as components of their own.
const MAX_CLASSES: usize = 64;
/// Cosine of the angle past which neighbouring triangles meet in a sharp edge.
const CREASE: f32 = 0.75;

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
/// [`SourceError::Io`] or [`SourceError::Format`] with the file's name.
pub(super) fn read(path: &Path) -> Result<Imported, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    join(mesh_file::read(path)?).map_err(refuse)
}

fn join(pieces: Vec<Piece>) -> Result<Imported, String> {
    let cloud = !pieces.is_empty();
    let pieces: Vec<Piece> = pieces.into_iter().filter(|p| !p.triangles.is_empty()).collect();
    if pieces.is_empty() {
        return Err(if cloud { "is a point cloud: a part needs faces" } else { "holds no triangles" }.into());
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

#[cfg(test)]
mod tests;
