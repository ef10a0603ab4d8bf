//! The nearest points of a cloud: one, several, or all within a radius.
//!
//! Exact up to the rounding of f32: candidates are compared in f32 (a neighbour may be up to 3e-7 of the distance
//! farther than the nearest), and the distance of the one that is found is computed in f64. Queries that come in
//! batches are put in an order in which each is near the one before it, whose neighbour is a first guess.

mod many;

use super::box_tree::{Bounds, BoxTree, Entry};
use crate::grid::morton;
use crate::vector::squared_distance;
use glam::Vec4;

/// Points in a leaf.
const LEAF: usize = 8;
/// Coordinates beyond this are not usable: their squares would overflow.
const LARGEST: f32 = 1e18;
/// No point.
const NONE: u32 = u32::MAX;

/// A point of the cloud near a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Its index in the cloud.
    pub index: u32,
    /// Squared distance, computed in f64 from the f32 coordinates.
    pub distance_squared: f64,
}

impl Neighbour {
    /// Distance in the unit of the cloud.
    pub fn distance(&self) -> f64 {
        self.distance_squared.sqrt()
    }
}

/// A place in an index: where a search for a point may begin, because a point near it, or the same point a little
/// earlier, was found there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Guess(u32);

impl Guess {
    /// No idea.
    pub const NONE: Self = Self(NONE);
}

impl Default for Guess {
    fn default() -> Self {
        Self::NONE
    }
}

/// Eight points side by side; places without a point are infinitely far and have the index [`NONE`].
#[derive(Clone, Copy, Debug)]
struct Leaf {
    position: [[Vec4; 2]; 3],
    index: [u32; LEAF],
}

impl Leaf {
    /// Squared distances to all eight.
    #[inline(always)]
    fn distances(&self, p: [f32; 3]) -> [f32; LEAF] {
        let half = |h: usize| {
            let along = |a: usize| self.position[a][h] - Vec4::splat(p[a]);
            let (x, y, z) = (along(0), along(1), along(2));
            (x * x + y * y + z * z).to_array()
        };
        let ([a, b, c, d], [e, f, g, h]) = (half(0), half(1));
        [a, b, c, d, e, f, g, h]
    }

    fn point(&self, lane: usize) -> [f32; 3] {
        self.position.map(|halves| halves[lane / 4][lane % 4])
    }
}

/// An index of a point cloud that finds nearest points. Points with a coordinate that is not finite, or past 1e18, are
/// not part of it.
#[derive(Clone, Debug)]
pub struct NearestPoints {
    tree: BoxTree<LEAF>,
    leaves: Vec<Leaf>,
    /// Usable points.
    len: usize,
    /// Points of the cloud it was made from.
    total: usize,
}

/// Whether a point can be measured from.
pub(super) fn usable(p: &[f32; 3]) -> bool {
    p.iter().all(|c| c.abs() < LARGEST)
}

/// Squared distance in f64; the leaves compute it in f32.
#[inline(always)]
fn exact(p: [f32; 3], q: [f32; 3]) -> f64 {
    squared_distance(p.map(f64::from), q.map(f64::from))
}

impl NearestPoints {
    /// Builds the index. At most 2^31 points.
    pub fn new(points: &[[f32; 3]]) -> Self {
        let mut entries: Vec<Entry> =
            (0_u32..).zip(points).filter(|(_, p)| usable(p)).map(|(item, p)| Entry { centre: *p, item }).collect();
        let tree = BoxTree::new(&mut entries, |i| {
            let p = points[i as usize];
            Bounds { low: p, high: p }
        });
        let leaves = entries.chunks(LEAF).map(leaf_of).collect();
        Self { tree, leaves, len: entries.len(), total: points.len() }
    }

    /// Number of usable points.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no usable point.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The nearest point; `None` if there is none or `p` is not usable.
    pub fn nearest(&self, p: [f32; 3]) -> Option<Neighbour> {
        self.nearest_within(p, f32::INFINITY)
    }

    /// The nearest point that is nearer than `radius`.
    pub fn nearest_within(&self, p: [f32; 3], radius: f32) -> Option<Neighbour> {
        if !usable(&p) {
            return None;
        }
        self.neighbour(p, self.search(p, NONE, radius * radius))
    }

    /// As [`Self::nearest_within`], faster the better the guess is, which becomes the place of what is found. A guess may
    /// change which of several equally near points is given. It has to stem from this index.
    #[inline]
    pub fn nearest_from(&self, p: [f32; 3], radius: f32, guess: &mut Guess) -> Option<Neighbour> {
        if !usable(&p) {
            return None;
        }
        let known = (guess.0 as usize) < LEAF * self.leaves.len() && self.index_of(guess.0) != NONE;
        let near = known && squared_distance(p, self.at(guess.0)) < radius * radius;
        let found = self.search(p, if near { guess.0 } else { NONE }, radius * radius);
        guess.0 = if found == NONE { guess.0 } else { found };
        self.neighbour(p, found)
    }

    /// The `k` nearest points into `found`, nearest first; all of them if there are fewer.
    pub fn nearest_k(&self, p: [f32; 3], k: usize, found: &mut Vec<Neighbour>) {
        found.clear();
        if usable(&p) {
            let mut near = Vec::with_capacity(k);
            self.search_k(p, k, f32::INFINITY, &mut near);
            found.extend(near.iter().filter_map(|(_, slot)| self.neighbour(p, *slot)));
        }
    }

    /// Calls `visit` with every point nearer than `radius`, in no particular but always the same order.
    pub fn within(&self, p: [f32; 3], radius: f32, mut visit: impl FnMut(Neighbour)) {
        if !usable(&p) {
            return;
        }
        let limit = radius * radius;
        self.tree.walk(p, &mut limit.clone(), |i, _| {
            let leaf = &self.leaves[i];
            for (lane, d) in leaf.distances(p).into_iter().enumerate() {
                if d < limit {
                    visit(Neighbour { index: leaf.index[lane], distance_squared: exact(p, leaf.point(lane)) });
                }
            }
        });
    }

    /// The place of the point nearest to `p`, or `guess` if none is nearer.
    #[inline(always)]
    fn search(&self, p: [f32; 3], guess: u32, limit: f32) -> u32 {
        let mut best = guess;
        let mut bound = if guess == NONE { limit } else { squared_distance(p, self.at(guess)) };
        self.tree.walk(p, &mut bound, |i, bound| {
            for (lane, d) in self.leaves[i].distances(p).into_iter().enumerate() {
                if d < *bound {
                    *bound = d;
                    best = (i * LEAF + lane) as u32;
                }
            }
        });
        best
    }

    /// The places of the `k` points nearest to `p` among those nearer than `bound` (squared), nearest first.
    fn search_k(&self, p: [f32; 3], k: usize, mut bound: f32, near: &mut Vec<(f32, u32)>) {
        if k == 0 {
            return;
        }
        self.tree.walk(p, &mut bound, |i, bound| {
            for (lane, d) in self.leaves[i].distances(p).into_iter().enumerate() {
                if d < *bound {
                    if near.len() == k {
                        near.pop();
                    }
                    let at = near.iter().rposition(|n| n.0 <= d).map_or(0, |i| i + 1);
                    near.insert(at, (d, (i * LEAF + lane) as u32));
                    if let (true, Some(last)) = (near.len() == k, near.last()) {
                        *bound = last.0;
                    }
                }
            }
        });
    }

    fn at(&self, slot: u32) -> [f32; 3] {
        self.leaves[slot as usize / LEAF].point(slot as usize % LEAF)
    }

    fn index_of(&self, slot: u32) -> u32 {
        self.leaves[slot as usize / LEAF].index[slot as usize % LEAF]
    }

    fn neighbour(&self, p: [f32; 3], slot: u32) -> Option<Neighbour> {
        (slot != NONE).then(|| Neighbour { index: self.index_of(slot), distance_squared: exact(p, self.at(slot)) })
    }
}

fn leaf_of(entries: &[Entry]) -> Leaf {
    let mut leaf = Leaf { position: [[Vec4::INFINITY; 2]; 3], index: [NONE; LEAF] };
    for (lane, e) in entries.iter().enumerate() {
        for axis in 0..3 {
            leaf.position[axis][lane / 4][lane % 4] = e.centre[axis];
        }
        leaf.index[lane] = e.item;
    }
    leaf
}

/// Usable queries along a Morton curve.
pub(super) fn spatial_order(queries: &[[f32; 3]]) -> Vec<Entry> {
    let mut hull = Bounds::EMPTY;
    queries.iter().filter(|p| usable(p)).for_each(|p| hull.include(*p));
    let side = (0..3).map(|a| hull.high[a] - hull.low[a]).fold(0.0, f32::max);
    let scale = if side > 0.0 { 1023.0 / side } else { 0.0 };
    // Ten bits a coordinate, and the place in the queries below them.
    let code = |p: &[f32; 3]| morton([2, 1, 0].map(|a: usize| (((p[a] - hull.low[a]) * scale) as u32).min(1023)));
    let mut keys: Vec<u64> =
        (0_u64..).zip(queries).filter(|(_, p)| usable(p)).map(|(i, p)| code(p) << 32 | i).collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| Entry { centre: queries[key as u32 as usize], item: key as u32 }).collect()
}

#[cfg(test)]
mod tests;
