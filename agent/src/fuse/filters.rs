//! Outlier filters (P0 step 4): radius, statistical and noise. They mark, exports choose.
//!
//! The noise filter is for what a voxel map makes of noisy pixels: they miss the voxel of their surface and found one of
//! their own beside it, where nothing averages them. Such a voxel is known by its small weight next to heavy ones and by
//! lying off their surface by no more than its own noise explains. A second surface that was measured well is neither.
//!
//! Every voxel is surveyed, so a block of bricks with its surroundings is laid out once as a small dense grid: which
//! cells are occupied, as bits along z, and where their mean points lie. A voxel's neighbours are then found without any
//! look-up by address.

use super::brick::Voxel;
use super::keys::{BRICK_EDGE, BrickKey};
use super::map::SemanticMap;
use super::merge::SYSTEMATIC;
use rayon::prelude::*;
use semascan_shared::model::PointFlags;
use std::collections::BTreeSet;

/// Largest radius: what the surroundings of a brick hold.
const LARGEST_RADIUS: i32 = 4;
/// Bricks along an edge of a block.
const BLOCK: i32 = 2;
/// Cells along an edge of a block and its surroundings; the bits of a column.
const SIDE: usize = (BLOCK * BRICK_EDGE + 2 * LARGEST_RADIUS) as usize;
/// Most nearest neighbours that count.
const MOST_NEIGHBOURS: usize = 16;

/// Steps from a cell, the near ones first.
const OUTWARDS: [isize; 2 * LARGEST_RADIUS as usize + 1] = [0, -1, 1, -2, 2, -3, 3, -4, 4];

/// Settings of the outlier filters, distances in voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierFilter {
    /// Both filters: neighbourhood half edge in voxels, 1 to 4.
    pub radius: i32,
    /// Radius filter: fewest occupied neighbours of a good voxel.
    pub min_neighbours: u32,
    /// Statistical filter: nearest neighbours that count, up to 16.
    pub neighbours: usize,
    /// Statistical filter: standard deviations above the mean neighbour distance.
    pub deviations: f64,
    /// Noise filter: how much more a neighbour must weigh to speak of the surface.
    pub heavier: f32,
    /// Noise filter: least distance off that surface, voxels.
    pub off_surface: f32,
}

impl Default for OutlierFilter {
    fn default() -> Self {
        Self { radius: 2, min_neighbours: 6, neighbours: 8, deviations: 3.0, heavier: 3.0, off_surface: 0.2 }
    }
}

/// What a voxel's neighbourhood looks like.
#[derive(Clone, Copy)]
struct Survey {
    /// Occupied neighbours within the radius.
    neighbours: u32,
    /// Mean distance of the nearest of them, voxels.
    distance: f32,
    /// Whether it is a noisy double of a better known surface.
    double: bool,
}

/// Of each voxel of a brick; `None` for background.
type Surveys = Vec<Option<Survey>>;

/// What a cell of the surroundings holds.
#[derive(Clone, Copy, Default)]
struct Cell {
    /// Mean point, voxels.
    point: [f32; 3],
    /// Unit normal or zero.
    normal: [f32; 3],
    weight: f32,
}

/// Neighbours farther than this, in voxels, do not speak of the surface at a voxel.
const NEAR: f32 = 2.0;
/// Fewest heavy neighbours that make a surface.
const SURFACE: u32 = 2;
/// Standard deviations that noise explains.
const EXPLAINED: f32 = 5.0;

/// A block of bricks and what is around it. Cells are addressed from `LARGEST_RADIUS` before the block's lowest voxel.
struct Surroundings {
    /// Occupied cells of each column along z, as bits.
    columns: Box<[[u32; SIDE]; SIDE]>,
    /// Valid where occupied.
    cells: Vec<Cell>,
    /// Deviation of a voxel of weight 1, voxels.
    unit_sigma: f32,
}

impl SemanticMap {
    /// Sets the outlier flags of every voxel of the measuring volume anew; returns the chunks whose flags changed, in
    /// order. What lies outside is background, which nothing asks about.
    pub fn mark_outliers(&mut self, filter: &OutlierFilter) -> Vec<[i32; 3]> {
        let filter = &OutlierFilter {
            radius: filter.radius.clamp(1, LARGEST_RADIUS),
            neighbours: filter.neighbours.clamp(1, MOST_NEIGHBOURS),
            ..*filter
        };
        let surveyed = self.survey(filter);
        // Summed brick by brick, so that the limit is the same on any number of threads.
        let moments = |power: i32, centre: f64| -> f64 {
            let one = |s: &Survey| (f64::from(s.distance) - centre).powi(power);
            let brick = |b: &Surveys| b.iter().flatten().map(one).sum::<f64>();
            surveyed.par_iter().map(brick).collect::<Vec<_>>().into_iter().sum()
        };
        let count = moments(0, 0.0).max(1.0);
        let mean = moments(1, 0.0) / count;
        let limit = (mean + filter.deviations * (moments(2, mean) / count).sqrt()) as f32;

        let changed: Vec<bool> = self
            .bricks
            .par_iter_mut()
            .zip(surveyed)
            .map(|(brick, surveys)| {
                let mut changed = false;
                for (voxel, survey) in brick.voxels.iter_mut().zip(surveys) {
                    let Some(Survey { neighbours, distance, double }) = survey else { continue };
                    let sparse = u16::from(neighbours < filter.min_neighbours) * PointFlags::RADIUS_OUTLIER;
                    let far = u16::from(distance > limit) * PointFlags::STATISTICAL_OUTLIER;
                    let noise = u16::from(double) * PointFlags::NOISE;
                    let set_here = PointFlags::RADIUS_OUTLIER | PointFlags::STATISTICAL_OUTLIER | PointFlags::NOISE;
                    let now = PointFlags(voxel.flags.0 & !set_here | sparse | far | noise);
                    changed |= now != voxel.flags;
                    voxel.flags = now;
                }
                changed
            })
            .collect();
        let chunks: BTreeSet<[i32; 3]> =
            self.keys.iter().zip(changed).filter(|(_, changed)| *changed).map(|(key, _)| key.chunk()).collect();
        chunks.into_iter().collect()
    }
}

impl SemanticMap {
    /// The neighbourhood of every voxel that is not background, brick by brick in the order of the map.
    fn survey(&self, filter: &OutlierFilter) -> Vec<Surveys> {
        let block = |at: u32| self.keys[at as usize].0.map(|c| c.div_euclid(BLOCK));
        let mut order: Vec<u32> = (0..self.bricks.len() as u32).collect();
        order.par_sort_unstable_by_key(|&at| (block(at), at));
        let blocks: Vec<&[u32]> = order.chunk_by(|&a, &b| block(a) == block(b)).collect();
        let by_block: Vec<Vec<(u32, Surveys)>> = blocks
            .par_iter()
            .map_init(
                || Surroundings::new(SYSTEMATIC / self.config.voxel as f32),
                |around, bricks| {
                    let lowest = block(bricks[0]).map(|c| c * BLOCK);
                    let asked = |v: &Voxel| !v.flags.has(PointFlags::BACKGROUND);
                    if !bricks.iter().any(|&at| self.bricks[at as usize].voxels.iter().any(asked)) {
                        return bricks
                            .iter()
                            .map(|&at| (at, vec![None; self.bricks[at as usize].voxels.len()]))
                            .collect();
                    }
                    around.read(self, lowest, filter.radius);
                    // The usual number of neighbours has a routine of its own, whose loop over them unrolls.
                    let look =
                        if filter.neighbours <= 8 { Surroundings::survey::<8> } else { Surroundings::survey::<16> };
                    let survey = |&at: &u32| {
                        let first: [i32; 3] =
                            std::array::from_fn(|a| (self.keys[at as usize].0[a] - lowest[a]) * BRICK_EDGE);
                        let voxels = &self.bricks[at as usize].voxels;
                        (at, voxels.iter().map(|v| asked(v).then(|| look(around, first, v.local, filter))).collect())
                    };
                    bricks.iter().map(survey).collect()
                },
            )
            .collect();
        let mut surveyed = vec![Vec::new(); self.bricks.len()];
        for (at, surveys) in by_block.into_iter().flatten() {
            surveyed[at as usize] = surveys;
        }
        surveyed
    }
}

impl Surroundings {
    fn new(unit_sigma: f32) -> Self {
        Self { columns: Box::new([[0; SIDE]; SIDE]), cells: vec![Cell::default(); SIDE * SIDE * SIDE], unit_sigma }
    }

    /// Lays out the block whose lowest brick is `lowest`, and `radius` cells around it.
    fn read(&mut self, map: &SemanticMap, lowest: [i32; 3], radius: i32) {
        *self.columns = [[0; SIDE]; SIDE];
        let (low, high) = (-radius, BLOCK * BRICK_EDGE + radius);
        const SPAN: i32 = BLOCK + 2;
        for i in 0..SPAN * SPAN * SPAN {
            let step = [i / (SPAN * SPAN) - 1, i / SPAN % SPAN - 1, i % SPAN - 1];
            let other = BrickKey(std::array::from_fn(|a| lowest[a] + step[a]));
            let Some(&at) = map.index.get(&other) else { continue };
            for voxel in &map.bricks[at].voxels {
                let cell = cell_of(voxel.local);
                let from_block: [i32; 3] = std::array::from_fn(|a| cell[a] + BRICK_EDGE * step[a]);
                if from_block.iter().any(|&c| c < low || c >= high) {
                    continue;
                }
                let [x, y, z] = from_block.map(|c| (c + LARGEST_RADIUS) as usize);
                self.columns[x][y] |= 1 << z;
                let inverse = 1.0 / voxel.weight;
                let length = voxel.normal.iter().map(|n| n * n).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
                self.cells[(x * SIDE + y) * SIDE + z] = Cell {
                    point: std::array::from_fn(|a| from_block[a] as f32 + voxel.offset[a] * inverse),
                    normal: voxel.normal.map(|n| n / length),
                    weight: voxel.weight,
                };
            }
        }
    }

    /// Occupied neighbours within the radius, and the mean distance of the nearest, of the voxel at `local` in the brick
    /// that begins at cell `first` of the block; `N` is the largest number of nearest ones.
    fn survey<const N: usize>(&self, first: [i32; 3], local: u16, filter: &OutlierFilter) -> Survey {
        let cell = cell_of(local);
        let [x, y, z]: [usize; 3] = std::array::from_fn(|a| (first[a] + cell[a] + LARGEST_RADIUS) as usize);
        let r = filter.radius as usize;
        let window = ((1_u32 << (2 * r + 1)) - 1) << (z - r);
        let own = self.cells[(x * SIDE + y) * SIDE + z];
        // Squared distances of the nearest so far, in order; what is missing counts as if it sat just outside.
        let missing = ((filter.radius + 1) * (filter.radius + 1)) as f32;
        let mut nearest = [missing; N];
        let mut neighbours = 0;
        let heavy = filter.heavier * own.weight;
        let (mut surface, mut weight, mut off) = (0, 0.0, 0.0);
        // From the middle outwards: what comes late is seldom among the nearest.
        let outwards = &OUTWARDS[..2 * r + 1];
        for column in outwards.iter().map(|step| x.wrapping_add_signed(*step)) {
            for row in outwards.iter().map(|step| y.wrapping_add_signed(*step)) {
                let mut bits = self.columns[column][row] & window;
                if (column, row) == (x, y) {
                    bits &= !(1 << z);
                }
                neighbours += bits.count_ones();
                while bits != 0 {
                    let at = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let other = self.cells[(column * SIDE + row) * SIDE + at];
                    let step: [f32; 3] = std::array::from_fn(|a| own.point[a] - other.point[a]);
                    let mut moving = dot(step, step);
                    if other.weight >= heavy && moving < NEAR * NEAR && dot(own.normal, other.normal) > 0.5 {
                        surface += 1;
                        weight += other.weight;
                        off += other.weight * dot(step, other.normal);
                    }
                    if moving >= nearest[N - 1] {
                        continue;
                    }
                    for place in &mut nearest {
                        let (near, far) = if moving < *place { (moving, *place) } else { (*place, moving) };
                        (*place, moving) = (near, far);
                    }
                }
            }
        }
        let sum: f32 = nearest.iter().take(filter.neighbours).map(|d| d.sqrt()).sum();
        let off = (off / weight).abs();
        let explained = EXPLAINED * self.unit_sigma / own.weight.sqrt();
        let double = surface >= SURFACE && off > filter.off_surface && off < explained;
        Survey { neighbours, distance: sum / filter.neighbours as f32, double }
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cell of a voxel in its brick.
fn cell_of(local: u16) -> [i32; 3] {
    [local >> 6 & 7, local >> 3 & 7, local & 7].map(i32::from)
}

#[cfg(test)]
mod tests;
