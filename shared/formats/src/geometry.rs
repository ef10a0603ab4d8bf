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
    /// Reads a file by the ending of its name: `ply`, `obj`, `stl`, `gltf`, `glb` or `pcd`, with the feature `scanners`
    /// also `e57`, `las` or `laz`.
    ///
    /// # Errors
    /// [`ReadError::Format`] for other endings, if the file is not what it should be, or if a triangle names a vertex
    /// that is not there. Triangles with a corner that is no usable number are skipped and counted in the warnings; it is an
    /// error if that leaves none.
    pub fn read(name: &str, bytes: &[u8], files: Resolver<'_>) -> Result<Self, ReadError> {
        let ending = name.rsplit_once('.').map(|(_, e)| e.to_ascii_lowercase()).unwrap_or_default();
        let geometry = match ending.as_str() {
            "ply" => ply::read(name, bytes)?.into_geometry(),
            "obj" => obj::read(name, bytes, files)?,
            "stl" => stl::read(name, bytes)?,
            "gltf" | "glb" => gltf::read(name, bytes, files)?,
            "pcd" => pcd::read(name, bytes)?.into_geometry(),
            #[cfg(feature = "scanners")]
            "e57" => crate::e57::read(name, bytes)?,
            #[cfg(feature = "scanners")]
            "las" | "laz" => crate::las::read(name, bytes)?,
            _ => {
                let scanners = if cfg!(feature = "scanners") { ", .e57, .las, .laz" } else { "" };
                let reason = format!("is none of .ply, .obj, .stl, .gltf, .glb, .pcd{scanners}");
                return Err(ReadError::Format { file: name.to_owned(), reason });
            }
        };
        geometry.checked(name)
    }

    /// What a PLY that was read already holds.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn of_ply(name: &str, file: ply::PlyModel) -> Result<Self, ReadError> {
        file.into_geometry().checked(name)
    }

    fn checked(mut self, name: &str) -> Result<Self, ReadError> {
        let checked = self.check().and_then(|()| self.skip_triangles_without_place());
        checked.map_err(|reason| ReadError::Format { file: name.to_owned(), reason })?;
        Ok(self)
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
            if v as usize >= vertices {
                return Err(format!("a face names vertex {v}, of {vertices}"));
            }
        }
        Ok(())
    }

    /// Leaves out the triangles with a corner whose coordinates are no usable numbers, and says how many they are.
    fn skip_triangles_without_place(&mut self) -> Result<(), String> {
        let is_usable = |v: &u32| {
            self.positions.get(*v as usize).is_some_and(|p| p.iter().all(|c| c.is_finite() && c.abs() < MAX_COORDINATE))
        };
        let keep: Vec<bool> = self.triangles.iter().map(|t| t.iter().all(is_usable)).collect();
        let (all, kept) = (keep.len(), keep.iter().filter(|k| **k).count());
        if kept == all {
            return Ok(());
        }
        if kept == 0 {
            return Err("every triangle has a corner with a coordinate that is no usable number".into());
        }
        let skipped = all - kept;
        self.warnings.push(format!("{skipped} of {all} triangles have a corner that is no usable number: skipped"));
        // For each triangle the number of those before it that stay.
        let mut before = Vec::with_capacity(all + 1);
        before.push(0);
        before.extend(keep.iter().scan(0, |count, keep| {
            *count += usize::from(*keep);
            Some(*count)
        }));
        for piece in &mut self.pieces {
            let [start, end] = [piece.triangles.start, piece.triangles.end].map(|at| before[at.min(all)]);
            piece.triangles = start..end;
        }
        if self.texture_coordinates.len() == all {
            let mut keep = keep.iter();
            self.texture_coordinates.retain(|_| keep.next().copied().unwrap_or(false));
        }
        let mut keep = keep.iter();
        self.triangles.retain(|_| keep.next().copied().unwrap_or(false));
        Ok(())
    }
}

/// Linear light of an sRGB colour with channels in 0..=1, as 2.2 powers.
pub(crate) fn linear(color: [f32; 3]) -> [f32; 3] {
    color.map(|c| c.clamp(0.0, 1.0).powf(2.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PLY mesh of three triangles of which `broken` first ones have a corner at `x` = nan.
    fn mesh(broken: usize) -> Result<Geometry, ReadError> {
        let header = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 3\nproperty list uchar int vertex_indices\nend_header\n";
        let vertex = |v: usize| {
            let x = if v.is_multiple_of(3) && v / 3 < broken { "nan".to_owned() } else { v.to_string() };
            format!("{x} {} {}\n", v % 2, v % 3)
        };
        let vertices: String = (0..9).map(vertex).collect();
        let text = format!("{header}{vertices}3 0 1 2\n3 3 4 5\n3 6 7 8\n");
        Geometry::read("mesh.ply", text.as_bytes(), &crate::no_files)
    }

    #[test]
    fn triangles_without_a_place_are_skipped_and_counted() {
        assert!(mesh(0).expect("a mesh").warnings.is_empty());
        let read = mesh(2).expect("one triangle is left");
        assert_eq!(read.triangles, [[6, 7, 8]]);
        assert_eq!(read.warnings, ["2 of 3 triangles have a corner that is no usable number: skipped"]);
        let error = mesh(3).expect_err("nothing is left").to_string();
        assert!(error.contains("mesh.ply") && error.contains("every triangle"), "{error}");
    }

    #[test]
    fn pieces_and_textures_follow_the_triangles_that_stay() {
        let mut geometry = Geometry {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]],
            triangles: vec![[0, 1, 2], [1, 2, 3], [2, 1, 0], [3, 0, 1]],
            texture_coordinates: (0..4).map(|k| [[k as f32, 0.0]; 3]).collect(),
            pieces: [0..2, 2..3, 3..4].map(|triangles| Piece { triangles, ..Piece::default() }).into(),
            ..Geometry::default()
        };
        geometry.skip_triangles_without_place().expect("two are left");
        assert_eq!(geometry.triangles, [[0, 1, 2], [2, 1, 0]]);
        assert_eq!(geometry.pieces.iter().map(|p| p.triangles.clone()).collect::<Vec<_>>(), [0..1, 1..2, 2..2]);
        assert_eq!(geometry.texture_coordinates.iter().map(|t| t[0][0]).collect::<Vec<_>>(), [0.0, 2.0]);
    }
}
