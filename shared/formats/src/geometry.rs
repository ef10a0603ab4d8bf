//! What a file holds, whatever its format: the common result of the readers.

use crate::{ReadError, Resolver, gltf, obj, pcd, ply, stl};
use semascan_model::LengthUnit;
use semascan_model::PointFlags;
use std::ops::Range;

/// Most triangles of a file.
pub(crate) const MAX_TRIANGLES: usize = 20_000_000;
/// Most vertices or points of a file.
pub(crate) const MAX_VERTICES: usize = 100_000_000;
/// Most objects, groups, solids and nodes of a file.
pub(crate) const MAX_PIECES: usize = 100_000;
/// Coordinates of a surface from here on are no lengths but unset memory.
const MAX_COORDINATE: f64 = 1e9;

/// A cloud, or a mesh where there are triangles, in the unit and frame of the file (glTF: turned so that z is up).
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Vertices or points. Points of a cloud may be NaN; corners of triangles are numbers.
    pub positions: Vec<[f64; 3]>,
    /// A normal for each vertex, or none at all; not necessarily of unit length, zero where unknown.
    pub normals: Vec<[f32; 3]>,
    /// Linear colour of each vertex, 0..=1, or none at all.
    pub colors: Vec<[f32; 3]>,
    /// Component class of each vertex, or none at all.
    pub labels: Vec<u16>,
    /// Share of the component class of each vertex, or none at all.
    pub confidence: Vec<f32>,
    /// Marks of each vertex, or none at all.
    pub flags: Vec<PointFlags>,
    /// Vertex indices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of each triangle's corners, v upwards, or none at all.
    pub texture_coordinates: Vec<[[f32; 2]; 3]>,
    /// Objects, groups, solids or nodes: each is a range of triangles, in order and without gaps.
    pub pieces: Vec<Piece>,
    /// Pictures that the pieces refer to.
    pub textures: Vec<Texture>,
    /// The unit of its lengths, where the file notes it.
    pub unit: Option<LengthUnit>,
    /// What could not be used but is not needed for the shape, a sentence each: a picture that is not there, for instance.
    pub warnings: Vec<String>,
}

/// An object, group, solid or node of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// Its triangles.
    pub triangles: Range<usize>,
    /// Linear base colour, 0..=1.
    pub base_color: Option<[f32; 3]>,
    /// The picture on it.
    pub texture: Option<PieceTexture>,
}

/// Which picture a piece has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PieceTexture {
    /// Index in [`Geometry::textures`].
    pub index: usize,
    /// Whether the base colour tints it; if not, the picture takes the place of the base colour.
    pub tinted: bool,
}

/// A picture as it is stored: PNG or JPEG.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Its name, for messages.
    pub name: String,
    /// The encoded picture.
    pub bytes: Vec<u8>,
}

impl Geometry {
    /// Reads a file by the ending of its name: `ply`, `obj`, `stl`, `gltf`, `glb` or `pcd`.
    ///
    /// # Errors
    /// [`ReadError::Format`] for other endings, if the file is not what it should be, or if a triangle has a corner that is
    /// not there or nowhere.
    pub fn read(name: &str, bytes: &[u8], files: Resolver<'_>) -> Result<Self, ReadError> {
        let ending = name.rsplit_once('.').map(|(_, e)| e.to_ascii_lowercase()).unwrap_or_default();
        let geometry = match ending.as_str() {
            "ply" => ply::read(name, bytes)?.into_geometry(),
            "obj" => obj::read(name, bytes, files)?,
            "stl" => stl::read(name, bytes)?,
            "gltf" | "glb" => gltf::read(name, bytes, files)?,
            "pcd" => pcd::read(name, bytes)?.into_geometry(),
            _ => {
                let reason = "is none of .ply, .obj, .stl, .gltf, .glb, .pcd".to_owned();
                return Err(ReadError::Format { file: name.to_owned(), reason });
            }
        };
        geometry.check().map_err(|reason| ReadError::Format { file: name.to_owned(), reason })?;
        Ok(geometry)
    }

    /// Longest edge of the box around all finite positions.
    pub fn extent(&self) -> f64 {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in self.positions.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
            for a in 0..3 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
        }
        (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max)
    }

    /// Leaves out vertices that no triangle names, if there are triangles. Only positions and colours are kept up: the
    /// formats whose readers call this have no more.
    pub(crate) fn drop_unused_vertices(&mut self) {
        const UNUSED: u32 = u32::MAX;
        if self.triangles.is_empty() {
            return;
        }
        let mut number = vec![UNUSED; self.positions.len()];
        for &v in self.triangles.iter().flatten() {
            if let Some(number) = number.get_mut(v as usize) {
                *number = 0;
            }
        }
        if !number.contains(&UNUSED) {
            return;
        }
        let used: Vec<bool> = number.iter().map(|n| *n != UNUSED).collect();
        for (next, number) in number.iter_mut().filter(|n| **n != UNUSED).enumerate() {
            *number = next as u32;
        }
        let mut keep = used.iter();
        self.positions.retain(|_| keep.next().copied().unwrap_or(false));
        let mut keep = used.iter();
        self.colors.retain(|_| keep.next().copied().unwrap_or(false));
        // A vertex that is not there is found by the check of the whole.
        let renumbered = |v: u32| number.get(v as usize).copied().unwrap_or(UNUSED);
        self.triangles.iter_mut().for_each(|t| *t = t.map(renumbered));
    }

    fn check(&self) -> Result<(), String> {
        let count = self.triangles.len();
        if count > MAX_TRIANGLES {
            return Err(format!("holds {count} triangles; {MAX_TRIANGLES} are the most"));
        }
        if self.pieces.len() > MAX_PIECES {
            return Err(format!("holds {} objects; {MAX_PIECES} are the most", self.pieces.len()));
        }
        let vertices = self.positions.len();
        for &v in self.triangles.iter().flatten() {
            let position = self.positions.get(v as usize);
            let position = position.ok_or_else(|| format!("a face names vertex {v}, of {vertices}"))?;
            if !position.iter().all(|c| c.is_finite() && c.abs() < MAX_COORDINATE) {
                return Err(format!("vertex {v} has a coordinate that is no usable number"));
            }
        }
        Ok(())
    }
}

/// Linear light of an sRGB colour with channels in 0..=1, as 2.2 powers.
pub(crate) fn linear(color: [f32; 3]) -> [f32; 3] {
    color.map(|c| c.clamp(0.0, 1.0).powf(2.2))
}
