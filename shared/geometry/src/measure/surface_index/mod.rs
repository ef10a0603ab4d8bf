//! How far a point is from a surface: point-to-triangle distance.
//!
//! Distances are computed in f32 relative to the query, so that their error follows the distance and the size of the
//! triangle, not where both lie. Triangles that are thin to nothing count as the segments they are; triangles that name
//! a vertex that is not there, or one that is not finite, are left out. Where there are many triangles in the same place, of
//! those whose corners are within 2^-16 of their size of each other one counts.

use super::batch;
use super::box_tree::{Bounds, BoxTree, Entry};
use super::nearest_points::{spatial_order, usable};
use glam::{DVec3, Vec3A};
use std::collections::HashSet;

/// Triangles in a leaf.
const LEAF: usize = 4;
/// Triangles that lie in the same place as another from which it is worth while to look for coincident ones.
const COINCIDENT: usize = 1000;
/// Corners of coincident triangles are the same on a grid of that part of the triangle's size.
const GRID: f64 = 1.0 / 65_536.0;
/// No triangle.
const NONE: u32 = u32::MAX;

/// Where on its triangle the nearest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Inside.
    Face,
    /// On the edge from this corner (0..3) to the next.
    Edge(u8),
    /// At this corner (0..3).
    Corner(u8),
}

/// The nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Distance in the unit of the mesh.
    pub distance: f32,
    /// The point on the surface.
    pub point: [f32; 3],
    /// Index of its triangle.
    pub triangle: u32,
    /// Index of the triangle's corner nearest to the point.
    pub vertex: u32,
    /// Where on the triangle it lies.
    pub feature: Feature,
}

/// A surface that answers how far a point is from it (point to triangle).
#[derive(Clone, Debug)]
pub struct SurfaceIndex {
    tree: BoxTree<LEAF>,
    /// In the order of the leaves.
    corners: Vec<[Vec3A; 3]>,
    /// Which of them are thin.
    thin: Vec<bool>,
    /// Vertices and index of each triangle, in the order of the leaves.
    ids: Vec<([u32; 3], u32)>,
}

impl SurfaceIndex {
    /// Builds the index over triangles of `positions`.
    pub fn new(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let corners_of = |t: &[u32; 3]| -> Option<[[f32; 3]; 3]> {
            let corner = |i: u32| positions.get(i as usize).copied().filter(usable);
            Some([corner(t[0])?, corner(t[1])?, corner(t[2])?])
        };
        let bounds = |corners: [[f32; 3]; 3]| {
            let mut b = Bounds::EMPTY;
            corners.into_iter().for_each(|c| b.include(c));
            b
        };
        let mut entries: Vec<Entry> = (0_u32..)
            .zip(triangles)
            .filter_map(|(item, t)| {
                let b = bounds(corners_of(t)?);
                Some(Entry { centre: std::array::from_fn(|a| 0.5 * (b.low[a] + b.high[a])), item })
            })
            .collect();
        let box_of = |i: u32| corners_of(&triangles[i as usize]).map_or(Bounds::EMPTY, bounds);
        let mut tree = BoxTree::new(&mut entries, box_of);
        // Boxes of triangles in the same place cannot be told apart, and a query would look into all of them: each is kept
        // once. They lie side by side in the tree, where a few of them cost nothing.
        let in_one_place = |pair: &[Entry]| alike(&box_of(pair[0].item), &box_of(pair[1].item));
        if entries.windows(2).filter(|pair| in_one_place(pair)).count() > COINCIDENT {
            entries.sort_unstable_by_key(|entry| entry.item);
            let mut seen = HashSet::new();
            entries.retain(|entry| corners_of(&triangles[entry.item as usize]).is_some_and(|c| seen.insert(place(c))));
            tree = BoxTree::new(&mut entries, box_of);
        }
        let ids: Vec<_> = entries.iter().map(|e| (triangles[e.item as usize], e.item)).collect();
        let corners: Vec<_> = ids.iter().map(|(t, _)| t.map(|i| Vec3A::from_array(positions[i as usize]))).collect();
        Self { tree, thin: corners.iter().map(|c| is_thin(*c)).collect(), corners, ids }
    }

    /// Whether there is no usable triangle.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The point of the surface nearest to `p`; `None` where the mesh has no usable triangle or `p` is not finite.
    pub fn closest(&self, p: [f32; 3]) -> Option<Nearest> {
        usable(&p).then(|| self.nearest(p, self.search(p, NONE))).flatten()
    }

    /// The nearest point for each query, in their order.
    pub fn closest_of_all(&self, queries: &[[f32; 3]]) -> Vec<Option<Nearest>> {
        let order = spatial_order(queries);
        let mut found = vec![None; order.len()];
        batch::fill(&order, &mut found, |order, found| {
            let mut guess = NONE;
            for (entry, out) in order.iter().zip(found) {
                // Each query begins with the triangle of the one before it.
                guess = self.search(entry.centre, guess);
                *out = self.nearest(entry.centre, guess);
            }
        });
        let mut out = vec![None; queries.len()];
        for (entry, nearest) in order.iter().zip(found) {
            out[entry.item as usize] = nearest;
        }
        out
    }

    /// The place of the triangle nearest to `p`, or `guess` if none is nearer.
    #[inline(always)]
    fn search(&self, p: [f32; 3], guess: u32) -> u32 {
        let origin = Vec3A::from_array(p);
        let to = |slot: usize| self.closest_on(slot, origin).0.length_squared();
        let mut best = guess;
        let mut bound = if guess == NONE { f32::INFINITY } else { to(guess as usize) };
        self.tree.walk(p, &mut bound, |leaf, bound| {
            for slot in leaf * LEAF..(leaf * LEAF + LEAF).min(self.corners.len()) {
                let d = to(slot);
                if d < *bound {
                    *bound = d;
                    best = slot as u32;
                }
            }
        });
        best
    }

    /// The point of a triangle nearest to `origin`, relative to it.
    #[inline(always)]
    fn closest_on(&self, slot: usize, origin: Vec3A) -> (Vec3A, Feature) {
        let corners = self.corners[slot].map(|v| v - origin);
        if self.thin[slot] { closest_on_thin(corners) } else { closest_on_triangle(corners) }
    }

    fn nearest(&self, p: [f32; 3], slot: u32) -> Option<Nearest> {
        if slot == NONE {
            return None;
        }
        let origin = Vec3A::from_array(p);
        let (q, feature) = self.closest_on(slot as usize, origin);
        let (ids, triangle) = self.ids[slot as usize];
        let to = self.corners[slot as usize].map(|v| (v - origin).distance_squared(q));
        let corner = (0..3).fold(0, |best, k| if to[k] < to[best] { k } else { best });
        Some(Nearest { distance: q.length(), point: (q + origin).to_array(), triangle, vertex: ids[corner], feature })
    }
}

/// Whether two boxes are the same up to a cell of the grid of [`place`].
fn alike(a: &Bounds, b: &Bounds) -> bool {
    let size = (0..3).map(|axis| f64::from(a.high[axis]) - f64::from(a.low[axis])).fold(0.0, f64::max);
    let apart =
        |p: [f32; 3], q: [f32; 3]| (0..3).map(|k| (f64::from(p[k]) - f64::from(q[k])).abs()).fold(0.0, f64::max);
    apart(a.low, b.low).max(apart(a.high, b.high)) <= GRID * size
}

/// Where a triangle lies: its corners, in no order, on a grid whose cell is [`GRID`] of its size, rounded to a power of two.
fn place(corners: [[f32; 3]; 3]) -> [[u64; 3]; 3] {
    let exact = corners.map(|corner| corner.map(f64::from));
    let side = |axis: usize| {
        let along = exact.map(|corner| corner[axis]);
        along.into_iter().fold(f64::MIN, f64::max) - along.into_iter().fold(f64::MAX, f64::min)
    };
    let size = side(0).max(side(1)).max(side(2));
    // A triangle that is a point has no size: its corner itself is where it lies.
    let cell = if size > 0.0 { GRID * size.log2().floor().exp2() } else { 1.0 };
    let on_grid = |c: f64| if size > 0.0 { (c / cell).round() * cell } else { c };
    // Zero has two signs.
    let mut place = exact.map(|corner| corner.map(|c| (on_grid(c) + 0.0).to_bits()));
    place.sort_unstable();
    place
}

/// Whether a triangle is so thin that f32 cannot tell its inside: its height is below a thousandth of its longest side.
fn is_thin([a, b, c]: [Vec3A; 3]) -> bool {
    let (ab, ac) = ((b - a).as_dvec3(), (c - a).as_dvec3());
    let side = ab.length_squared().max(ac.length_squared()).max((ac - ab).length_squared());
    ab.cross(ac).length_squared() <= 1e-6 * side * side
}

/// The point of triangle `abc` nearest to the origin ([Ericson 2005], section 5.1.5).
#[inline(always)]
fn closest_on_triangle([a, b, c]: [Vec3A; 3]) -> (Vec3A, Feature) {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Corner(0));
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Corner(1));
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Corner(2));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(1));
    }
    // The foot on the plane: more exact than the sum of the weighted corners.
    let normal = ab.cross(ac);
    (normal * (a.dot(normal) / normal.length_squared()), Feature::Face)
}

/// The same for a thin triangle, down to a segment or a point, in f64.
#[cold]
fn closest_on_thin(corners: [Vec3A; 3]) -> (Vec3A, Feature) {
    let [a, b, c] = corners.map(|v| v.as_dvec3());
    let side = |from: DVec3, to: DVec3| {
        let along = to - from;
        let t = -along.dot(from) / along.length_squared();
        from + along * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 }
    };
    let sides = [(side(a, b), Feature::Edge(0)), (side(b, c), Feature::Edge(1)), (side(c, a), Feature::Edge(2))];
    let (mut point, mut feature) = sides
        .into_iter()
        .fold(sides[0], |best, s| if s.0.length_squared() < best.0.length_squared() { s } else { best });
    let normal = (b - a).cross(c - a);
    let left_of = |from: DVec3, to: DVec3| normal.dot((to - from).cross(-from)) > 0.0;
    if left_of(a, b) && left_of(b, c) && left_of(c, a) {
        (point, feature) = (normal * (a.dot(normal) / normal.length_squared()), Feature::Face);
    }
    (point.as_vec3a(), feature)
}

#[cfg(test)]
mod tests;
