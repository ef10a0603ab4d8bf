//! What is already known around a point: the voxels before it in raster order.

use super::QUANTA_PER_VOXEL;
use super::octahedral;
use super::planes::Planes;

/// Lanes of a [`Record`]; sums of at most 25 times their values stay within 16 bits.
pub(super) const LANES: usize = 16;
/// First lanes of the columns in a record.
pub(super) const COLOR: usize = 0;
/// Octahedral normal.
pub(super) const NORMAL: usize = 3;
/// Position in quanta, relative to the voxel of the point that is being coded.
pub(super) const INNER: usize = 5;
/// Shares.
pub(super) const SHARES: usize = 8;
/// Number of views, at most [`MANY_VIEWS`].
pub(super) const VIEWS: usize = 12;

/// Views beyond this do not count in a prediction.
const MANY_VIEWS: u16 = 1000;

/// What of a point helps to predict others, one lane a number, so that sums are a few SIMD instructions.
pub(super) type Record = [i16; LANES];

/// Nodes along an edge of the index grid: a chunk and a border of one.
const STRIDE: usize = 34;

/// A neighbour that comes earlier in raster order: its distance back in the grid, its weight in predictions and what
/// to add to its record to see it from the point that is being coded.
struct Earlier {
    back: usize,
    weight: i16,
    shift: Record,
}

const EARLIER: [Earlier; 13] = {
    let offsets: [[i16; 3]; 13] = [
        [-1, 0, 0],
        [0, -1, 0],
        [0, 0, -1],
        [-1, -1, 0],
        [1, -1, 0],
        [-1, 0, -1],
        [1, 0, -1],
        [0, -1, -1],
        [0, 1, -1],
        [-1, -1, -1],
        [1, -1, -1],
        [-1, 1, -1],
        [1, 1, -1],
    ];
    let mut earlier = [const { Earlier { back: 0, weight: 0, shift: [0; LANES] } }; 13];
    let mut k = 0;
    while k < 13 {
        let [x, y, z] = offsets[k];
        let stride = STRIDE as i16;
        earlier[k].back = -((z * stride + y) * stride + x) as usize;
        // Faces 3, edges 2, corners 1.
        earlier[k].weight = 4 - x.abs() - y.abs() - z.abs();
        let mut axis = 0;
        while axis < 3 {
            earlier[k].shift[INNER + axis] = offsets[k][axis] * QUANTA_PER_VOXEL as i16;
            axis += 1;
        }
        k += 1;
    }
    earlier
};

/// 2^16 over each possible sum of weights, rounded up, so that a mean is a multiplication.
const RECIPROCALS: [i32; 26] = {
    let mut reciprocals = [0; 26];
    let mut w = 1;
    while w < 26 {
        reciprocals[w as usize] = ((1 << 16) + w - 1) / w;
        w += 1;
    }
    reciprocals
};

/// Which points of a chunk lie where.
#[derive(Debug)]
pub(super) struct Neighbours {
    /// One more than the index of each voxel's point, 0 where there is none.
    index: Vec<u16>,
    records: Vec<Record>,
}

/// The known surroundings of one point.
#[derive(Debug)]
pub(super) struct Surroundings {
    /// Number of known neighbours.
    pub(super) count: usize,
    /// Index of the nearest one; without any, that of the point before.
    pub(super) nearest: Option<usize>,
    /// Whether all known neighbours bear the same label, defect, instance and flags.
    pub(super) uniform: bool,
    /// Weighted mean of the records, or the record of the point before.
    pub(super) mean: Record,
    /// Largest less smallest value in each lane.
    pub(super) spread: Record,
    /// Sum of weights.
    pub(super) weight: i16,
    /// Whether the face neighbours below and above along each axis are occupied.
    pub(super) faces: [[bool; 2]; 3],
}

impl Default for Neighbours {
    fn default() -> Self {
        Self { index: vec![0; STRIDE * STRIDE * STRIDE], records: Vec::new() }
    }
}

impl Neighbours {
    /// Begins a chunk whose occupied cells are known.
    pub(super) fn begin(&mut self, cells: &[u16]) {
        self.index.fill(0);
        self.records.clear();
        for (i, &cell) in cells.iter().enumerate() {
            self.index[at(cell)] = i as u16 + 1;
        }
    }

    /// What is known around point `i`: all points below `i` have been [added](Self::add).
    pub(super) fn around(&self, planes: &Planes, i: usize) -> Surroundings {
        let here = at(planes.cells[i]);
        let (mut sum, mut low, mut high) = ([0_i16; LANES], [i16::MAX; LANES], [i16::MIN; LANES]);
        let (mut count, mut weight, mut uniform) = (0, 0, true);
        let mut nearest = None;
        // Which are occupied is as good as random: one pass without a branch, then only those that are.
        let mut found = 0_u32;
        for (k, earlier) in EARLIER.iter().enumerate() {
            found |= u32::from(self.index[here - earlier.back] != 0) << k;
        }
        while found != 0 {
            let earlier = &EARLIER[found.trailing_zeros() as usize];
            found &= found - 1;
            let j = usize::from(self.index[here - earlier.back]) - 1;
            let record = &self.records[j];
            for lane in 0..LANES {
                let value = record[lane] + earlier.shift[lane];
                sum[lane] += earlier.weight * value;
                low[lane] = low[lane].min(value);
                high[lane] = high[lane].max(value);
            }
            weight += earlier.weight;
            count += 1;
            uniform &= planes.marks[*nearest.get_or_insert(j)] == planes.marks[j];
        }
        let mut mean = self.records.last().copied().unwrap_or_default();
        let mut spread = [0; LANES];
        if count > 0 {
            let reciprocal = RECIPROCALS[usize::from(weight.unsigned_abs())];
            for lane in 0..LANES {
                let rounded = i32::from(sum[lane]) + i32::from(weight / 2);
                mean[lane] = ((rounded * reciprocal) >> 16) as i16;
                spread[lane] = high[lane] - low[lane];
            }
        }
        let occupied = |at: usize| self.index[at] != 0;
        let pair = |step: usize| [occupied(here - step), occupied(here + step)];
        Surroundings {
            count,
            nearest: nearest.or(i.checked_sub(1)),
            uniform,
            mean,
            spread,
            weight,
            faces: [pair(1), pair(STRIDE), pair(STRIDE * STRIDE)],
        }
    }

    /// Adds point `i`, of which everything is known now.
    pub(super) fn add(&mut self, planes: &Planes, i: usize, around: &Surroundings) {
        // An unknown normal is guessed, so that it does not spoil the prediction of known ones.
        let mut record = around.mean;
        let wide = |v: u8| i16::from(v);
        record[COLOR..COLOR + 3].copy_from_slice(&planes.colors[i].map(wide));
        if planes.normals[i] != octahedral::UNKNOWN {
            record[NORMAL..NORMAL + 2].copy_from_slice(&planes.normals[i].map(wide));
        }
        record[INNER..INNER + 3].copy_from_slice(&planes.inner[i].map(wide));
        record[SHARES..SHARES + 4].copy_from_slice(&planes.shares[i].map(wide));
        record[VIEWS] = planes.views[i].min(MANY_VIEWS) as i16;
        self.records.push(record);
    }
}

fn at(cell: u16) -> usize {
    let [x, y, z] = [cell & 31, cell >> 5 & 31, cell >> 10].map(usize::from);
    ((z + 1) * STRIDE + y + 1) * STRIDE + x + 1
}
