//! Length and width of a region along the surface.
//!
//! The length is the longest of the shortest ways on the region's own surface between two of its points: that of a bent
//! crack follows its course. Ways are found by Dijkstra's algorithm with the update across faces of [Novotni 2002]:
//! the distance of a face's third corner from that of the other two, as if the source lay in the unfolded plane of the face.
//! It is exact on a plane and needs no edge to run along the way. Length is searched between ends by turns (the farthest
//! point of the farthest point), which finds the diameter of a tree and all but that of other shapes.
//!
//! The width is the largest extent across this way: the area of a slice divided by its thickness, where each vertex lies
//! along the way by its distances from both ends. Holes do not count.
//!
//! A region reaches half a voxel beyond its outermost vertices at each end.

use super::regions::Region;
use super::surface::Surface;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Times that the farthest point of the farthest point is looked for.
const TURNS: usize = 4;
/// Half the thickness of a slice in voxels.
const SLICE: f64 = 2.0;

/// Length and width, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    pub(crate) length: f64,
    pub(crate) width: f64,
}

impl Extent {
    /// Measures `region`.
    pub(crate) fn of(surface: &Surface<'_>, region: &Region) -> Self {
        let ways = Ways::new(surface, region);
        let (mut from, mut to, mut longest) = (0, 0, Vec::new());
        let mut length = -1.0;
        let mut start = ways.outermost();
        for _ in 0..TURNS {
            let distances = ways.distances(start);
            let far = farthest(&distances);
            if distances[far] <= length {
                break;
            }
            (from, to, length, longest) = (start, far, distances[far], distances);
            start = far;
        }
        let back = ways.distances(to);
        debug_assert!(longest.len() == back.len() && longest[from] == 0.0);
        let area = region.area(surface);
        let length = length.max(0.0) + surface.voxel;
        if length < 3.0 * surface.voxel {
            return Self { length, width: area / length };
        }
        Self { length, width: widest_slice(surface, region, &longest, &back).max(area / length) }
    }
}

/// Largest area of a slice across the way by its thickness. `from` and `back` are the distances of the vertices from both
/// ends.
fn widest_slice(surface: &Surface<'_>, region: &Region, from: &[f64], back: &[f64]) -> f64 {
    let voxel = surface.voxel;
    let whole = from.iter().copied().fold(0.0, f64::max);
    let mut slices = vec![0.0; (whole / voxel) as usize + 2];
    for (i, v) in region.vertices.iter().enumerate() {
        // Where the foot of the vertex on the straight way lies, in the plane that both distances span.
        let along = (from[i] * from[i] - back[i] * back[i] + whole * whole) / (2.0 * whole);
        let along = along.clamp(0.0, whole) / voxel;
        let (first, last) = ((along - SLICE).ceil().max(0.0) as usize, (along + SLICE).floor() as usize);
        for (k, slice) in slices.iter_mut().enumerate().take(last + 1).skip(first) {
            // Slices overlap and fade out towards their sides, so that the grid of the vertices does not show.
            let weight = (1.0 - (k as f64 - along).abs() / SLICE).max(0.0) / SLICE;
            *slice += weight * surface.areas[*v as usize];
        }
    }
    slices.into_iter().fold(0.0, f64::max) / voxel
}

/// Number of the largest distance.
fn farthest(distances: &[f64]) -> usize {
    (0..distances.len()).fold(0, |best, i| if distances[i] > distances[best] { i } else { best })
}

/// A region as ways over it need it: its vertices by their place in the region, with the pieces of surface beside each.
struct Ways<'a> {
    surface: &'a Surface<'a>,
    region: &'a Region,
    /// First edge of each vertex, and one past the last.
    edge_starts: Vec<usize>,
    /// Place and distance of each vertex's neighbours in the region.
    edges: Vec<(u32, f64)>,
    /// First wedge of each vertex, and one past the last.
    wedge_starts: Vec<usize>,
    wedges: Vec<Wedge>,
}

/// A face of the region as one of its corners sees it: the places of the two others, and the lengths of the edges, metres.
struct Wedge {
    others: [u32; 2],
    to_others: [f64; 2],
    between: f64,
}

/// A finite distance in the order of its size.
#[derive(Clone, Copy, PartialEq)]
struct Distance(f64);

impl Eq for Distance {}

impl PartialOrd for Distance {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Distance {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl<'a> Ways<'a> {
    fn new(surface: &'a Surface<'a>, region: &'a Region) -> Self {
        let (mut edge_starts, mut edges, mut wedge_starts, mut wedges) = (vec![0], Vec::new(), vec![0], Vec::new());
        for &v in &region.vertices {
            let first = edges.len();
            for &w in surface.neighbours(v) {
                let place = region.vertices.binary_search(&w).ok();
                edges.extend(place.map(|place| (place as u32, surface.edge_length(v, w))));
            }
            edge_starts.push(edges.len());
            // The other corners of its faces are among its neighbours.
            let beside = &edges[first..];
            for &face in surface.faces(v) {
                let mut others = surface.corners(face).into_iter().filter(|w| *w != v);
                let (Some(u), Some(w)) = (others.next(), others.next()) else { continue };
                let found = |w: u32| beside.iter().find(|(place, _)| region.vertices[*place as usize] == w);
                let (Some(&left), Some(&right)) = (found(u), found(w)) else { continue };
                let between = surface.edge_length(u, w);
                wedges.push(Wedge { others: [left.0, right.0], to_others: [left.1, right.1], between });
            }
            wedge_starts.push(wedges.len());
        }
        Self { surface, region, edge_starts, edges, wedge_starts, wedges }
    }

    /// The vertex farthest from the middle: the search begins there.
    fn outermost(&self) -> usize {
        let middle = [0, 1, 2].map(|k| self.region.mean(self.surface, |v| self.surface.position(v)[k]));
        let away = |i: &usize| {
            semascan_geometry::vector::squared_distance(self.surface.position(self.region.vertices[*i]), middle)
        };
        (0..self.region.vertices.len()).fold(0, |best, i| if away(&i) > away(&best) { i } else { best })
    }

    /// Distance of each vertex from vertex number `source`, metres.
    fn distances(&self, source: usize) -> Vec<f64> {
        let count = self.region.vertices.len();
        let mut found = vec![f64::INFINITY; count];
        let mut done = vec![false; count];
        let mut reached = Reached::from([Reverse((Distance(0.0), source as u32))]);
        found[source] = 0.0;
        while let Some(Reverse((_, at))) = reached.pop() {
            let at = at as usize;
            if std::mem::replace(&mut done[at], true) {
                continue;
            }
            let here = found[at];
            for &(place, length) in &self.edges[self.edge_starts[at]..self.edge_starts[at + 1]] {
                offer(&mut found, &mut reached, place, here + length);
            }
            for wedge in &self.wedges[self.wedge_starts[at]..self.wedge_starts[at + 1]] {
                for (second, third) in [(0, 1), (1, 0)] {
                    let [known, wanted] = [second, third].map(|k: usize| wedge.others[k]);
                    if done[known as usize] && !done[wanted as usize] {
                        let [to_known, to_wanted] = [second, third].map(|k: usize| wedge.to_others[k]);
                        let from_known = found[known as usize];
                        if let Some(distance) = across_face([to_known, to_wanted, wedge.between], here, from_known) {
                            offer(&mut found, &mut reached, wanted, distance);
                        }
                    }
                }
            }
        }
        found
    }
}

/// Vertices that were reached, the nearest first.
type Reached = BinaryHeap<Reverse<(Distance, u32)>>;

/// A way to `place` of this distance: taken if it is the shortest yet.
fn offer(found: &mut [f64], reached: &mut Reached, place: u32, distance: f64) {
    if distance < found[place as usize] {
        found[place as usize] = distance;
        reached.push(Reverse((Distance(distance), place)));
    }
}

/// Distance of corner `c` of a face with the edges `ab`, `ac` and `bc`, whose corners `a` and `b` have the distances `from_a`
/// and `from_b`, along a straight way that crosses the edge between these; `None` where there is none.
fn across_face([ab, ac, bc]: [f64; 3], from_a: f64, from_b: f64) -> Option<f64> {
    // In the plane of the face: a in the origin, b on the x axis, c above it and the source below.
    let foot = |to_a: f64, to_b: f64| {
        let x = (to_a * to_a - to_b * to_b + ab * ab) / (2.0 * ab);
        let squared = to_a * to_a - x * x;
        (squared >= 0.0).then(|| (x, squared.sqrt()))
    };
    let (corner, source) = (foot(ac, bc)?, foot(from_a, from_b)?);
    let height = corner.1 + source.1;
    let crossing = source.0 + (corner.0 - source.0) * source.1 / height;
    (height > 0.0 && (0.0..=ab).contains(&crossing)).then(|| (corner.0 - source.0).hypot(height))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::regions::defect_regions;
    use super::*;
    use semascan_model::SemanticMesh;

    fn extent(mesh: &SemanticMesh) -> Extent {
        let surface = Surface::new(mesh, 1e-3);
        Extent::of(&surface, &defect_regions(&surface)[0])
    }

    fn within(stated: f64, millimetres: f64, tolerance: f64) {
        assert!((stated * 1e3 - millimetres).abs() < tolerance, "{} mm for {millimetres} mm", stated * 1e3);
    }

    #[test]
    fn a_strip_in_any_direction_is_as_long_and_wide_as_it_is() {
        for degrees in [0.0_f32, 17.0, 26.6, 45.0, 71.0, 112.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let inside = |x: f32, y: f32| {
                let (x, y) = (x - 30.0, y - 30.0);
                (cosine * x + sine * y).abs() < 20.0 && (cosine * y - sine * x).abs() < 5.0
            };
            let extent = extent(&with_defect(grid(61, 61, |_, _| 0.0), inside));
            // From corner to corner.
            within(extent.length, 40.0_f64.hypot(10.0), 1.6);
            within(extent.width, 10.0, 1.6);
        }
    }

    #[test]
    fn a_disc_is_as_wide_as_long_and_roughness_does_not_matter() {
        for rough in [0.0, 2e-4] {
            let mesh = grid(41, 41, |x, y| if (x + y) % 2 == 0 { rough } else { 0.0 });
            let extent = extent(&with_defect(mesh, |x, y| (x - 20.3).hypot(y - 19.8) < 15.0));
            within(extent.length, 30.0, 1.0);
            within(extent.width, 30.0, 1.2);
        }
    }

    #[test]
    fn a_bent_crack_is_measured_along_its_course() {
        // Three quarters of a ring.
        let inside = |x: f32, y: f32| {
            let (x, y) = (x - 30.0, y - 30.0);
            (x.hypot(y) - 20.0).abs() < 1.6 && !(x > 0.0 && y > 0.0)
        };
        let extent = extent(&with_defect(grid(61, 61, |_, _| 0.0), inside));
        // The shortest way hugs the inner rim.
        let (inner, middle) = (0.75 * std::f64::consts::TAU * 18.4, 0.75 * std::f64::consts::TAU * 20.0);
        let length = extent.length * 1e3;
        assert!(length > inner - 1.0 && length < middle + 2.0, "{length} mm, {inner} to {middle}");
        within(extent.width, 3.2, 0.9);
    }

    #[test]
    fn a_way_over_a_cylinder_follows_it() {
        // A grid wound around a cylinder of radius 10 mm, half of it around.
        let mut mesh = grid(32, 12, |_, _| 0.0);
        for v in 0..mesh.len() {
            let (x, y) = (f64::from(mesh.vertices.positions[v][0]), mesh.vertices.positions[v][1]);
            let (sine, cosine) = (x / 10e-3).sin_cos();
            mesh.vertices.positions[v] = [(10e-3 * sine) as f32, y, (10e-3 * cosine) as f32];
            mesh.vertices.normals[v] = [sine as f32, 0.0, cosine as f32];
            let across = (1.5e-3..9.5e-3).contains(&y);
            mesh.vertices.defects[v] = u16::from(across && (1.5e-3..29.5e-3).contains(&x));
        }
        let extent = extent(&mesh);
        within(extent.length, 28.0_f64.hypot(8.0), 0.8);
        within(extent.width, 8.0, 1.0);
    }

    #[test]
    fn a_single_vertex_is_a_voxel_long() {
        let extent = extent(&with_defect(grid(5, 5, |_, _| 0.0), |x, y| (x, y) == (2.0, 2.0)));
        within(extent.length, 1.0, 1e-6);
        within(extent.width, 1.0, 0.05);
    }
}
