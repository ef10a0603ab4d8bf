//! The chunk codec: one chunk = up to 32^3 voxels of the semantic map, at most one point a voxel.
//!
//! [`encode`] turns a [`VoxelChunk`] into the bytes of a `ChunkUpdate`, [`decode`] turns a `ChunkUpdate` from anywhere
//! into points. Positions are exact to 1/16 voxel (Euclidean), labels and colours are lossless, shares and sigmas are
//! rounded to 1/255, normals to about half a degree.
//!
//! `columns` holds
//!
//! | bytes | what |
//! |---|---|
//! | 1 | version of the format, now 1 |
//! | 4 | low half of the chunk's hash, little endian |
//! | the rest | one entropy-coded stream: first the occupied voxels (`occupancy`), then, voxel by voxel in raster order, the attributes, each predicted from the neighbours before it (`attributes`) |
//!
//! Prediction in place of a dictionary coder, and adaptive models in place of tables, because a chunk is small (a
//! thousand points) and its columns differ in their statistics; the same code walks the stream in both directions, so
//! that encoder and decoder cannot drift apart.

mod attributes;
mod model;
mod neighbours;
mod occupancy;
mod octahedral;
mod planes;
mod rans;

use crate::{ChunkId, ChunkUpdate, WireError};
use neighbours::Neighbours;
use occupancy::Octree;
use planes::{CELLS, Grid, Planes, refuse};
use rans::{RansDecoder, RansEncoder};
use semascan_model::{SemanticCloud, SemanticPoint};
use xxhash_rust::xxh3::xxh3_64;

pub use model::Plane;

/// Voxels along an edge of a chunk.
pub use semascan_model::CHUNK_EDGE;

/// Position quanta along an edge of a voxel: sqrt(3)/2 of a quantum is the worst position error, 0.062 voxel.
pub const QUANTA_PER_VOXEL: i32 = 14;

/// First byte of `columns`.
const FORMAT: u8 = 1;
/// Bytes of `columns` before the stream.
const HEADER: usize = 5;

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

/// An encoded chunk and the hash of its content.
#[derive(Clone, Debug, PartialEq)]
pub struct Encoded {
    /// The message.
    pub update: ChunkUpdate,
    /// Hash of the chunk's coordinates and quantized content; see [`model_hash`].
    pub hash: u64,
}

/// A decoded chunk.
#[derive(Clone, Debug, PartialEq)]
pub struct DecodedChunk {
    /// Chunk coordinates.
    pub id: [i32; 3],
    /// Revision of the chunk within its epoch.
    pub revision: u32,
    /// Epoch of the map.
    pub epoch: u32,
    /// Voxel edge in metres.
    pub voxel: f32,
    /// Hash of the chunk's coordinates and quantized content: the encoder's [`Encoded::hash`].
    pub hash: u64,
    /// The points in raster order of their voxels (x fastest), metres, table frame.
    pub cloud: SemanticCloud,
}

/// Encodes one chunk; the order of its voxels does not matter.
///
/// # Errors
/// [`WireError::Field`] for an empty chunk, a voxel edge that is no length, a voxel named twice or outside the chunk, or
/// a point outside its voxel.
pub fn encode(chunk: &VoxelChunk, epoch: u32, revision: u32) -> Result<Encoded, WireError> {
    ChunkEncoder::default().encode(chunk, epoch, revision)
}

/// Decodes one chunk, which may come from anywhere.
///
/// # Errors
/// [`WireError::Field`] naming the field for anything [`encode`] would not have made.
pub fn decode(update: &ChunkUpdate) -> Result<DecodedChunk, WireError> {
    ChunkDecoder::default().decode(update)
}

/// Encodes chunk after chunk without allocating anew.
#[derive(Debug, Default)]
pub struct ChunkEncoder {
    planes: Planes,
    octree: Octree,
    neighbours: Neighbours,
    stream: RansEncoder,
}

impl ChunkEncoder {
    /// See [`encode`].
    ///
    /// # Errors
    /// As [`encode`].
    pub fn encode(&mut self, chunk: &VoxelChunk, epoch: u32, revision: u32) -> Result<Encoded, WireError> {
        let grid = Grid::new(chunk.id, chunk.voxel)?;
        self.planes.quantize(chunk)?;
        let hash = self.planes.hash(chunk.id);
        self.octree.code(&mut self.stream, &mut self.planes.cells);
        attributes::code(&mut self.stream, &mut self.planes, &mut self.neighbours);
        let mut columns = Vec::with_capacity(HEADER);
        columns.push(FORMAT);
        columns.extend_from_slice(&(hash as u32).to_le_bytes());
        self.stream.finish(&mut columns);
        let [origin_x, origin_y, origin_z] = grid.origin();
        let update = ChunkUpdate {
            epoch,
            id: Some(ChunkId::from_array(chunk.id)),
            revision,
            origin_x,
            origin_y,
            origin_z,
            scale: grid.scale(),
            points: self.planes.len() as u32,
            columns: columns.into(),
        };
        Ok(Encoded { update, hash })
    }
}

/// Decodes chunk after chunk without allocating anew.
#[derive(Debug, Default)]
pub struct ChunkDecoder {
    planes: Planes,
    octree: Octree,
    neighbours: Neighbours,
}

impl ChunkDecoder {
    /// See [`decode`].
    ///
    /// # Errors
    /// As [`decode`].
    pub fn decode(&mut self, update: &ChunkUpdate) -> Result<DecodedChunk, WireError> {
        let id = update.id.ok_or_else(|| refuse("id", "missing"))?.to_array();
        let points = update.points as usize;
        if !(1..=CELLS).contains(&points) {
            return Err(refuse("points", format!("{points} is not in 1..={CELLS}")));
        }
        let origin = [update.origin_x, update.origin_y, update.origin_z];
        if !origin.iter().all(|c| c.is_finite()) {
            return Err(refuse("origin", format!("{origin:?} is not finite")));
        }
        let scale = update.scale;
        let voxel = scale * QUANTA_PER_VOXEL as f32;
        if !(voxel.is_finite() && scale > 0.0) {
            return Err(refuse("scale", format!("{scale} is not a length in metres")));
        }
        let Some((&[format, ref check @ ..], stream)) = update.columns.split_first_chunk::<HEADER>() else {
            return Err(refuse("columns", format!("only {} bytes", update.columns.len())));
        };
        if format != FORMAT {
            return Err(refuse("columns", format!("format {format}, this side knows {FORMAT}")));
        }
        let mut stream = RansDecoder::new(stream).ok_or_else(|| refuse("columns", "no entropy-coded stream"))?;
        self.planes.resize(0);
        self.octree.code(&mut stream, &mut self.planes.cells);
        if self.planes.len() != points {
            return Err(refuse("columns", format!("{} voxels, announced {points}", self.planes.len())));
        }
        self.planes.resize(points);
        attributes::code(&mut stream, &mut self.planes, &mut self.neighbours);
        if !stream.at_end() {
            return Err(refuse("columns", "damaged or truncated"));
        }
        if self.planes.inner.as_flattened().iter().any(|&q| i32::from(q) >= QUANTA_PER_VOXEL) {
            return Err(refuse("columns", "a point outside its voxel"));
        }
        let hash = self.planes.hash(id);
        if (hash as u32).to_le_bytes() != *check {
            return Err(refuse("columns", "content does not match its hash"));
        }
        let cloud = self.planes.restore(origin, scale);
        Ok(DecodedChunk { id, revision: update.revision, epoch: update.epoch, voxel, hash, cloud })
    }
}

/// Hash of a whole model from its chunks' coordinates and hashes, whatever their order; two sides that hold the same
/// chunks get the same figure.
pub fn model_hash(chunks: impl IntoIterator<Item = ([i32; 3], u64)>) -> u64 {
    let mut sorted: Vec<_> = chunks.into_iter().collect();
    sorted.sort_unstable();
    let bytes: Vec<u8> = sorted
        .iter()
        .flat_map(|(id, hash)| id.iter().flat_map(|c| c.to_le_bytes()).chain(hash.to_le_bytes()))
        .collect();
    xxh3_64(&bytes)
}

/// How many bytes of [`encode`]'s stream each plane takes (ideal code length), for measuring.
///
/// # Errors
/// As [`encode`].
pub fn plane_sizes(chunk: &VoxelChunk) -> Result<std::collections::BTreeMap<Plane, f64>, WireError> {
    let mut planes = Planes::default();
    planes.quantize(chunk)?;
    let mut meter = model::Meter::new();
    Octree::default().code(&mut meter, &mut planes.cells);
    attributes::code(&mut meter, &mut planes, &mut Neighbours::default());
    Ok(meter.bits.into_iter().map(|(plane, bits)| (plane, bits / 8.0)).collect())
}
