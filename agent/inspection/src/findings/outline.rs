//! The outline of a region: closed curves on the mesh.
//!
//! Each vertex stands for a third of its faces. So within a face that only partly belongs to the region the outline runs
//! from the middle of an edge through the centroid of the face to the middle of another (barycentric dual cells), and along
//! the edges where the mesh ends. It encloses exactly the area that the region's vertices stand for on the faces.
//!
//! For the record curves are smoothed over a voxel or two, which takes the staircase of the grid out of their length, and
//! simplified ([Douglas 1973]).

use super::regions::Region;
use super::surface::Surface;
use semascan_geometry::vector::{dot, length, squared_distance, sub};
use std::collections::BTreeMap;

/// How far a simplified outline may lie from the smoothed one, in voxels.
const TOLERANCE: f64 = 0.25;
/// Rounds of smoothing with the weights 1/4, 1/2, 1/4.
const ROUNDS: u32 = 10;

/// A point of an outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Node {
    Vertex(u32),
    /// Middle of the edge between two vertices, the lower one first.
    Edge(u32, u32),
    /// Centroid of a face.
    Face(u32),
}

/// What a piece of an outline runs along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beyond {
    /// The same component without the defect, or with another.
    SameComponent,
    /// Another component.
    OtherComponent,
    /// Nothing that was seen.
    Unseen,
}

/// The outlines of a region.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outline {
    /// Closed curves in the table frame, simplified; the first is the outer one. The region lies to the left, seen from
    /// outside.
    pub(crate) curves: Vec<Vec<[f64; 3]>>,
    /// Length of these curves in metres: where the component goes on beyond, where another begins, and where nothing was seen
    /// beyond.
    pub(crate) along_component: f64,
    /// See [`Self::along_component`].
    pub(crate) along_others: f64,
    /// See [`Self::along_component`].
    pub(crate) along_unseen: f64,
}

impl Outline {
    /// The outline of `region`.
    pub(crate) fn of(surface: &Surface<'_>, region: &Region) -> Self {
        let mut along = [0.0; 3];
        let mut curves = Vec::new();
        for curve in curves_on_mesh(surface, region) {
            let (points, beyond): (Vec<[f64; 3]>, Vec<Beyond>) = curve.into_iter().unzip();
            let points = smoothed(points);
            for (k, beyond) in beyond.into_iter().enumerate() {
                along[beyond as usize] += length(sub(points[(k + 1) % points.len()], points[k]));
            }
            curves.push(simplify(&points, TOLERANCE * surface.voxel));
        }
        let [along_component, along_others, along_unseen] = along;
        Self { curves, along_component, along_others, along_unseen }
    }

    /// Length in metres.
    pub(crate) fn length(&self) -> f64 {
        self.along_component + self.along_others + self.along_unseen
    }
}

/// A closed curve, each point with what lies beyond the piece that begins there.
type Curve = Vec<([f64; 3], Beyond)>;

/// The closed curves around a region on the faces of the mesh, the outer one first.
fn curves_on_mesh(surface: &Surface<'_>, region: &Region) -> Vec<Curve> {
    let mut next: BTreeMap<Node, BTreeMap<Node, Beyond>> = BTreeMap::new();
    for (from, to, beyond) in steps(surface, region) {
        next.entry(from).or_default().insert(to, beyond);
    }
    let placed =
        |curve: Vec<(Node, Beyond)>| curve.into_iter().map(|(n, beyond)| (place(surface, n), beyond)).collect();
    let mut curves: Vec<Curve> = closed(next).into_iter().map(placed).collect();
    // The outer curve has the largest extent; the others in the order of theirs.
    curves.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
    curves
}

/// The pieces of the outline, each with what lies beyond it.
fn steps(surface: &Surface<'_>, region: &Region) -> Vec<(Node, Node, Beyond)> {
    let edge = |a: u32, b: u32| Node::Edge(a.min(b), a.max(b));
    let mut faces: Vec<u32> = region.vertices.iter().flat_map(|v| surface.faces(*v)).copied().collect();
    faces.sort_unstable();
    faces.dedup();
    let mut steps = Vec::new();
    for face in faces {
        let corners = surface.corners(face);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let (in_a, in_b) = (region.holds(a), region.holds(b));
            let beyond = |v: u32| {
                if surface.component(v) == region.component { Beyond::SameComponent } else { Beyond::OtherComponent }
            };
            match (in_a, in_b) {
                (true, false) => steps.push((edge(a, b), Node::Face(face), beyond(b))),
                (false, true) => steps.push((Node::Face(face), edge(a, b), beyond(a))),
                _ => {}
            }
            let is_open = surface.faces(a).iter().filter(|f| surface.corners(**f).contains(&b)).count() == 1;
            if is_open && in_a {
                steps.push((Node::Vertex(a), edge(a, b), Beyond::Unseen));
            }
            if is_open && in_b {
                steps.push((edge(a, b), Node::Vertex(b), Beyond::Unseen));
            }
        }
    }
    steps
}

fn place(surface: &Surface<'_>, node: Node) -> [f64; 3] {
    let mean = |vertices: &[u32]| {
        let share = 1.0 / vertices.len() as f64;
        vertices.iter().map(|v| surface.position(*v)).fold([0.0; 3], |sum, p| [0, 1, 2].map(|k| sum[k] + share * p[k]))
    };
    match node {
        Node::Vertex(v) => surface.position(v),
        Node::Edge(a, b) => mean(&[a, b]),
        Node::Face(face) => mean(&surface.corners(face)),
    }
}

/// Closed curves through the steps. Where several meet in a node, each step is used once.
fn closed(mut next: BTreeMap<Node, BTreeMap<Node, Beyond>>) -> Vec<Vec<(Node, Beyond)>> {
    let mut curves = Vec::new();
    while let Some((&first, _)) = next.first_key_value() {
        let (mut curve, mut at) = (Vec::new(), first);
        while let Some(following) = next.get_mut(&at) {
            let Some((to, beyond)) = following.pop_first() else { break };
            if following.is_empty() {
                next.remove(&at);
            }
            curve.push((at, beyond));
            at = to;
            if at == first {
                break;
            }
        }
        if curve.len() > 2 {
            curves.push(curve);
        }
        next.retain(|_, following| !following.is_empty());
    }
    curves
}

/// Diagonal of the box around a curve, squared.
fn extent(curve: &Curve) -> f64 {
    (0..3)
        .map(|k| {
            let along = curve.iter().map(|(p, _)| p[k]);
            let (low, high) = (along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max));
            (high - low) * (high - low)
        })
        .sum()
}

/// A closed curve without the staircase of the grid.
fn smoothed(curve: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let n = curve.len();
    (0..ROUNDS).fold(curve, |curve, _| {
        let mean = |i: usize| {
            let [before, here, after] = [i + n - 1, i, i + 1].map(|k| curve[k % n]);
            [0, 1, 2].map(|k| 0.25 * before[k] + 0.5 * here[k] + 0.25 * after[k])
        };
        (0..n).map(mean).collect()
    })
}

/// A closed curve with fewer points, none of the others farther from it than `tolerance`.
fn simplify(curve: &[[f64; 3]], tolerance: f64) -> Vec<[f64; 3]> {
    let farthest_from = |from: [f64; 3]| {
        (0..curve.len()).fold(0, |best, i| {
            if squared_distance(curve[i], from) > squared_distance(curve[best], from) { i } else { best }
        })
    };
    if curve.len() < 4 {
        return curve.to_vec();
    }
    // Two points that are far apart stay: each half is an open curve between them.
    let a = farthest_from(curve[0]);
    let b = farthest_from(curve[a]);
    let turned: Vec<[f64; 3]> = (0..=curve.len()).map(|i| curve[(a + i) % curve.len()]).collect();
    let middle = (b + curve.len() - a) % curve.len();
    let mut keep = vec![false; turned.len()];
    (keep[0], keep[middle]) = (true, true);
    let mut work = vec![(0, middle), (middle, curve.len())];
    while let Some((from, to)) = work.pop() {
        let distance = |i: usize| squared_distance_to_segment(turned[i], turned[from], turned[to]);
        let Some(far) = (from + 1..to).max_by(|i, j| distance(*i).total_cmp(&distance(*j))) else { continue };
        if distance(far) > tolerance * tolerance {
            keep[far] = true;
            work.extend([(from, far), (far, to)]);
        }
    }
    turned.into_iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| p).collect()
}

fn squared_distance_to_segment(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let (along, to) = (sub(b, a), sub(p, a));
    let share = (dot(along, to) / dot(along, along).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    squared_distance(to, along.map(|c| c * share))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::regions::defect_regions;
    use super::*;
    use semascan_model::SemanticMesh;

    /// The outlines of the first region, the curves on the mesh, and what its vertices stand for.
    fn outline(mesh: &SemanticMesh) -> (Outline, Vec<Curve>, f64) {
        let surface = Surface::new(mesh, 1e-3);
        let region = &defect_regions(&surface)[0];
        let thirds = region.vertices.iter().flat_map(|v| surface.faces(*v)).count() as f64 / 3.0 * 0.5e-6;
        (Outline::of(&surface, region), curves_on_mesh(&surface, region), thirds)
    }

    /// Enclosed area of a curve in the plane z = 0, positive where it runs counter-clockwise.
    fn enclosed(curve: &Curve) -> f64 {
        (0..curve.len())
            .map(|i| {
                let (p, q) = (curve[i].0, curve[(i + 1) % curve.len()].0);
                0.5 * (p[0] * q[1] - p[1] * q[0])
            })
            .sum()
    }

    #[test]
    fn a_ring_has_two_outlines_that_enclose_what_its_vertices_stand_for() {
        let ring = |x: f32, y: f32| (4.2..8.6).contains(&(x - 15.0).hypot(y - 15.0));
        let (outline, curves, thirds) = outline(&with_defect(grid(31, 31, |_, _| 0.0), ring));
        assert_eq!(curves.len(), 2);
        let areas: Vec<f64> = curves.iter().map(enclosed).collect();
        assert!(areas[0] > 0.0 && areas[1] < 0.0, "the region lies to the left: {areas:?}");
        assert!((areas.iter().sum::<f64>() - thirds).abs() < 1e-9, "{areas:?} for {thirds}");
        // The staircase is taken out: the simplified curves are about as long as the circles.
        let circles = std::f64::consts::TAU * (4.2 + 8.6) * 1e-3;
        assert!((outline.length() / circles - 1.0).abs() < 0.06, "{} for {circles}", outline.length());
        assert!(outline.curves[0].len() < curves[0].len() / 4);
        assert!(outline.along_others == 0.0 && outline.along_unseen == 0.0);
    }

    #[test]
    fn what_lies_beyond_an_outline_is_known() {
        // The left third, which ends at the rim on three sides; a second component begins at half its height.
        let mut mesh = with_defect(grid(31, 21, |_, _| 0.0), |x, _| x < 10.2);
        for v in 0..mesh.len() {
            mesh.vertices.labels[v] = if mesh.vertices.positions[v][1] < 10.2e-3 { 1 } else { 2 };
        }
        let (outline, curves, thirds) = outline(&mesh);
        assert_eq!(curves.len(), 1);
        assert!((enclosed(&curves[0]) - thirds).abs() < 1e-9);
        let near = |stated: f64, expected: f64| (stated - expected * 1e-3).abs() < 1.6e-3;
        assert!(near(outline.along_component, 10.5) && near(outline.along_others, 10.5), "{outline:?}");
        assert!(near(outline.along_unseen, 21.0), "{}", outline.along_unseen);
    }

    #[test]
    fn a_single_vertex_has_an_outline() {
        let (outline, curves, thirds) = outline(&with_defect(grid(5, 5, |_, _| 0.0), |x, y| (x, y) == (2.0, 2.0)));
        assert!(curves.len() == 1 && (enclosed(&curves[0]) - thirds).abs() < 1e-9 && outline.length() > 0.0);
    }
}
