//! The chunk codec: one chunk = up to 32^3 voxels of the semantic map, at most one point a voxel.
//!
//! [`encode`] turns a [`VoxelChunk`] into the bytes of a `ChunkUpdate`, [`decode`] turns a `ChunkUpdate` from anywhere
//! into points. Positions are exact to 1/16 voxel (Euclidean), labels and colours are lossless, shares and sigmas are
//! rounded to 1/255, normals to about half a degree.

use crate::model::SemanticPoint;

/// Voxels along an edge of a chunk.
pub const CHUNK_EDGE: i32 = 32;

/// Position quanta along an edge of a voxel: sqrt(3)/2 of a quantum is the worst position error, 0.062 voxel.
pub const QUANTA_PER_VOXEL: i32 = 14;

/// What is to be encoded: the occupied voxels of one chunk, in any order.
#[derive(Clone, Debug, Default)]
pub struct VoxelChunk {
    /// Chunk coordinates: voxel `i` of the map lies in chunk `i.div_euclid(32)`.
    pub id: [i32; 3],
    /// Voxel edge in metres.
    pub voxel: f32,
    /// Each occupied voxel's index inside the chunk (0..32 along each axis) and its point, which lies in that voxel.
    pub voxels: Vec<([u8; 3], SemanticPoint)>,
}
