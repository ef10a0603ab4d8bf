//! Length and width of a region along the surface.
//!
//! The length is the longest of the shortest ways ([`Geodesics`]) on the region's own surface between two of its points: that
//! of a bent crack follows its course. It is searched between ends by turns (the farthest point of the farthest point), which
//! finds the diameter of a tree and all but that of other shapes.
//!
//! The width is the largest extent across this way: the area of a slice divided by its thickness, where each vertex lies
//! along the way by its distances from both ends. Holes do not count.
//!
//! A region reaches half a voxel beyond its outermost vertices at each end.

use super::regions::Region;
use super::surface::Surface;
use semascan_geometry::measure::Geodesics;

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

/// Ways over a region, whose vertices are known by their places in it.
struct Ways<'a> {
    surface: &'a Surface<'a>,
    region: &'a Region,
    geodesics: Geodesics,
}

impl<'a> Ways<'a> {
    fn new(surface: &'a Surface<'a>, region: &'a Region) -> Self {
        let vertex = |place: u32| region.vertices[place as usize];
        let place = |v: u32| region.vertices.binary_search(&v).ok().map(|place| place as u32);
        let neighbours = |at: u32| surface.neighbours(vertex(at)).iter().filter_map(|v| place(*v));
        let faces = |at: u32| {
            let around = surface.faces(vertex(at)).iter().map(|face| surface.corners(*face));
            around.filter_map(|[a, b, c]| Some([place(a)?, place(b)?, place(c)?]))
        };
        let length = |a: u32, b: u32| surface.edge_length(vertex(a), vertex(b));
        let geodesics = Geodesics::new(region.vertices.len() as u32, neighbours, faces, length);
        Self { surface, region, geodesics }
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
        self.geodesics.distances(&[(source as u32, 0.0)]).metres
    }
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
