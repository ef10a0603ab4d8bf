//! Sections of solids whose sections are known, and of random surfaces.

use super::*;
use proptest::prelude::*;
use semascan_model::SemanticMesh;
use semascan_model::SemanticPoint;
use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

const Z: [f64; 3] = [0.0, 0.0, 1.0];

fn mesh(places: &[[f32; 3]], labels: &[u16], triangles: &[[u32; 3]]) -> SemanticMesh {
    let mut mesh = SemanticMesh { triangles: triangles.to_vec(), ..SemanticMesh::default() };
    for (place, label) in places.iter().zip(labels.iter().cycle()) {
        mesh.push(SemanticPoint { position: *place, label: *label, ..SemanticPoint::UNKNOWN }, false);
    }
    mesh
}

/// A tube along z from 0 to 1 of so many sides, wound from outside; inside out if `hollow`.
fn tube(mesh: &mut SemanticMesh, radius: f32, sides: u32, label: u16, hollow: bool) {
    let first = mesh.len() as u32;
    for k in 0..sides {
        let (sine, cosine) = (k as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
        for z in [0.0, 1.0] {
            let position = [radius * cosine, radius * sine, z];
            mesh.push(SemanticPoint { position, label, ..SemanticPoint::UNKNOWN }, false);
        }
    }
    for k in 0..sides {
        let [a, b] = [first + 2 * k, first + 2 * ((k + 1) % sides)];
        for [i, j, k] in [[a, b, a + 1], [b, b + 1, a + 1]] {
            mesh.triangles.push(if hollow { [i, k, j] } else { [i, j, k] });
        }
    }
}

fn level(height: f64) -> Plane {
    Plane::through([0.0, 0.0, height], Z).expect("a plane")
}

fn all(mesh: &SemanticMesh, plane: Plane) -> PlaneSection {
    PlaneSection::of(mesh, plane, |_| true)
}

/// Area with sign: what lies to the left of a ring counts.
fn signed(ring: &[Place]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum()
}

#[test]
fn a_pipe_is_cut_into_two_rings_and_its_wall_is_as_thick_as_it_is() {
    let mut pipe = SemanticMesh::default();
    tube(&mut pipe, 2.0, 90, 1, false);
    tube(&mut pipe, 1.5, 90, 2, true);
    let section = all(&pipe, level(0.3));
    assert_eq!((section.outlines.len(), section.open()), (2, 0));
    let [outer, inner] = [0, 1].map(|i| &section.outlines[i]);
    assert!(outer.labels.iter().all(|l| *l == 1) && inner.labels.iter().all(|l| *l == 2));
    assert!(signed(&outer.places) > 0.0 && signed(&inner.places) < 0.0, "material lies to the left");
    assert!((section.length() - TAU * 3.5).abs() < 0.01 * TAU * 3.5, "{}", section.length());
    let wall = PI * (2.0 * 2.0 - 1.5 * 1.5);
    assert!((area(&fill(&section.rings)) - wall).abs() < 0.005 * wall);

    let across = section.across([1.2, 1.3]).expect("the wall");
    assert!((across.length() - 0.5).abs() < 0.003, "{}", across.length());
    assert_eq!(BTreeSet::from(across.ends.map(|end| end.label)), BTreeSet::from([1, 2]));
    let bore = section.across([0.3, 0.1]).expect("the bore");
    assert!((bore.length() - 3.0).abs() < 0.01, "{}", bore.length());
    assert_eq!(section.across([9.0, 0.0]), None, "from beside it nothing lies farther out");
    assert!(section.nearest([0.0, 2.2]).is_some_and(|spot| (spot.place[1] - 2.0).abs() < 2e-3 && spot.label == 1));
}

#[test]
fn what_ends_at_a_rim_stays_open() {
    let mut pipe = SemanticMesh::default();
    tube(&mut pipe, 2.0, 36, 1, false);
    // A slot: two of the sides are gone.
    pipe.triangles.drain(..4);
    let section = all(&pipe, level(0.5));
    let [line] = section.outlines.as_slice() else { panic!("{} outlines", section.outlines.len()) };
    assert!(!line.is_closed() && section.rings.is_empty() && section.open() == 1);
    let rims: Vec<Place> = line.rims().collect();
    assert_eq!(rims.len(), 2);
    assert!(rims.iter().all(|[x, y]| (x.hypot(*y) - 2.0).abs() < 1e-6 && *x > 1.8), "at the slot: {rims:?}");
    assert!(fill(&section.rings).is_empty());
    // Lengthwise both ends of the tube are open.
    let along = all(&pipe, Plane::through([0.0, 0.3, 0.0], [0.0, 1.0, 0.0]).expect("a plane"));
    assert_eq!((along.open(), along.rings.len()), (1, 0), "one side is there, in the place of the other is the slot");
}

#[test]
fn components_are_told_apart_by_segment_and_left_out_where_they_are_hidden() {
    let mut pipe = SemanticMesh::default();
    tube(&mut pipe, 1.0, 12, 1, false);
    // Half of it is another component.
    for (place, label) in pipe.vertices.positions.iter().zip(&mut pipe.vertices.labels) {
        *label = if place[0] > 0.1 { 2 } else { 1 };
    }
    let section = all(&pipe, level(0.5));
    assert!(section.outlines.len() == 1 && section.outlines[0].is_closed());
    assert_eq!(section.outlines[0].labels.iter().copied().collect::<BTreeSet<_>>(), BTreeSet::from([1, 2]));
    let shown = PlaneSection::of(&pipe, level(0.5), |label| label == 2);
    assert!(shown.open() == 1 && shown.outlines[0].labels.iter().all(|l| *l == 2));
}

/// An octahedron: its corners, edges and faces meet planes in every way.
fn octahedron() -> SemanticMesh {
    let places =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    mesh(&places, &[1], &faces)
}

#[test]
fn planes_through_corners_edges_and_faces_cut_closed_lines_or_none() {
    let solid = octahedron();
    // Through four corners, and along the four edges between them.
    let equator = all(&solid, level(0.0));
    assert_eq!((equator.outlines.len(), equator.outlines[0].places.len(), equator.open()), (1, 4, 0));
    assert!((area(&fill(&equator.rings)) - 2.0).abs() < 1e-9);
    // Through a corner alone, from either side.
    assert!(all(&solid, level(1.0)).outlines.is_empty() && all(&solid, level(-1.0)).outlines.is_empty());
    // Through two opposite edges' middles and two corners.
    let oblique = all(&solid, Plane::through([0.0; 3], [1.0, 1.0, 0.0]).expect("a plane"));
    assert!(oblique.outlines.len() == 1 && oblique.open() == 0);
    // Along a face: its border, or nothing.
    let face = all(&solid, Plane::through([1.0, 0.0, 0.0], [1.0, 1.0, 1.0]).expect("a plane"));
    assert!(face.outlines.len() <= 1 && face.open() == 0);
    // Beside it.
    assert!(all(&solid, level(2.0)).outlines.is_empty());
    assert!(all(&SemanticMesh::default(), level(0.0)).outlines.is_empty());
    assert!(all(&mesh(&[[f32::NAN; 3]; 3], &[1], &[[0, 1, 2], [7, 8, 9]]), level(0.0)).outlines.is_empty());
}

#[test]
fn a_window_ends_lines_and_areas() {
    let mut pipe = SemanticMesh::default();
    tube(&mut pipe, 2.0, 360, 1, false);
    let (plane, section) = (level(0.5), all(&pipe, level(0.5)));
    let within = |low: [f64; 3], high: [f64; 3]| section.within(&Window::of_box(&plane, [low, high]));
    let half = within([0.0, -5.0, -5.0], [5.0; 3]);
    let [line] = half.outlines.as_slice() else { panic!("{:?}", half.outlines.len()) };
    assert_eq!((line.ends, half.open()), (Some([End::Window; 2]), 0), "it is no rim");
    assert!((half.length() - TAU).abs() < 1e-3 && (area(&fill(&half.rings)) - TAU).abs() < 1e-3);
    let whole = within([-5.0; 3], [5.0; 3]);
    assert!(whole.outlines[0].is_closed() && whole.outlines[0].places.len() == section.outlines[0].places.len());
    assert!(within([-5.0; 3], [5.0, 5.0, 0.4]).outlines.is_empty(), "the plane lies above the box");
    assert!(within([-5.0; 3], [5.0, 5.0, 0.4]).rings.is_empty());
    let strip = within([-5.0, -1.0, -5.0], [5.0, 1.0, 5.0]);
    assert_eq!(strip.outlines.len(), 2);
    // Two arcs of 60 degrees; the strip holds two triangles and two sectors.
    assert!((strip.length() - 2.0 * TAU / 3.0).abs() < 1e-3, "{}", strip.length());
    let area_of_strip = 2.0 * 3.0_f64.sqrt() + 4.0 * PI / 3.0;
    assert!((area(&fill(&strip.rings)) - area_of_strip).abs() < 1e-3);
}

#[test]
fn a_hole_in_a_ring_is_not_filled() {
    let square = |half: f64| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
    assert!((area(&fill(&[square(2.0), square(1.0)])) - 12.0).abs() < 1e-9);
    assert!((area(&fill(&[square(2.0), square(1.0), square(0.5)])) - 13.0).abs() < 1e-9);
    assert!(fill(&[]).is_empty() && fill(&[vec![[f64::NAN; 2]; 3]]).is_empty());
}

/// A closed surface: an octahedron whose faces are split so many times, its vertices at random distances from the middle.
fn potato(splits: usize, radii: &[f64]) -> SemanticMesh {
    let mut solid = octahedron();
    for _ in 0..splits {
        let mut halves = std::collections::BTreeMap::new();
        let faces = std::mem::take(&mut solid.triangles);
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *halves.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let [p, q] = [i, j].map(|v| solid.vertices.positions[v as usize]);
                    let position = [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]));
                    solid.push(SemanticPoint { position, label: 1, ..SemanticPoint::UNKNOWN }, false)
                })
            });
            solid.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
    for (place, radius) in solid.vertices.positions.iter_mut().zip(radii.iter().cycle()) {
        let length = place.iter().map(|c| c * c).sum::<f32>().sqrt();
        *place = place.map(|c| c / length * *radius as f32);
    }
    solid
}

fn plane() -> impl Strategy<Value = Plane> {
    let normal = prop::array::uniform3(-1.0..1.0_f64).prop_filter("a direction", |n| n.iter().any(|c| c.abs() > 0.1));
    (normal, prop::array::uniform3(-0.4..0.4_f64)).prop_filter_map("a plane", |(n, p)| Plane::through(p, n))
}

proptest! {
    /// Every place lies on the plane and, as the surface is closed, every line is closed; what lies to the left of lines is what is
    /// filled.
    #[test]
    fn a_closed_surface_has_closed_outlines(radii in prop::collection::vec(0.5..1.5_f64, 17), plane in plane()) {
        let solid = potato(2, &radii);
        let section = all(&solid, plane);
        prop_assert!(!section.outlines.is_empty() && section.open() == 0);
        for outline in &section.outlines {
            prop_assert!(outline.is_closed() && outline.labels.len() == outline.places.len());
            for place in &outline.places {
                prop_assert!(plane.height(plane.lift(*place)).abs() < 1e-9);
            }
        }
        let left: f64 = section.rings.iter().map(|ring| signed(ring)).sum();
        let filled = area(&fill(&section.rings));
        prop_assert!((filled - left).abs() < 1e-9, "{filled} filled, {left} to the left");
        prop_assert_eq!(&section, &all(&solid, plane), "the same again");
    }

    /// Surfaces with holes: each crossed triangle is in one outline, and an outline is open only at the rim of a hole.
    #[test]
    fn open_ends_lie_on_rims(radii in prop::collection::vec(0.5..1.5_f64, 13), plane in plane(), kept in prop::collection::vec(prop::bool::weighted(0.85), 128)) {
        let mut solid = potato(2, &radii);
        let mut keep = kept.into_iter();
        solid.triangles.retain(|_| keep.next().unwrap_or(true));
        let section = all(&solid, plane);
        let heights: Vec<f64> = solid.vertices.positions.iter().map(|p| plane.height(p.map(f64::from))).collect();
        let crossed = solid.triangles.iter().filter(|t| t.iter().any(|v| heights[*v as usize] >= 0.0) && t.iter().any(|v| heights[*v as usize] < 0.0));
        let segments: usize = section.outlines.iter().map(|o| o.labels.len()).sum();
        prop_assert!(segments <= crossed.count());
        let mut edges = std::collections::BTreeMap::new();
        for t in &solid.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
            }
        }
        let rim = edges.iter().filter(|(_, n)| **n == 1).map(|((a, b), _)| [*a, *b].map(|v| solid.vertices.positions[v as usize].map(f64::from)));
        let rims: Vec<[[f64; 3]; 2]> = rim.collect();
        for end in section.outlines.iter().flat_map(|o| o.rims()) {
            let end = plane.lift(end);
            let off = rims.iter().map(|[a, b]| {
                let way = |p: [f64; 3], q: [f64; 3]| crate::vector::squared_distance(p, q).sqrt();
                way(*a, end) + way(end, *b) - way(*a, *b)
            });
            prop_assert!(off.fold(f64::MAX, f64::min) < 1e-6, "an end off every rim");
        }
    }

    /// A window and what lies beyond it are the whole.
    #[test]
    fn lengths_and_areas_on_both_sides_of_an_edge_add_up(radii in prop::collection::vec(0.5..1.5_f64, 11), plane in plane(), at in -0.8..0.8_f64) {
        let section = all(&potato(2, &radii), plane);
        let box_between = |low: f64, high: f64| Window::of_box(&plane, [[low, -9.0, -9.0], [high, 9.0, 9.0]]);
        let parts = [box_between(-9.0, at), box_between(at, 9.0)].map(|window| section.within(&window));
        let lengths: f64 = parts.iter().map(PlaneSection::length).sum();
        prop_assert!((lengths - section.length()).abs() < 1e-9, "{lengths} of {}", section.length());
        let areas: f64 = parts.iter().map(|part| area(&fill(&part.rings))).sum();
        let whole = area(&fill(&section.rings));
        prop_assert!((areas - whole).abs() < 1e-9, "{areas} of {whole}");
        prop_assert!(parts.iter().all(|part| part.open() == 0));
    }
}
