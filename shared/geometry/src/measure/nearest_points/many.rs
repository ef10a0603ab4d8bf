//! Queries that come in batches, on all threads, in an order in which each is near the one before it.

use super::super::batch;
use super::{LEAF, NONE, NearestPoints, Neighbour, spatial_order};
use crate::vector::squared_distance;

impl NearestPoints {
    /// The nearest point of each query, in the order of the queries. Of points equally far, any may be given, but always
    /// the same.
    pub fn nearest_of_all(&self, queries: &[[f32; 3]]) -> Vec<Option<Neighbour>> {
        let order = spatial_order(queries);
        let mut found = vec![None; order.len()];
        batch::fill(&order, &mut found, |order, found| {
            let mut guess = NONE;
            for (entry, out) in order.iter().zip(found) {
                guess = self.search(entry.centre, guess, f32::INFINITY);
                *out = self.neighbour(entry.centre, guess);
            }
        });
        let mut out = vec![None; queries.len()];
        for (entry, neighbour) in order.iter().zip(found) {
            out[entry.item as usize] = neighbour;
        }
        out
    }

    /// Distance from each point of `cloud` to the nearest of these, in the order of that cloud; NaN where a point is not
    /// usable or there is nothing to measure to. Faster than [`Self::nearest_of_all`]: the other index is the order.
    pub fn distances_from(&self, cloud: &Self) -> Vec<f64> {
        let mut found = vec![[f64::NAN; LEAF]; cloud.leaves.len()];
        batch::fill(&cloud.leaves, &mut found, |leaves, found| {
            let mut guess = NONE;
            for (leaf, out) in leaves.iter().zip(found) {
                for (lane, out) in out.iter_mut().enumerate() {
                    if leaf.index[lane] == NONE {
                        continue;
                    }
                    let p = leaf.point(lane);
                    guess = self.search(p, guess, f32::INFINITY);
                    *out = self.neighbour(p, guess).map_or(f64::NAN, |n| n.distance());
                }
            }
        });
        let mut out = vec![f64::NAN; cloud.total];
        for (leaf, found) in cloud.leaves.iter().zip(found) {
            for (index, d) in leaf.index.iter().zip(found) {
                if *index != NONE {
                    out[*index as usize] = d;
                }
            }
        }
        out
    }

    /// The `k` nearest points of each of the cloud's own points, itself among them, in the order of the cloud: row `i`
    /// holds up to `k` indices, nearest first, padded with `u32::MAX`; unusable points have empty rows.
    pub fn neighbourhoods(&self, k: usize) -> Vec<u32> {
        let mut found: Vec<Vec<u32>> = vec![Vec::new(); self.leaves.len()];
        batch::fill(&self.leaves, &mut found, |leaves, found| {
            let mut near: Vec<(f32, u32)> = Vec::with_capacity(k);
            for (leaf, out) in leaves.iter().zip(found) {
                out.resize(LEAF * k, NONE);
                for lane in 0..LEAF {
                    if leaf.index[lane] == NONE {
                        continue;
                    }
                    let p = leaf.point(lane);
                    // The neighbours of the last point hold k points: none of the k nearest is farther than these.
                    let reach = near.iter().map(|(_, slot)| squared_distance(p, self.at(*slot))).fold(0.0, f32::max);
                    let bound = if near.len() < k { f32::INFINITY } else { reach.next_up() };
                    near.clear();
                    self.search_k(p, k, bound, &mut near);
                    for (to, (_, slot)) in out[lane * k..].iter_mut().zip(&near) {
                        *to = self.index_of(*slot);
                    }
                }
            }
        });
        let mut out = vec![NONE; self.total * k];
        for (leaf, rows) in self.leaves.iter().zip(&found) {
            for (lane, index) in leaf.index.iter().enumerate().filter(|(_, i)| **i != NONE) {
                out[*index as usize * k..][..k].copy_from_slice(&rows[lane * k..][..k]);
            }
        }
        out
    }
}
