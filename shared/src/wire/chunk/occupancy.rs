//! Which voxels hold a point: an octree of five levels, breadth first, so that a node's neighbours are known before
//! its children are told (the idea of MPEG G-PCC's neighbour-dependent contexts, ISO/IEC 23090-9, cut down to what a
//! chunk of a few thousand points can learn).

use super::model::{Coder, Model, Plane};

/// Levels of nodes above the voxels: 1, 2, 4, 8 and 16 nodes along an edge.
const LEVELS: u32 = 5;
/// Set in a node that has points; the low byte holds the children's mask.
const OCCUPIED: u16 = 1 << 8;

/// One level: nodes with a border of empty ones, so that neighbours need no bounds.
#[derive(Clone, Debug)]
struct Level {
    stride: usize,
    nodes: Vec<u16>,
}

impl Level {
    fn new(depth: u32) -> Self {
        let stride = (1 << depth) + 2;
        Self {
            stride,
            nodes: vec![0; stride * stride * stride],
        }
    }

    fn at(&self, [x, y, z]: [usize; 3]) -> usize {
        ((z + 1) * self.stride + y + 1) * self.stride + x + 1
    }
}

/// Models of the children's masks, each told as two nibbles: the lower four children, then the upper four.
#[derive(Clone, Debug)]
struct MaskModels {
    lower: Vec<Model>,
    upper: Vec<Model>,
}

/// Codes the cells of a chunk, sorted; a decoder's `cells` are overwritten.
pub(super) fn code<C: Coder>(coder: &mut C, cells: &mut Vec<u16>) {
    coder.enter(Plane::Occupancy);
    let mut levels: Vec<Level> = (0..LEVELS).map(Level::new).collect();
    for &cell in cells.iter() {
        mark(
            &mut levels,
            [cell & 31, cell >> 5 & 31, cell >> 10].map(usize::from),
        );
    }
    let mut occupied = vec![[0, 0, 0]];
    let fresh = MaskModels {
        lower: vec![Model::uniform(16); 16 * 5],
        upper: vec![Model::uniform(16); 16 * 2],
    };
    let mut models = [fresh.clone(), fresh];
    for depth in 0..LEVELS {
        let level = &mut levels[depth as usize];
        let models = &mut models[usize::from(depth + 1 == LEVELS)];
        for &node in &occupied {
            let at = level.at(node);
            level.nodes[at] |= OCCUPIED;
        }
        let mut children = Vec::with_capacity(4 * occupied.len());
        for &node in &occupied {
            let mask = code_mask(coder, models, level, level.at(node));
            let at = level.at(node);
            level.nodes[at] = OCCUPIED | u16::from(mask);
            children.extend((0..8).filter(|b| mask >> b & 1 == 1).map(|b| {
                [
                    2 * node[0] + (b & 1),
                    2 * node[1] + (b >> 1 & 1),
                    2 * node[2] + (b >> 2),
                ]
            }));
        }
        children.sort_unstable_by_key(|&[x, y, z]| (z, y, x));
        occupied = children;
    }
    cells.clear();
    cells.extend(
        occupied
            .iter()
            .map(|&[x, y, z]| (z << 10 | y << 5 | x) as u16),
    );
}

fn mark(levels: &mut [Level], voxel: [usize; 3]) {
    for (depth, level) in (0..LEVELS).zip(levels) {
        let child = voxel.map(|c| c >> (LEVELS - 1 - depth) & 1);
        let at = level.at(voxel.map(|c| c >> (LEVELS - depth)));
        level.nodes[at] |= 1 << (child[2] << 2 | child[1] << 1 | child[0]);
    }
}

fn code_mask<C: Coder>(coder: &mut C, models: &mut MaskModels, level: &Level, at: usize) -> u8 {
    let mask = level.nodes[at] as u8;
    let known = |at: usize| level.nodes[at] >> 8;
    let (row, layer) = (level.stride, level.stride * level.stride);
    let sides = known(at - 1) + known(at + 1) + known(at - row) + known(at + row);
    let below = level.nodes[at - layer] as u8 >> 4;
    let lower_context = usize::from(below) * 5 + usize::from(sides);
    let lower = coder.symbol(&mut models.lower[lower_context], mask & 15);
    let upper_context = usize::from(lower) * 2 + usize::from(known(at + layer));
    let upper = coder.symbol(&mut models.upper[upper_context], mask >> 4);
    upper << 4 | lower
}
