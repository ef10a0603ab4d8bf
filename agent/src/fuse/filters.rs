//! Outlier filters (P0 step 4): radius and statistical. They mark, exports choose.

use super::keys::{BrickKey, local_index};
use super::map::SemanticMap;
use rayon::prelude::*;
use semascan_shared::model::PointFlags;
use std::collections::BTreeSet;

/// Settings of the outlier filters, distances in voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierFilter {
    /// Radius filter: neighbourhood half edge in voxels.
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
struct Survey {
    slot: usize,
    /// Occupied neighbours within the radius.
    neighbours: u32,
    /// Mean distance of the nearest of them, voxels.
    distance: f64,
}

impl SemanticMap {
    /// Sets the outlier flags of every voxel anew; returns the chunks whose flags changed, in order.
    pub fn mark_outliers(&mut self, filter: &OutlierFilter) -> Vec<[i32; 3]> {
        let bricks = self.sorted_bricks();
        // Per voxel: occupied neighbours and their mean distance.
        let surveyed: Vec<(BrickKey, Vec<Survey>)> = bricks
            .par_iter()
            .map(|(key, brick)| {
                let survey = |(local, slot)| {
                    let (neighbours, distance) = self.survey(key.voxel(local), filter);
                    Survey { slot, neighbours, distance }
                };
                (*key, brick.occupied().map(survey).collect())
            })
            .collect();
        let distances = || surveyed.iter().flat_map(|(_, s)| s.iter().map(|v| v.distance));
        let count = distances().count().max(1) as f64;
        let mean = distances().sum::<f64>() / count;
        let variance = distances().map(|d| (d - mean).powi(2)).sum::<f64>() / count;
        let limit = mean + filter.deviations * variance.sqrt();

        let mut changed = BTreeSet::new();
        for (key, voxels) in surveyed {
            let Some(&at) = self.index.get(&key) else { continue };
            for Survey { slot, neighbours, distance } in voxels {
                let flags = &mut self.bricks[at].voxels[slot].flags;
                let mut now = flags.0 & !PointFlags::OUTLIER;
                if neighbours < filter.min_neighbours {
                    now |= PointFlags::RADIUS_OUTLIER;
                }
                if distance > limit {
                    now |= PointFlags::STATISTICAL_OUTLIER;
                }
                if now != flags.0 {
                    *flags = PointFlags(now);
                    changed.insert(key.chunk());
                }
            }
        }
        changed.into_iter().collect()
    }

    /// Occupied neighbours of `voxel` within the radius and the mean distance (voxels) of the nearest of them.
    fn survey(&self, voxel: [i32; 3], filter: &OutlierFilter) -> (u32, f64) {
        let r = filter.radius;
        let own = self.mean_at(voxel).unwrap_or([0.5; 3]);
        let mut distances = Vec::with_capacity(32);
        for dx in -r..=r {
            for dy in -r..=r {
                for dz in -r..=r {
                    let step = [dx, dy, dz];
                    if step == [0; 3] {
                        continue;
                    }
                    let other = std::array::from_fn(|i| voxel[i] + step[i]);
                    if let Some(mean) = self.mean_at(other) {
                        let d: f64 = (0..3).map(|i| (f64::from(step[i]) + mean[i] - own[i]).powi(2)).sum();
                        distances.push(d.sqrt());
                    }
                }
            }
        }
        distances.sort_unstable_by(f64::total_cmp);
        let nearest = &distances[..distances.len().min(filter.neighbours)];
        // Missing neighbours count as if they sat just outside the neighbourhood.
        let missing = (filter.neighbours - nearest.len()) as f64 * f64::from(r + 1);
        let mean = (nearest.iter().sum::<f64>() + missing) / filter.neighbours.max(1) as f64;
        (distances.len() as u32, mean)
    }

    /// Mean offset (voxels, 0..1) of an occupied voxel.
    fn mean_at(&self, voxel: [i32; 3]) -> Option<[f64; 3]> {
        let brick = &self.bricks[*self.index.get(&BrickKey::containing(voxel))?];
        let (_, v) = brick.get(local_index(voxel))?;
        Some(v.offset.map(|o| f64::from(o / v.weight)))
    }
}
