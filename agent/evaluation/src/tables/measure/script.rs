//! The measurements of one motor.

use super::clicks::{Pixel, at_pixels, next_to, on_surface};
use super::{Kind, Measurement, Motor};
use crate::poses::{PosePair, align_poses};
use nalgebra::{Isometry3, Matrix6, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use semascan_geometry::fit::{
    Circle, Cylinder, Element, ElementKind, Feature, Fit, MeshRegions, Plane, Relation, SurfaceErrors, angle, distance,
    step_height,
};
use semascan_geometry::measure::dimensions::grid_uncertainty;
use semascan_inspection::Inspected;
use semascan_inspection::source::Source;
use semascan_simulation::raycast::RayScene;
use semascan_simulation::{Datum, DatumSurface, VirtualCell};
use std::collections::BTreeMap;

/// Pairs of points of each motor.
const POINT_PAIRS: usize = 6;
/// How far beside the rim of a hole a person clicks, metres.
const BESIDE_RIM: f64 = 1.5e-3;

/// An element as it was measured and as it is.
#[derive(Clone, Copy)]
struct Pair {
    measured: Feature,
    truth: Feature,
}

/// Measures a motor; `cell` knows what it was built of.
pub(super) fn measure(inspected: &Inspected, cell: &VirtualCell, seed: u64) -> Motor {
    let mut random = Pcg64::seed_from_u64(seed);
    let voxel = inspected.record.voxel.unwrap_or_default();
    let known = &inspected.recorded.true_poses;
    let poses: Vec<PosePair> = known.iter().map(|p| PosePair { estimate: p.estimate, truth: p.truth }).collect();
    let truth_from_model = align_poses(&poses).unwrap_or_else(Isometry3::identity);
    let mesh = &inspected.mesh;
    let regions = MeshRegions::new(mesh, voxel);
    let errors = SurfaceErrors::of_voxels(voxel);
    let mut elements: BTreeMap<&str, Pair> = BTreeMap::new();
    let mut rims: BTreeMap<&str, Pair> = BTreeMap::new();
    let (mut refused, mut unseen) = (Vec::new(), 0);
    let mut list = Vec::new();
    for Datum { name, component, surface } in cell.datums() {
        let (kind, truth) = true_element(surface);
        let Some(vertex) = on_surface(mesh, *component, surface, &truth_from_model, &mut random) else {
            unseen += 1;
            continue;
        };
        match regions.grow(vertex, kind, &errors) {
            Ok(region) => {
                let pair = Pair { measured: Feature::Fitted(region.fit), truth };
                if let (Some(radius), Some(truth)) = (region.fit.radius(), radius(&truth)) {
                    let (value, expanded) = (radius.value, radius.expanded());
                    list.push(Measurement { kind: Kind::Radius, of: name.clone(), value, expanded, truth });
                }
                elements.insert(name, pair);
            }
            Err(error) => refused.push(format!("{name}: {error}")),
        }
        // The face of a boss has the rim of its hole; people click between that and the outer one, nearer to the hole.
        if let Some((hole, circle)) = name.strip_prefix("boss ").and_then(|n| true_rim(cell, n, surface)) {
            let beside = circle.centre + Vector3::x() * (circle.radius + BESIDE_RIM);
            let Some(vertex) = next_to(mesh, &beside, &truth_from_model) else { continue };
            let truth = exact(Element::Circle(circle));
            match regions.grow(vertex, ElementKind::Circle, &errors) {
                Ok(region) => {
                    if let (Some(measured), Some(truth)) = (region.fit.radius(), radius(&truth)) {
                        let (value, expanded) = (measured.value, measured.expanded());
                        list.push(Measurement { kind: Kind::RimRadius, of: hole.to_owned(), value, expanded, truth });
                    }
                    rims.insert(hole, Pair { measured: Feature::Fitted(region.fit), truth });
                }
                Err(error) => refused.push(format!("rim of {hole}: {error}")),
            }
        }
    }
    between_elements(&elements, &mut list);
    between_rims(&rims, &elements, &mut list);
    let pixels = pixels(inspected, cell, &truth_from_model, &mut random);
    between_points(&pixels, &elements, voxel, &mut list);
    Motor { seed, voxel, measurements: list, refused, unseen }
}

/// Distances, steps and angles of the elements that were measured.
fn between_elements(elements: &BTreeMap<&str, Pair>, list: &mut Vec<Measurement>) {
    let numbered = |start: &str| -> Vec<&str> { elements.keys().copied().filter(|n| n.starts_with(start)).collect() };
    let mut add = |kind: Kind, a: &str, b: &str| {
        if let (Some(first), Some(second)) = (elements.get(a), elements.get(b)) {
            list.extend(compared(kind, format!("{a} - {b}"), [first, second]));
        }
    };
    add(Kind::ElementDistance, "yoke", "solenoid");
    add(Kind::ElementDistance, "yoke", "terminal cap");
    add(Kind::ElementDistance, "ear face 1", "nose face");
    add(Kind::ElementDistance, "ear face 2", "nose face");
    add(Kind::ElementDistance, "stud 1", "stud 2");
    add(Kind::Angle, "yoke", "solenoid");
    add(Kind::Angle, "nose face", "yoke");
    add(Kind::Angle, "nose face", "solenoid");
    add(Kind::Angle, "nose face", "ear face 1");
    add(Kind::Angle, "yoke", "ear face 2");
    add(Kind::Step, "ear face 1", "nose face");
    add(Kind::Step, "ear face 2", "nose face");
    for hole in numbered("hole") {
        add(Kind::ElementDistance, "yoke", hole);
    }
    for pair in numbered("hole").windows(2) {
        add(Kind::ElementDistance, pair[0], pair[1]);
    }
    for boss in numbered("boss") {
        add(Kind::Step, "ear face 1", boss);
        add(Kind::Step, "nose face", boss);
    }
    // "ear 1 left", neither "ear end 1" nor "ear face 1".
    let flanks: Vec<&str> =
        numbered("ear ").into_iter().filter(|n| n.ends_with("left") || n.ends_with("right")).collect();
    for pair in flanks.windows(2) {
        add(Kind::Angle, pair[0], pair[1]);
    }
    for flank in flanks {
        add(Kind::ElementDistance, "yoke", flank);
    }
}

/// Distances of holes by their rims.
fn between_rims(rims: &BTreeMap<&str, Pair>, elements: &BTreeMap<&str, Pair>, list: &mut Vec<Measurement>) {
    let all: Vec<(&&str, &Pair)> = rims.iter().collect();
    for pair in all.windows(2) {
        let of = format!("rims of {} - {}", pair[0].0, pair[1].0);
        list.extend(compared(Kind::ElementDistance, of, [pair[0].1, pair[1].1]));
    }
    if let Some(yoke) = elements.get("yoke") {
        for (name, rim) in all {
            list.extend(compared(Kind::ElementDistance, format!("yoke - rim of {name}"), [yoke, rim]));
        }
    }
}

/// Distances of points from each other, from the yoke's axis and from the face of the nose.
fn between_points(pixels: &[Pixel], elements: &BTreeMap<&str, Pair>, voxel: f64, list: &mut Vec<Measurement>) {
    let uncertainty = grid_uncertainty(voxel);
    let point = |pixel: &Pixel| Pair {
        measured: Feature::Point { position: pixel.model, uncertainty },
        truth: Feature::Point { position: pixel.truth, uncertainty: 0.0 },
    };
    for (number, two) in (1..).zip(pixels.chunks_exact(2)) {
        let of = format!("points of pair {number}");
        list.extend(compared(Kind::PointDistance, of, [&point(&two[0]), &point(&two[1])]));
    }
    for (number, pixel) in (1..).zip(pixels.iter().take(2)) {
        for name in ["yoke", "nose face"] {
            let Some(element) = elements.get(name) else { continue };
            list.extend(compared(Kind::ElementDistance, format!("{name} - point {number}"), [element, &point(pixel)]));
        }
    }
}

/// A measurement of this kind, and what it is.
fn compared(kind: Kind, of: String, [first, second]: [&Pair; 2]) -> Option<Measurement> {
    let relation: fn(&Feature, &Feature) -> Option<Relation> = match kind {
        Kind::Angle => angle,
        Kind::Step => step_height,
        _ => distance,
    };
    let measured = relation(&first.measured, &second.measured)?.estimate;
    let truth = relation(&first.truth, &second.truth)?.estimate.value;
    Some(Measurement { kind, of, value: measured.value, expanded: measured.expanded(), truth })
}

fn pixels(
    inspected: &Inspected,
    cell: &VirtualCell,
    truth_from_model: &Isometry3<f64>,
    random: &mut Pcg64,
) -> Vec<Pixel> {
    let Some(truth) = cell.truth() else { return Vec::new() };
    let rays = RayScene::new(&truth.vertices, &truth.triangles);
    let start = [Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN)];
    let bounds = truth.vertices.iter().fold(start, |[low, high], p| {
        let p = Vector3::from(p.map(f64::from));
        [low.inf(&p), high.sup(&p)]
    });
    at_pixels(&inspected.mesh, (&rays, &bounds), truth_from_model, 2 * POINT_PAIRS, random)
}

/// Which element a datum is, exactly.
fn true_element(surface: &DatumSurface) -> (ElementKind, Feature) {
    match *surface {
        DatumSurface::Plane { middle, normal, .. } => {
            let plane = Plane { point: middle.into(), normal: normal.into() };
            (ElementKind::Plane, exact(Element::Plane(plane)))
        }
        DatumSurface::Cylinder { middle, axis, radius, .. } => {
            let cylinder = Cylinder { point: middle.into(), axis: axis.into(), radius };
            (ElementKind::Cylinder, exact(Element::Cylinder(cylinder)))
        }
    }
}

/// The rim of hole `number` on the face of its boss: the name of the hole, and the circle.
fn true_rim<'a>(cell: &'a VirtualCell, number: &str, face: &DatumSurface) -> Option<(&'a str, Circle)> {
    let hole = cell.datums().iter().find(|d| d.name == format!("hole {number}"))?;
    let (DatumSurface::Plane { middle, normal, .. }, DatumSurface::Cylinder { radius, .. }) = (face, &hole.surface)
    else {
        return None;
    };
    let circle = Circle { centre: (*middle).into(), normal: (*normal).into(), radius: *radius };
    Some((&hole.name, circle))
}

fn exact(element: Element) -> Feature {
    Feature::Fitted(Fit { element, rms: 0.0, largest: 0.0, used: 0, left_out: 0, covariance: Matrix6::zeros() })
}

fn radius(feature: &Feature) -> Option<f64> {
    match feature {
        Feature::Fitted(fit) => fit.element.radius(),
        Feature::Point { .. } => None,
    }
}
