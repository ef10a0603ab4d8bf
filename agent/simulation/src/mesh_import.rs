//! Any mesh file as the part.
//!
//! Pieces of a file are given normals and joined. Objects or nodes of a file become component classes when there are
//! between 2 and [`MAX_CLASSES`] of them; a file in one piece is one class.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use glam::{Vec2, Vec3};
use image::{ImageReader, RgbImage};

use super::part::{SceneMesh, Tag};
use semascan_formats::offset::{common_offset, relative};
use semascan_formats::unit::is_inspected_size;
use semascan_formats::{Geometry, Piece, ReadError, Texture, read_file};
use semascan_inspection::source::SourceError;
use semascan_model::LengthUnit;

/// Most pieces that count as components of their own.
const MAX_CLASSES: usize = 64;
/// Most pixels of all pictures of a part together.
const MAX_PIXELS: u64 = 1 << 27;
/// Cosine of the angle past which neighbouring triangles meet in a sharp edge.
const CREASE: f32 = 0.75;

/// A file's mesh in its own units: tags hold class, instance, texture and the index of a colour as finish.
#[derive(Debug)]
pub(super) struct Imported {
    pub(super) mesh: SceneMesh,
    pub(super) names: Vec<String>,
    pub(super) colours: Vec<Vec3>,
    pub(super) textures: Vec<RgbImage>,
    /// The file's unit in metres.
    pub(super) scale: f64,
}

/// Reads a mesh file by its extension; `scale` is its unit in metres, assumed from the size of the part where it is not
/// given. A part that lies far from the origin is brought to it.
///
/// # Errors
/// [`SourceError::Io`] or [`SourceError::Format`] with the file's name.
pub(super) fn read(path: &Path, scale: Option<f64>) -> Result<Imported, SourceError> {
    let geometry = read_file(path).map_err(|error| match error {
        ReadError::Io { source, .. } => SourceError::Io { path: path.to_owned(), source },
        ReadError::Format { reason, .. } => SourceError::Format { path: path.to_owned(), reason },
    })?;
    for warning in &geometry.warnings {
        tracing::warn!("{}: {warning}", path.display());
    }
    let scale = scale.unwrap_or_else(|| {
        let unit = if is_inspected_size(geometry.extent()) { LengthUnit::Metres } else { LengthUnit::Millimetres };
        tracing::warn!("{}: one unit is taken for 1 {}: say another with the key unit", path.display(), unit.name());
        unit.in_metres()
    });
    join(geometry, scale).map_err(|reason| SourceError::Format { path: path.to_owned(), reason })
}

fn join(geometry: Geometry, scale: f64) -> Result<Imported, String> {
    if geometry.triangles.is_empty() {
        let cloud = !geometry.positions.is_empty();
        return Err(if cloud { "is a point cloud: a part needs faces" } else { "holds no triangles" }.into());
    }
    let offset = common_offset(&geometry.positions, scale).map(|c| c / scale);
    let positions = relative(&geometry.positions, 1.0, offset);
    let (pictures, numbers) = pictures(&geometry.textures);
    let pieces: Vec<&Piece> = geometry.pieces.iter().filter(|p| !p.triangles.is_empty()).collect();
    let mut classes: Vec<String> = Vec::new();
    for piece in &pieces {
        if !classes.contains(&piece.name) && classes.len() <= MAX_CLASSES {
            classes.push(piece.name.clone());
        }
    }
    let separate = (2..=MAX_CLASSES).contains(&classes.len());
    let mut out =
        Imported { mesh: SceneMesh::default(), names: Vec::new(), colours: Vec::new(), textures: pictures, scale };
    let colors: Vec<Vec3> = geometry.colors.iter().map(|c| Vec3::from_array(*c)).collect();
    for (i, piece) in pieces.into_iter().enumerate() {
        let class = match separate {
            true => classes.iter().position(|n| *n == piece.name).unwrap_or(0) as u16 + 1,
            false => 1,
        };
        let texture = piece.texture.filter(|_| !geometry.texture_coordinates.is_empty());
        let texture = texture.and_then(|t| Some((numbers.get(t.index).copied().flatten()?, t.tinted)));
        // Texture and vertex colours multiply the base colour; alone, the base colour is a light grey.
        let fallback = if texture.is_some() || !colors.is_empty() { Vec3::ONE } else { Vec3::splat(0.4) };
        let replaced = texture.as_ref().is_some_and(|(_, tinted)| !tinted);
        let base = piece.base_color.filter(|_| !replaced).map(Vec3::from_array);
        out.colours.push(base.unwrap_or(fallback));
        let number = texture.map_or(0, |(number, _)| number);
        let tag = Tag { class, instance: class, finish: i as u16, texture: number, in_truth: true };
        let triangles = &geometry.triangles[piece.triangles.clone()];
        out.mesh.normals.extend(corner_normals(&positions, triangles));
        for (k, t) in piece.triangles.clone().zip(triangles) {
            let uvs = geometry.texture_coordinates.get(k).map(|t| t.map(Vec2::from_array));
            out.mesh.triangles.push(*t);
            out.mesh.uvs.push(uvs.unwrap_or([Vec2::ZERO; 3]));
            out.mesh.tags.push(tag);
            out.mesh.tints.push(t.map(|v| colors.get(v as usize).copied().unwrap_or(Vec3::ONE)));
        }
    }
    out.mesh.vertices = positions;
    out.names = if separate { classes } else { vec![String::from("part")] };
    Ok(out)
}

/// The pictures' pixels, and for each picture its number among those that could be decoded, from 1 on; what cannot be decoded
/// costs the colours, not the part. A few bytes can stand for many pixels, so what all hold together is bounded.
fn pictures(textures: &[Texture]) -> (Vec<RgbImage>, Vec<Option<u16>>) {
    let (mut decoded, mut left) = (Vec::new(), MAX_PIXELS);
    let numbers = textures.iter().map(|texture| {
        let picture = picture(&texture.bytes, &mut left);
        decoded.push(picture.map_err(|reason| tracing::warn!("picture {} is left out: {reason}", texture.name)).ok()?);
        u16::try_from(decoded.len()).ok()
    });
    let numbers = numbers.collect();
    (decoded, numbers)
}

/// Decodes a picture of at most `left` pixels, and takes them off.
fn picture(bytes: &[u8], left: &mut u64) -> Result<RgbImage, String> {
    let open = || {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
        reader.map_err(|e| e.to_string())
    };
    let (width, height) = open()?.into_dimensions().map_err(|e| e.to_string())?;
    let rest = left.checked_sub(u64::from(width) * u64::from(height));
    let rest = rest
        .ok_or_else(|| format!("{width}x{height} pixels: all pictures of a part have {MAX_PIXELS} pixels at most"))?;
    let decoded = open()?.decode().map_err(|e| e.to_string())?.to_rgb8();
    *left = rest;
    Ok(decoded)
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
