//! What a chunk holds after quantization: integer columns in raster order (z slowest, x fastest). Encoder and decoder
//! agree on these, bit by bit, and so does the hash over them.

use super::{CHUNK_EDGE, QUANTA_PER_VOXEL, VoxelChunk, octahedral};
use crate::WireError;
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use xxhash_rust::xxh3::xxh3_64;

/// Voxels in a chunk, the most points it can hold.
pub(super) const CELLS: usize = (CHUNK_EDGE * CHUNK_EDGE * CHUNK_EDGE) as usize;

/// How far outside its voxel a point may lie, in voxels: rounding of f32, not more. Such a point is moved to the face.
const TOLERANCE: f64 = 1.0 / 64.0;

/// Columns of one chunk, all of one length.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Planes {
    /// `z << 10 | y << 5 | x` of each point's voxel; strictly increasing.
    pub(super) cells: Vec<u16>,
    /// Position inside the voxel in quanta, below 14 along each axis.
    pub(super) inner: Vec<[u8; 3]>,
    /// Octahedral normals.
    pub(super) normals: Vec<[u8; 2]>,
    /// sRGB.
    pub(super) colors: Vec<[u8; 3]>,
    /// Label, defect, instance, flags.
    pub(super) marks: Vec<[u16; 4]>,
    /// Confidence, defect confidence, sigma, defect sigma, in 1/255.
    pub(super) shares: Vec<[u8; 4]>,
    /// Numbers of views.
    pub(super) views: Vec<u16>,
}

impl Planes {
    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Makes every column `n` long, new entries zero.
    pub(super) fn resize(&mut self, n: usize) {
        self.cells.resize(n, 0);
        self.inner.resize(n, [0; 3]);
        self.normals.resize(n, [0; 2]);
        self.colors.resize(n, [0; 3]);
        self.marks.resize(n, [0; 4]);
        self.shares.resize(n, [0; 4]);
        self.views.resize(n, 0);
    }

    /// Quantizes the points of `chunk` into `self`, whatever their order.
    ///
    /// # Errors
    /// [`WireError::Field`] for a chunk that is empty, whose voxel edge is no length, that names a voxel twice or outside
    /// 0..32, or that has a point outside its voxel.
    pub(super) fn quantize(&mut self, chunk: &VoxelChunk) -> Result<(), WireError> {
        let grid = Grid::new(chunk.id, chunk.voxel)?;
        if chunk.voxels.is_empty() {
            return Err(refuse("voxels", "a chunk without points is sent as ChunkGone"));
        }
        let mut order = vec![u16::MAX; CELLS];
        for (i, ([x, y, z], _)) in chunk.voxels.iter().enumerate() {
            if [x, y, z].iter().any(|&&c| i32::from(c) >= CHUNK_EDGE) {
                return Err(refuse("voxels", format!("voxel [{x}, {y}, {z}] is outside the chunk")));
            }
            let cell = usize::from(*z) << 10 | usize::from(*y) << 5 | usize::from(*x);
            if order[cell] != u16::MAX {
                return Err(refuse("voxels", format!("voxel [{x}, {y}, {z}] comes twice")));
            }
            // No duplicates so far, hence i < CELLS < u16::MAX.
            order[cell] = i as u16;
        }
        self.resize(0);
        for (cell, &i) in order.iter().enumerate() {
            if let Some((index, point)) = chunk.voxels.get(usize::from(i)) {
                self.push(cell as u16, grid.inner(*index, point.position)?, point);
            }
        }
        Ok(())
    }

    fn push(&mut self, cell: u16, inner: [u8; 3], p: &SemanticPoint) {
        self.cells.push(cell);
        self.inner.push(inner);
        self.normals.push(octahedral::quantize(p.normal));
        self.colors.push(p.color);
        self.marks.push([p.label, p.defect, p.instance, p.flags.0]);
        // `as` saturates and makes 0 of NaN, which is what an unknown share is.
        let shares = [p.confidence, p.defect_confidence, p.sigma, p.defect_sigma];
        self.shares.push(shares.map(|s| (s * 255.0).round() as u8));
        self.views.push(p.views);
    }

    /// The points in metres: `origin + scale * quantum`.
    pub(super) fn restore(&self, origin: [f32; 3], scale: f32) -> SemanticCloud {
        let place = |(&cell, inner): (&u16, &[u8; 3])| {
            let index = [cell & 31, cell >> 5 & 31, cell >> 10];
            let quanta = |a: usize| f32::from(index[a] * QUANTA_PER_VOXEL as u16 + u16::from(inner[a]));
            [0, 1, 2].map(|a| origin[a] + scale * quanta(a))
        };
        let mark = |k: usize| self.marks.iter().map(|m| m[k]).collect();
        let share = |k: usize| self.shares.iter().map(|s| f32::from(s[k]) / 255.0).collect();
        SemanticCloud {
            positions: self.cells.iter().zip(&self.inner).map(place).collect(),
            normals: self.normals.iter().map(|&n| octahedral::restore(n)).collect(),
            colors: self.colors.clone(),
            labels: mark(0),
            confidence: share(0),
            defects: mark(1),
            defect_confidence: share(1),
            sigma: share(2),
            defect_sigma: share(3),
            instances: mark(2),
            views: self.views.clone(),
            flags: self.marks.iter().map(|m| PointFlags(m[3])).collect(),
        }
    }

    /// xxh3 of the chunk's coordinates and every column, little endian.
    pub(super) fn hash(&self, id: [i32; 3]) -> u64 {
        let mut bytes = Vec::with_capacity(16 + 26 * self.len());
        bytes.extend(id.iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend((self.len() as u32).to_le_bytes());
        bytes.extend(self.cells.iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend_from_slice(self.inner.as_flattened());
        bytes.extend_from_slice(self.normals.as_flattened());
        bytes.extend_from_slice(self.colors.as_flattened());
        bytes.extend(self.marks.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend_from_slice(self.shares.as_flattened());
        bytes.extend(self.views.iter().flat_map(|c| c.to_le_bytes()));
        xxh3_64(&bytes)
    }
}

/// Where the voxels of a chunk lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    id: [i32; 3],
    voxel: f64,
    voxels_per_metre: f64,
}

impl Grid {
    /// # Errors
    /// [`WireError::Field`] if `voxel` is not a positive, finite length.
    pub(super) fn new(id: [i32; 3], voxel: f32) -> Result<Self, WireError> {
        if voxel.is_finite() && voxel > 0.0 {
            {
                let voxel = f64::from(voxel);
                Ok(Self { id, voxel, voxels_per_metre: voxel.recip() })
            }
        } else {
            Err(refuse("voxel", format!("{voxel} is not a length in metres")))
        }
    }

    /// Metres a quantum.
    pub(super) fn scale(&self) -> f32 {
        (self.voxel / f64::from(QUANTA_PER_VOXEL)) as f32
    }

    /// Centre of the chunk's first quantum, metres.
    pub(super) fn origin(&self) -> [f32; 3] {
        let half = 0.5 / f64::from(QUANTA_PER_VOXEL);
        self.id.map(|c| ((f64::from(c) * f64::from(CHUNK_EDGE) + half) * self.voxel) as f32)
    }

    fn inner(&self, index: [u8; 3], position: [f32; 3]) -> Result<[u8; 3], WireError> {
        let mut inner = [0; 3];
        for a in 0..3 {
            let corner = f64::from(self.id[a]) * f64::from(CHUNK_EDGE) + f64::from(index[a]);
            let fraction = f64::from(position[a]) * self.voxels_per_metre - corner;
            if !(-TOLERANCE..=1.0 + TOLERANCE).contains(&fraction) {
                let reason = format!("{position:?} is outside voxel {index:?} of chunk {:?}", self.id);
                return Err(refuse("position", reason));
            }
            // `as` truncates, and saturates below zero.
            inner[a] = ((fraction * f64::from(QUANTA_PER_VOXEL)) as u8).min(QUANTA_PER_VOXEL as u8 - 1);
        }
        Ok(inner)
    }
}

/// A refusal that names the field.
pub(super) fn refuse(field: &'static str, reason: impl Into<String>) -> WireError {
    WireError::Field { field, reason: reason.into() }
}
