//! Outlier filters ([Remanufacturing paper], step 4, integration): radius, statistical and noise. They mark, exports
//! choose. Flying pixels are marked where they are merged, for only a view knows them.
//!
//! Every voxel is surveyed, block by block of bricks ([`surroundings`]): its neighbours ([`neighbours`]), and whether it
//! doubles a better known surface ([`noise`]).

mod neighbours;
mod noise;
mod outlier_filter;
mod surroundings;

pub use outlier_filter::OutlierFilter;

use super::brick::Voxel;
use super::map::SemanticMap;
use super::merge::SYSTEMATIC;
use glam::Vec4;
use neighbours::{MOST_NEIGHBOURS, Nearest, limit};
use noise::Suspicion;
use rayon::prelude::*;
use semascan_model::PointFlags;
use std::collections::BTreeSet;
use surroundings::{LARGEST_RADIUS, Place, Surroundings, block_of};

/// What was found of the voxels of a brick, in its order.
#[derive(Clone, Debug, Default)]
struct Surveyed {
    /// Mean distance of the nearest neighbours, voxels; NaN of background.
    distances: Vec<f32>,
    /// Flags that do not depend on the voxels of other blocks.
    flags: Vec<u16>,
}

impl Surveyed {
    fn for_voxels(count: usize) -> Self {
        Self { distances: Vec::with_capacity(count), flags: Vec::with_capacity(count) }
    }
}

/// The flags that the filters own.
const OWN: u16 = PointFlags::RADIUS_OUTLIER | PointFlags::STATISTICAL_OUTLIER | PointFlags::NOISE;

impl SemanticMap {
    /// Makes noisy surfaces thin and marks outliers: what a map is due when all views are in. Returns the chunks that
    /// changed, in order.
    pub fn finish(&mut self, filter: &OutlierFilter) -> Vec<[i32; 3]> {
        let mut changed = self.consolidate();
        changed.extend(self.mark_outliers(filter));
        changed.sort_unstable();
        changed.dedup();
        changed
    }

    /// As [`finish`](Self::finish) for a map of at most `most` voxels. A larger one only gets its outliers marked: noisy
    /// surfaces stay as thick as they are. Returns the chunks that changed, and whether surfaces were made thin.
    pub fn finish_in_short_time(&mut self, filter: &OutlierFilter, most: usize) -> (Vec<[i32; 3]>, bool) {
        let is_small = self.len() <= most;
        (if is_small { self.finish(filter) } else { self.mark_outliers(filter) }, is_small)
    }

    /// Sets the outlier flags of every voxel of the measuring volume anew; returns the chunks whose flags changed, in
    /// order. What lies outside is background, which nothing asks about.
    pub fn mark_outliers(&mut self, filter: &OutlierFilter) -> Vec<[i32; 3]> {
        let filter = &OutlierFilter {
            radius: filter.radius.clamp(1, LARGEST_RADIUS),
            neighbours: filter.neighbours.clamp(1, MOST_NEIGHBOURS),
            ..*filter
        };
        let surveyed = self.survey(filter);
        let limit = limit(&surveyed, |s| &s.distances, filter.deviations);
        let changed: Vec<bool> = self
            .bricks
            .par_iter_mut()
            .zip(surveyed)
            .map(|(brick, Surveyed { distances, flags })| {
                let mut changed = false;
                for ((voxel, distance), flags) in brick.voxels.iter_mut().zip(distances).zip(flags) {
                    if distance.is_nan() {
                        continue;
                    }
                    let far = u16::from(distance > limit) * PointFlags::STATISTICAL_OUTLIER;
                    let now = PointFlags(voxel.flags.0 & !OWN | flags | far);
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

    /// Looks at every voxel that is not background, brick by brick in the order of the map.
    fn survey(&self, filter: &OutlierFilter) -> Vec<Surveyed> {
        let block = |at: u32| block_of(self.keys[at as usize]);
        let mut order: Vec<u32> = (0..self.bricks.len() as u32).collect();
        order.par_sort_unstable_by_key(|&at| (block(at), at));
        let blocks: Vec<&[u32]> = order.chunk_by(|&a, &b| block(a) == block(b)).collect();
        let unit_sigma = SYSTEMATIC / self.config.voxel as f32;
        let by_block: Vec<Vec<(u32, Surveyed)>> = blocks
            .par_iter()
            .map_init(
                || Surroundings::new(filter.radius),
                |around, bricks| {
                    let asked = |v: &Voxel| !v.flags.has(PointFlags::BACKGROUND);
                    if bricks.iter().any(|&at| self.bricks[at as usize].voxels.iter().any(asked)) {
                        around.read(self, block(bricks[0]));
                    }
                    // The usual number of neighbours has a routine of its own, whose loop over them unrolls.
                    let look = if filter.neighbours <= 8 { look::<8> } else { look::<MOST_NEIGHBOURS> };
                    let survey = |&at: &u32| {
                        let key = self.keys[at as usize];
                        let voxels = &self.bricks[at as usize].voxels;
                        let mut surveyed = Surveyed::for_voxels(voxels.len());
                        for voxel in voxels {
                            let (mut distance, mut flags) = (f32::NAN, 0);
                            if asked(voxel)
                                && let Some(place) = around.place(key, voxel.local)
                            {
                                (distance, flags) = look(around, place, filter, unit_sigma);
                            }
                            surveyed.distances.push(distance);
                            surveyed.flags.push(flags);
                        }
                        (at, surveyed)
                    };
                    bricks.iter().map(survey).collect()
                },
            )
            .collect();
        let mut all = vec![Surveyed::default(); self.bricks.len()];
        for (at, surveyed) in by_block.into_iter().flatten() {
            all[at as usize] = surveyed;
        }
        all
    }
}

/// Looks around the voxel at `place`: the mean distance of its nearest neighbours (voxels), and its flags of radius and
/// noise.
fn look<const N: usize>(
    around: &mut Surroundings,
    place: Place,
    filter: &OutlierFilter,
    unit_sigma: f32,
) -> (f32, u16) {
    let suspicion = Suspicion::of(around.weight(place), filter, unit_sigma);
    let mut nearest = Nearest::<N>::none(filter.radius);
    let [mut count, mut asked] = [Vec4::ZERO; 2];
    around.visit(place, |around, cells| {
        nearest.see(Vec4::select(cells.mask, cells.squares, Vec4::INFINITY));
        count += Vec4::select(cells.mask, Vec4::ONE, Vec4::ZERO);
        asked += Vec4::select(suspicion.asks(&cells, around.weights(&cells)), Vec4::ONE, Vec4::ZERO);
    });
    let sparse = count.element_sum() < filter.min_neighbours as f32;
    let double = suspicion.holds(around, place, asked.element_sum(), filter.off_surface);
    let flags = (u16::from(sparse) * PointFlags::RADIUS_OUTLIER) | (u16::from(double) * PointFlags::NOISE);
    (nearest.mean(filter.neighbours), flags)
}

#[cfg(test)]
mod tests;
