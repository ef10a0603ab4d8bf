//! Noisy surfaces made thin: where depth noise is as large as a voxel, pixels of one surface fall into several layers of
//! voxels, and a mesh of them is torn and lies too near to the camera. Each voxel of such a place moves along the normal
//! to the weighted mean of its surface, and what then lies in one voxel becomes one, with the evidence of all.
//!
//! This is a projection on a moving least-squares surface of order zero [Alexa 2003], along the mean normal and with the
//! window moved until it is centred on the mean [Comaniciu 2002]. Where noise is small against a voxel nothing moves:
//! details of the size of a voxel stay.

use super::brick::Voxel;
use super::keys::{BRICK_EDGE, BrickKey, local_index, pack_brick, within_brick};
use super::map::SemanticMap;
use rayon::prelude::*;
use semascan_geometry::grid::{coarser, floor};
use semascan_geometry::vector::{dot, unit};
use semascan_model::PointFlags;
use std::collections::BTreeSet;

/// Depth noise from which a brick's surfaces are noisy, voxels.
const NOISY: f32 = 0.4;
/// Half the height of the window, in deviations of the depth noise. Errors of poses add to that noise.
const DEVIATIONS: f32 = 6.0;
/// Most voxels that the window reaches up and down a column: it stays within the bricks that touch the block.
const REACH: i32 = BRICK_EDGE;
/// Half the width of the window, voxels.
const WIDTH: i32 = 2;
/// How often the window is centred anew.
const ROUNDS: usize = 3;
/// Least cosine between normals of one surface.
const SAME_SURFACE: f32 = 0.5;

/// Bricks along an edge of a block.
const BLOCK: i32 = 2;
/// The same with the bricks around it.
const SPAN: i32 = BLOCK + 2;
/// Cells along an edge of the block with the bricks around it.
const SIDE: i32 = SPAN * BRICK_EDGE;

/// Mark of an empty cell.
const EMPTY: u32 = u32::MAX;

/// A voxel as its neighbours see it.
#[derive(Clone, Copy, Debug)]
struct Member {
    /// Mean point, voxels from the lowest corner of the bricks around the block.
    point: [f32; 3],
    /// Unit normal.
    normal: [f32; 3],
    weight: f32,
}

/// A block of bricks and the bricks that touch it, cell by cell.
#[derive(Debug)]
struct Neighbourhood {
    /// Lowest brick.
    lowest: [i32; 3],
    /// Place in `members` of the voxel in each cell.
    cells: Vec<u32>,
    members: Vec<Member>,
    /// Members in the window under way: step from the voxel's point, normal, weight.
    window: Vec<Member>,
}

impl SemanticMap {
    /// Makes noisy surfaces thin; returns the chunks that changed, in order: none where no surface is noisy. Views can be
    /// integrated afterwards as before.
    pub(super) fn consolidate(&mut self) -> Vec<[i32; 3]> {
        let steps = self.steps();
        if steps.iter().all(Vec::is_empty) {
            return Vec::new();
        }
        let classes = self.config.components + self.config.defects;
        let views = self.views;
        let keys = std::mem::take(&mut self.keys);
        let mut bricks = std::mem::take(&mut self.bricks);
        self.index.clear();
        let mut changed = BTreeSet::new();
        // Bricks of which nothing moves stay as they are, and are there when voxels of others arrive.
        for ((key, brick), steps) in keys.iter().zip(&mut bricks).zip(&steps) {
            if steps.is_empty() {
                let at = self.place_of(*key);
                self.bricks[at] = std::mem::take(brick);
            }
        }
        for ((key, brick), steps) in keys.iter().zip(bricks).zip(&steps).filter(|(_, steps)| !steps.is_empty()) {
            changed.insert(key.chunk());
            for (slot, (voxel, step)) in brick.voxels.iter().zip(steps).enumerate() {
                let (address, moved) = moved(voxel, key.voxel(voxel.local), *step);
                let target = BrickKey::containing(address);
                let at = self.place_of(target);
                let (merged, evidence, _) = self.bricks[at].entry(local_index(address), classes);
                merged.absorb(&moved, views);
                for (sum, of_voxel) in evidence.iter_mut().zip(brick.evidence(slot, classes)) {
                    *sum += of_voxel;
                }
                let (components, defects) = evidence.split_at(self.config.components);
                merged.decide(components, defects);
                changed.insert(target.chunk());
            }
        }
        changed.into_iter().collect()
    }

    /// How far each voxel of each brick moves, voxels; nothing for bricks whose surfaces are not noisy.
    fn steps(&self) -> Vec<Vec<[f32; 3]>> {
        let noise: Vec<f32> = self.bricks.iter().map(|brick| brick.noise() / self.config.voxel as f32).collect();
        let block = |at: u32| coarser(self.keys[at as usize].0, BLOCK);
        let mut noisy: Vec<u32> = (0..self.bricks.len() as u32).filter(|&at| noise[at as usize] > NOISY).collect();
        noisy.par_sort_unstable_by_key(|&at| (block(at), at));
        let blocks: Vec<&[u32]> = noisy.chunk_by(|&a, &b| block(a) == block(b)).collect();
        let by_block: Vec<Vec<(u32, Vec<[f32; 3]>)>> = blocks
            .par_iter()
            .map_init(Neighbourhood::default, |around, bricks| {
                around.read(self, block(bricks[0]));
                let steps = |&at: &u32| {
                    let brick = &self.bricks[at as usize];
                    let step = |voxel: &Voxel| around.step(self.keys[at as usize], voxel.local, noise[at as usize]);
                    (at, brick.voxels.iter().map(step).collect())
                };
                bricks.iter().map(steps).collect()
            })
            .collect();
        let mut all = vec![Vec::new(); self.bricks.len()];
        for (at, steps) in by_block.into_iter().flatten() {
            all[at as usize] = steps;
        }
        all
    }
}

impl Default for Neighbourhood {
    fn default() -> Self {
        let cells = vec![EMPTY; (SIDE * SIDE * SIDE) as usize];
        Self { lowest: [0; 3], cells, members: Vec::new(), window: Vec::new() }
    }
}

impl Neighbourhood {
    /// Lays out `block` and what touches it. Flying pixels and voxels without a normal are no part of a surface.
    fn read(&mut self, map: &SemanticMap, block: [i32; 3]) {
        self.cells.fill(EMPTY);
        self.members.clear();
        self.lowest = block.map(|c| c * BLOCK - 1);
        for i in 0..SPAN * SPAN * SPAN {
            let step = [i / (SPAN * SPAN), i / SPAN % SPAN, i % SPAN];
            let Some(&at) = map.index.get(&BrickKey(std::array::from_fn(|a| self.lowest[a] + step[a]))) else {
                continue;
            };
            for voxel in map.bricks[at].voxels.iter().filter(|v| !v.flags.has(PointFlags::EDGE)) {
                let Some(normal) = unit(voxel.normal, 1e-6) else { continue };
                let within = within_brick(voxel.local).map(i32::from);
                let cell = [0, 1, 2].map(|a| step[a] * BRICK_EDGE + within[a]);
                let point = [0, 1, 2].map(|a| cell[a] as f32 + voxel.offset[a] / voxel.weight);
                self.cells[number(cell)] = self.members.len() as u32;
                self.members.push(Member { point, normal, weight: voxel.weight });
            }
        }
    }

    /// How far the voxel at `local` in `brick` moves where depth noise has a deviation of `noise` voxels.
    fn step(&mut self, brick: BrickKey, local: u16, noise: f32) -> [f32; 3] {
        let within = within_brick(local).map(i32::from);
        let cell = [0, 1, 2].map(|a| (brick.0[a] - self.lowest[a]) * BRICK_EDGE + within[a]);
        let Some(own) = self.members.get(self.cells[number(cell)] as usize).copied() else { return [0.0; 3] };
        // The window is a prism of columns along the axis that the surface faces most.
        let steepness = own.normal.map(f32::abs);
        let column = semascan_geometry::vote::largest(&steepness, f32::MIN);
        let height = DEVIATIONS * noise;
        let reach = ((height / steepness[column]).ceil() as i32).clamp(1, REACH);
        self.window.clear();
        let mut normal = [0.0; 3];
        for i in -WIDTH..=WIDTH {
            for j in -WIDTH..=WIDTH {
                let mut at = cell;
                at[(column + 1) % 3] += i;
                at[(column + 2) % 3] += j;
                for k in -reach..=reach {
                    at[column] = cell[column] + k;
                    let Some(member) = self.members.get(self.cells[number(at)] as usize) else { continue };
                    if dot(member.normal, own.normal) < SAME_SURFACE {
                        continue;
                    }
                    let step = [0, 1, 2].map(|a| member.point[a] - own.point[a]);
                    self.window.push(Member { point: step, ..*member });
                    for (sum, along) in normal.iter_mut().zip(member.normal) {
                        *sum += member.weight * along;
                    }
                }
            }
        }
        let Some(normal) = unit(normal, 0.0) else { return [0.0; 3] };
        let mut mean = 0.0;
        for _ in 0..ROUNDS {
            let (mut weight, mut sum) = (0.0, 0.0);
            for member in &self.window {
                let off = dot(normal, member.point);
                if (off - mean).abs() <= height {
                    weight += member.weight;
                    sum += member.weight * off;
                }
            }
            if weight <= 0.0 {
                break;
            }
            mean = sum / weight;
        }
        normal.map(|along| along * mean.clamp(-height, height))
    }
}

/// Number of a cell of the neighbourhood.
#[inline]
fn number(cell: [i32; 3]) -> usize {
    ((cell[0] * SIDE + cell[1]) * SIDE + cell[2]) as usize
}

/// The voxel at `address` moved by `step` voxels: its new address and its sums there.
fn moved(voxel: &Voxel, address: [i32; 3], step: [f32; 3]) -> ([i32; 3], Voxel) {
    let point = [0, 1, 2].map(|a| voxel.offset[a] / voxel.weight + step[a]);
    let lowest = point.map(floor);
    let target = [0, 1, 2].map(|a| address[a] + lowest[a]);
    if pack_brick(BrickKey::containing(target).0).is_none() {
        return (address, *voxel);
    }
    let offset = [0, 1, 2].map(|a| (point[a] - lowest[a] as f32) * voxel.weight);
    (target, Voxel { offset, local: local_index(target), ..*voxel })
}
