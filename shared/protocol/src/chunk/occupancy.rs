//! Which voxels hold a point: an octree of five levels, breadth first, so that a node's neighbours are known before
//! its children are coded (the idea of MPEG G-PCC's neighbour-dependent contexts, ISO/IEC 23090-9, cut down to what a
//! chunk of a few hundred points can learn).

use super::model::{Coder, Model, Plane};

/// Levels of nodes above the voxels: 1, 2, 4, 8 and 16 nodes along an edge.
const LEVELS: usize = 5;
/// Set in a node that has points; the low byte holds the children's mask.
const OCCUPIED: u16 = 1 << 8;

/// The octree of one chunk.
#[derive(Debug)]
pub(super) struct Octree {
    levels: [Level; LEVELS],
    /// Bit x of row `z * edge + y`: the occupied nodes of the level that is being coded, and of the next.
    rows: Vec<u32>,
    next_rows: Vec<u32>,
}

/// One level: nodes with a border of empty ones, so that neighbours need no bounds.
#[derive(Debug)]
struct Level {
    stride: usize,
    nodes: Vec<u16>,
}

impl Level {
    fn at(&self, x: usize, y: usize, z: usize) -> usize {
        ((z + 1) * self.stride + y + 1) * self.stride + x + 1
    }
}

impl Default for Octree {
    fn default() -> Self {
        let level = |depth: usize| {
            let stride = (1 << depth) + 2;
            Level { stride, nodes: vec![0; stride * stride * stride] }
        };
        Self { levels: std::array::from_fn(level), rows: Vec::new(), next_rows: Vec::new() }
    }
}

/// Models of the children's masks, each coded as two nibbles: the lower four children, then the upper four.
struct MaskModels {
    /// By the children of the node below that touch this one, and by how many of the four nodes beside are occupied.
    lower: [[Model; 3]; 16],
    /// By the lower four children and whether the node above is occupied.
    upper: [[Model; 2]; 16],
}

impl MaskModels {
    fn new() -> Self {
        let model = || Model::uniform(16);
        Self {
            lower: std::array::from_fn(|_| std::array::from_fn(|_| model())),
            upper: std::array::from_fn(|_| std::array::from_fn(|_| model())),
        }
    }
}

impl Octree {
    /// Codes the cells of a chunk, which are sorted; a decoder's `cells` are empty before.
    pub(super) fn code<C: Coder>(&mut self, coder: &mut C, cells: &mut Vec<u16>) {
        coder.enter(Plane::Occupancy);
        self.begin(cells);
        let mut models = MaskModels::new();
        for depth in 0..LEVELS {
            let edge = 1 << depth;
            self.next_rows.clear();
            self.next_rows.resize(4 * edge * edge, 0);
            let level = &mut self.levels[depth];
            for_each(&self.rows, edge, |x, y, z| {
                let at = level.at(x, y, z);
                level.nodes[at] |= OCCUPIED;
            });
            for_each(&self.rows, edge, |x, y, z| {
                let at = level.at(x, y, z);
                let mask = code_mask(coder, &mut models, level, at);
                level.nodes[at] = OCCUPIED | u16::from(mask);
                for pair in 0..4 {
                    let row = (2 * z + (pair >> 1)) * 2 * edge + 2 * y + (pair & 1);
                    self.next_rows[row] |= u32::from(mask >> (2 * pair) & 3) << (2 * x);
                }
            });
            std::mem::swap(&mut self.rows, &mut self.next_rows);
        }
        cells.clear();
        for_each(&self.rows, 1 << LEVELS, |x, y, z| cells.push((z << 10 | y << 5 | x) as u16));
    }

    /// Empties the tree and enters the masks that an encoder knows.
    fn begin(&mut self, cells: &[u16]) {
        for level in &mut self.levels {
            level.nodes.fill(0);
        }
        self.rows.clear();
        self.rows.push(1);
        for &cell in cells {
            let [x, y, z] = [cell & 31, cell >> 5 & 31, cell >> 10].map(usize::from);
            for (level, shift) in self.levels.iter_mut().zip((0..LEVELS).rev()) {
                let child = (z >> shift & 1) << 2 | (y >> shift & 1) << 1 | x >> shift & 1;
                let at = level.at(x >> shift >> 1, y >> shift >> 1, z >> shift >> 1);
                level.nodes[at] |= 1 << child;
            }
        }
    }
}

/// Calls `visit` with (x, y, z) of every set bit, x fastest.
fn for_each(rows: &[u32], edge: usize, mut visit: impl FnMut(usize, usize, usize)) {
    for (i, &row) in rows.iter().enumerate() {
        let mut left = row;
        while left != 0 {
            visit(left.trailing_zeros() as usize, i % edge, i / edge);
            left &= left - 1;
        }
    }
}

fn code_mask<C: Coder>(coder: &mut C, models: &mut MaskModels, level: &Level, at: usize) -> u8 {
    let mask = level.nodes[at] as u8;
    let known = |at: usize| usize::from(level.nodes[at] >> 8);
    let (row, layer) = (level.stride, level.stride * level.stride);
    let beside = known(at - 1) + known(at + 1) + known(at - row) + known(at + row);
    let below = usize::from(level.nodes[at - layer] as u8 >> 4);
    let lower = coder.symbol(&mut models.lower[below][[0, 0, 1, 2, 2][beside]], mask & 15);
    let upper = coder.symbol(&mut models.upper[usize::from(lower)][known(at + layer)], mask >> 4);
    upper << 4 | lower
}
