//! The mesher: keeps the points of a model by chunk and the mesh by tile, and computes anew only what a change reaches.

use super::assemble::assemble;
use super::field::Kernel;
use super::options::{MeshError, MeshOptions};
use super::points::{Points, cut};
use super::progress::Progress;
use super::threads::map_with;
use super::tile::{TileMesh, Workspace, mesh_tile};
use super::working_grid::{HALO, TILE_EDGE};
use crate::grid::coarser;
use semascan_model::{SemanticCloud, SemanticMesh};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Voxels along an edge of a chunk of the map.
use semascan_model::CHUNK_EDGE;

/// Turns a growing semantic model into a mesh, tile by tile.
///
/// Give it chunks as they change ([`set_chunk`](Self::set_chunk)), let it compute ([`update`](Self::update), or
/// [`step`](Self::step) between other work), take the mesh ([`mesh`](Self::mesh)). What comes out depends on the points
/// alone: not on the order or number of changes, nor on threads.
#[derive(Debug)]
pub struct Mesher {
    options: MeshOptions,
    /// Voxel edge in metres.
    voxel: f64,
    chunks: BTreeMap<[i32; 3], Points>,
    tiles: BTreeMap<[i32; 3], TileMesh>,
    pending: BTreeSet<[i32; 3]>,
}

impl Mesher {
    /// A mesher for a map with voxels of edge `voxel` (metres).
    ///
    /// # Errors
    /// [`MeshError::Voxel`] or [`MeshError::Options`] if a setting is out of range.
    pub fn new(voxel: f32, options: MeshOptions) -> Result<Self, MeshError> {
        if !(voxel.is_finite() && voxel > 0.0) {
            return Err(MeshError::Voxel { voxel });
        }
        options.check()?;
        let (chunks, tiles, pending) = Default::default();
        Ok(Self { options, voxel: voxel.into(), chunks, tiles, pending })
    }

    /// Metres a grid cell.
    fn pitch(&self) -> f64 {
        self.voxel * f64::from(self.options.pitch)
    }

    /// Kernel radius in grid cells.
    fn radius(&self) -> f32 {
        self.options.radius / self.options.pitch
    }

    /// Replaces the points of the chunk `id` (32^3 voxels of the map); an empty cloud removes it. Points more than a
    /// voxel outside of the chunk are not meshed reliably.
    pub fn set_chunk(&mut self, id: [i32; 3], cloud: &SemanticCloud) {
        let points = Points::new(cloud.iter(), self.pitch(), self.options.skip_flags);
        self.set(id, points);
    }

    /// Replaces the whole model.
    pub fn set_cloud(&mut self, cloud: &SemanticCloud) {
        let (pitch, skip) = (self.pitch(), self.options.skip_flags);
        let cut = cut(cloud, self.voxel * f64::from(CHUNK_EDGE), skip);
        let made = map_with(&cut, |(): &mut (), (id, indices)| {
            (*id, Points::new(indices.iter().filter_map(|&i| cloud.get(i as usize)), pitch, skip))
        });
        let gone: Vec<_> = self.chunks.keys().copied().collect();
        for id in gone {
            self.set(id, Points::default());
        }
        for (id, points) in made {
            self.set(id, points);
        }
    }

    fn set(&mut self, id: [i32; 3], points: Points) {
        let before = if points.is_empty() { self.chunks.remove(&id) } else { self.chunks.insert(id, points) };
        let touched: Vec<_> = before.iter().chain(self.chunks.get(&id)).map(|p| (p.bounds, p.is_empty())).collect();
        let reach = self.radius().ceil() as i32 + HALO + 1;
        for ([low, high], _) in touched.into_iter().filter(|(_, empty)| !empty) {
            let first = coarser(low.map(|c| c - reach), TILE_EDGE);
            let last = coarser(high.map(|c| c + reach), TILE_EDGE);
            for x in first[0]..=last[0] {
                for y in first[1]..=last[1] {
                    for z in first[2]..=last[2] {
                        self.pending.insert([x, y, z]);
                    }
                }
            }
        }
    }

    /// Tiles that must be computed anew.
    pub fn pending(&self) -> usize {
        self.pending.len()
    }

    /// Computes all that is pending.
    ///
    /// # Errors
    /// [`MeshError::Cancelled`] if `progress` says so; what was not computed stays pending.
    pub fn update(&mut self, progress: &dyn Progress) -> Result<(), MeshError> {
        self.advance(usize::MAX, progress)
    }

    /// Computes at most `tiles` of what is pending, for callers with one thread; returns what is left.
    pub fn step(&mut self, tiles: usize) -> usize {
        // Without anyone to cancel it this cannot fail.
        let _ = self.advance(tiles, &());
        self.pending.len()
    }

    fn advance(&mut self, most: usize, progress: &dyn Progress) -> Result<(), MeshError> {
        let work: Vec<[i32; 3]> = self.pending.iter().copied().take(most).collect();
        let (done, cancelled) = (AtomicUsize::new(0), AtomicBool::new(false));
        let kernel = Kernel { radius: self.radius(), gate: self.options.normal_gate };
        let made = map_with(&work, |workspace: &mut Workspace, &id| {
            if cancelled.load(Ordering::Relaxed) {
                return None;
            }
            let first = id.map(|c| c * TILE_EDGE);
            let tile = mesh_tile(workspace, first, &self.within_reach(first), kernel, self.pitch());
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if progress.advance(done, work.len()).is_break() {
                cancelled.store(true, Ordering::Relaxed);
            }
            Some(tile)
        });
        for (id, tile) in work.iter().zip(made) {
            let Some(tile) = tile else { continue };
            self.pending.remove(id);
            if tile.vertices.is_empty() && tile.quads.is_empty() {
                self.tiles.remove(id);
            } else {
                self.tiles.insert(*id, tile);
            }
        }
        if cancelled.into_inner() { Err(MeshError::Cancelled) } else { Ok(()) }
    }

    /// Chunks with points that a tile depends on, in order.
    fn within_reach(&self, first: [i32; 3]) -> Vec<&Points> {
        let reach = self.radius().ceil() as i32 + HALO + 1;
        // Chunks may be placed in another grid than tiles; a voxel of slack for points on the very edge of theirs.
        let ratio = f64::from(self.options.pitch) / f64::from(CHUNK_EDGE);
        let slack = 1.0 / f64::from(CHUNK_EDGE);
        let low = first.map(|c| (f64::from(c - reach) * ratio - slack).floor() as i32);
        let high = first.map(|c| (f64::from(c + TILE_EDGE + reach) * ratio + slack).floor() as i32);
        let rows = (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| (x, y)));
        let found = rows.flat_map(|(x, y)| self.chunks.range([x, y, low[2]]..=[x, y, high[2]]));
        found
            .map(|(_, points)| points)
            .filter(|points| {
                (0..3).all(|a| {
                    points.bounds[1][a] >= first[a] - reach && points.bounds[0][a] < first[a] + TILE_EDGE + reach
                })
            })
            .collect()
    }

    /// The mesh of all tiles computed so far, before smoothing, filling and simplification.
    pub fn mesh(&self) -> SemanticMesh {
        assemble(&self.tiles)
    }
}
