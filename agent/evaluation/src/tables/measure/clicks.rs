//! Where a person would click: on a datum feature, and at pixels of a view of the part.

use glam::Vec3;
use nalgebra::{Isometry3, Point3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use semascan_model::SemanticMesh;
use semascan_simulation::DatumSurface;
use semascan_simulation::raycast::RayScene;

/// How far a vertex of the model may lie from a true surface to be a piece of it, metres.
const NEAR: f64 = 1e-3;
/// Cosine between its normal and that of the surface from which on it may: 20 degrees.
const FACING: f64 = 0.94;
/// Fewest vertices of a surface that was seen.
const FEWEST: usize = 40;
/// Distance of the eye from the part, metres.
const EYE: f64 = 0.6;
/// Cosine between normal and line of sight from which on people click at a place.
const SEEN: f64 = 0.5;

/// A vertex of the model on `surface` drawn at random, and how many there are; `None` where too little of it was seen.
pub(super) fn on_surface(
    mesh: &SemanticMesh,
    component: u16,
    surface: &DatumSurface,
    truth_from_model: &Isometry3<f64>,
    random: &mut Pcg64,
) -> Option<u32> {
    let on_it: Vec<u32> = (0..mesh.len() as u32)
        .filter(|v| {
            let (position, normal) = placed(mesh, *v, truth_from_model);
            mesh.vertices.labels[*v as usize] == component && is_on(surface, &position.coords, &normal)
        })
        .collect();
    (on_it.len() >= FEWEST).then(|| on_it[random.random_range(0..on_it.len())])
}

/// The vertex of the model next to a true place, metres; `None` without vertices.
pub(super) fn next_to(mesh: &SemanticMesh, place: &Vector3<f64>, truth_from_model: &Isometry3<f64>) -> Option<u32> {
    let away = |v: &u32| (placed(mesh, *v, truth_from_model).0.coords - place).norm();
    (0..mesh.len() as u32).min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// Whether a place with its normal belongs to a surface.
fn is_on(surface: &DatumSurface, place: &Vector3<f64>, facing: &Vector3<f64>) -> bool {
    match *surface {
        DatumSurface::Plane { middle, normal, inner, outer } => {
            let (from, normal) = (place - Vector3::from(middle), Vector3::from(normal));
            let height = normal.dot(&from);
            let out = (from - normal * height).norm();
            height.abs() < NEAR && (inner..=outer).contains(&out) && normal.dot(facing) > FACING
        }
        DatumSurface::Cylinder { middle, axis, radius, half, is_hole } => {
            let (from, axis) = (place - Vector3::from(middle), Vector3::from(axis));
            let along = axis.dot(&from);
            let out = from - axis * along;
            let sign = if is_hole { -1.0 } else { 1.0 };
            (out.norm() - radius).abs() < NEAR && along.abs() <= half && sign * out.dot(facing) > FACING * out.norm()
        }
    }
}

/// A click at a pixel: the place on the model and that on the true surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixel {
    pub(super) model: Vector3<f64>,
    /// In the true frame.
    pub(super) truth: Vector3<f64>,
}

/// Clicks at `count` places of the part, all seen from one side.
pub(super) fn at_pixels(
    mesh: &SemanticMesh,
    truth: (&RayScene, &[Vector3<f64>; 2]),
    truth_from_model: &Isometry3<f64>,
    count: usize,
    random: &mut Pcg64,
) -> Vec<Pixel> {
    let (rays, [low, high]) = truth;
    let turn = random.random_range(0.0..std::f64::consts::TAU);
    let lift: f64 = random.random_range(0.1..1.0);
    let eye = (low + high) * 0.5 + Vector3::new(turn.cos() * lift.cos(), turn.sin() * lift.cos(), lift.sin()) * EYE;
    let mut clicks = Vec::new();
    // Most of a part faces elsewhere or is hidden.
    for _ in 0..400 * count {
        if clicks.len() == count || mesh.is_empty() {
            break;
        }
        let v = random.random_range(0..mesh.len() as u32);
        let (place, normal) = placed(mesh, v, truth_from_model);
        let sight = (place.coords - eye).normalize();
        if mesh.vertices.labels[v as usize] == 0 || -sight.dot(&normal) < SEEN {
            continue;
        }
        let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        let Some(hit) = rays.first_hit(single(eye), single(sight)) else { continue };
        let there = eye + sight * f64::from(hit.t);
        // Else something stands before it.
        if (there - place.coords).norm() < 5.0 * NEAR {
            let model = Vector3::from(mesh.vertices.positions[v as usize].map(f64::from));
            clicks.push(Pixel { model, truth: there });
        }
    }
    clicks
}

/// Place and normal of a vertex in the true frame.
fn placed(mesh: &SemanticMesh, v: u32, truth_from_model: &Isometry3<f64>) -> (Point3<f64>, Vector3<f64>) {
    let position = Point3::from(mesh.vertices.positions[v as usize].map(f64::from));
    let normal = Vector3::from(mesh.vertices.normals[v as usize].map(f64::from));
    (truth_from_model * position, truth_from_model * normal.try_normalize(0.1).unwrap_or_else(Vector3::zeros))
}
