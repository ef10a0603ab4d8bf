//! Outlier filters (P0 step 4): radius and statistical. They mark, exports choose.
//!
//! Every voxel is surveyed, so a brick's surroundings are laid out once as a small dense grid: which cells are occupied
//! as bits along z, and where their mean points lie. Counting neighbours is then a few bit counts.

use super::brick::Brick;
use super::keys::{BRICK_EDGE, BrickKey};
use super::map::SemanticMap;
use rayon::prelude::*;
use semascan_shared::model::PointFlags;
use std::collections::BTreeSet;

/// Largest radius: what the surroundings of a brick hold.
const LARGEST_RADIUS: i32 = 4;
/// Cells along an edge of a brick's surroundings.
const SIDE: usize = (BRICK_EDGE + 2 * LARGEST_RADIUS) as usize;

/// Settings of the outlier filters, distances in voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierFilter {
    /// Both filters: neighbourhood half edge in voxels, 1 to 4.
    pub radius: i32,
    /// Radius filter: fewest occupied neighbours of a good voxel.
    pub min_neighbours: u32,
    /// Statistical filter: nearest neighbours that count.
    pub neighbours: usize,
    /// Statistical filter: standard deviations above the mean neighbour distance.
    pub deviations: f64,
}

impl Default for OutlierFilter {
    fn default() -> Self {
        Self { radius: 2, min_neighbours: 6, neighbours: 8, deviations: 3.0 }
    }
}

/// What a voxel's neighbourhood looks like.
#[derive(Clone, Copy)]
struct Survey {
    /// Occupied neighbours within the radius.
    neighbours: u32,
    /// Mean distance of the nearest of them, voxels.
    distance: f32,
}

/// A brick and what is around it. Cells are addressed from `LARGEST_RADIUS` before the brick's lowest voxel.
struct Surroundings {
    /// Occupied cells of each column along z, as bits.
    columns: Box<[[u16; SIDE]; SIDE]>,
    /// Mean points in cells; valid where occupied.
    points: Vec<[f32; 3]>,
    distances: Vec<f32>,
}

impl SemanticMap {
    /// Sets the outlier flags of every voxel anew; returns the chunks whose flags changed, in order.
    pub fn mark_outliers(&mut self, filter: &OutlierFilter) -> Vec<[i32; 3]> {
        let filter = &OutlierFilter { radius: filter.radius.clamp(1, LARGEST_RADIUS), ..*filter };
        let surveyed: Vec<Vec<Survey>> = self
            .keys
            .par_iter()
            .zip(&self.bricks)
            .map_init(Surroundings::new, |around, (key, brick)| {
                around.read(self, *key, filter.radius);
                brick.voxels.iter().map(|v| around.survey(v.local, filter)).collect()
            })
            .collect();
        // Summed brick by brick, so that the limit is the same on any number of threads.
        let moments = |power: i32, centre: f64| -> f64 {
            let brick = |b: &Vec<Survey>| b.iter().map(|s| (f64::from(s.distance) - centre).powi(power)).sum::<f64>();
            surveyed.par_iter().map(brick).collect::<Vec<_>>().into_iter().sum()
        };
        let count = self.len().max(1) as f64;
        let mean = moments(1, 0.0) / count;
        let limit = (mean + filter.deviations * (moments(2, mean) / count).sqrt()) as f32;

        let changed: Vec<bool> = self
            .bricks
            .par_iter_mut()
            .zip(surveyed)
            .map(|(brick, surveys)| {
                let mut changed = false;
                for (voxel, Survey { neighbours, distance }) in brick.voxels.iter_mut().zip(surveys) {
                    let sparse = u16::from(neighbours < filter.min_neighbours) * PointFlags::RADIUS_OUTLIER;
                    let far = u16::from(distance > limit) * PointFlags::STATISTICAL_OUTLIER;
                    let others = voxel.flags.0 & !(PointFlags::RADIUS_OUTLIER | PointFlags::STATISTICAL_OUTLIER);
                    let now = PointFlags(others | sparse | far);
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

impl Surroundings {
    fn new() -> Self {
        Self { columns: Box::new([[0; SIDE]; SIDE]), points: vec![[0.0; 3]; SIDE * SIDE * SIDE], distances: Vec::new() }
    }

    /// Lays out the brick at `key` and `radius` cells around it.
    fn read(&mut self, map: &SemanticMap, key: BrickKey, radius: i32) {
        *self.columns = [[0; SIDE]; SIDE];
        let (low, high) = (-radius, BRICK_EDGE + radius);
        for i in 0..27 {
            let step = [i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1];
            let other = BrickKey(std::array::from_fn(|a| key.0[a] + step[a]));
            let Some(&at) = map.index.get(&other) else { continue };
            let brick: &Brick = &map.bricks[at];
            for voxel in &brick.voxels {
                let cell = cell_of(voxel.local);
                let from_brick: [i32; 3] = std::array::from_fn(|a| cell[a] + BRICK_EDGE * step[a]);
                if from_brick.iter().any(|&c| c < low || c >= high) {
                    continue;
                }
                let [x, y, z] = from_brick.map(|c| (c + LARGEST_RADIUS) as usize);
                self.columns[x][y] |= 1 << z;
                let inverse = 1.0 / voxel.weight;
                let at = from_brick.map(|c| c as f32);
                self.points[(x * SIDE + y) * SIDE + z] = std::array::from_fn(|a| at[a] + voxel.offset[a] * inverse);
            }
        }
    }

    /// Occupied neighbours of the brick's voxel at `local` within the radius and the mean distance of the nearest.
    fn survey(&mut self, local: u16, filter: &OutlierFilter) -> Survey {
        let [x, y, z] = cell_of(local).map(|c| (c + LARGEST_RADIUS) as usize);
        let r = filter.radius as usize;
        let window = ((1_u32 << (2 * r + 1)) - 1) << (z - r);
        let own = self.points[(x * SIDE + y) * SIDE + z];
        self.distances.clear();
        for column in x - r..=x + r {
            for row in y - r..=y + r {
                let mut bits = u32::from(self.columns[column][row]) & window;
                while bits != 0 {
                    let cell = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let p = self.points[(column * SIDE + row) * SIDE + cell];
                    let [dx, dy, dz] = [p[0] - own[0], p[1] - own[1], p[2] - own[2]];
                    self.distances.push(dx * dx + dy * dy + dz * dz);
                }
            }
        }
        // The voxel itself is among them, at distance 0: one more of the nearest, nothing in their sum.
        let found = self.distances.len() - 1;
        let nearest = found.min(filter.neighbours);
        if nearest < found {
            self.distances.select_nth_unstable_by(nearest, f32::total_cmp);
        }
        let sum: f32 = self.distances[..=nearest].iter().map(|d| d.sqrt()).sum();
        // Missing neighbours count as if they sat just outside the neighbourhood.
        let missing = (filter.neighbours - nearest) as f32 * (filter.radius + 1) as f32;
        Survey { neighbours: found as u32, distance: (sum + missing) / filter.neighbours.max(1) as f32 }
    }
}

/// Cell of a voxel in its brick.
fn cell_of(local: u16) -> [i32; 3] {
    [local >> 6 & 7, local >> 3 & 7, local & 7].map(i32::from)
}
