//! A surface in any pose, seen by depth cameras around it: views for an inspection, and how much of the surface they saw.
//!
//! The pictures are rendered once, in the surface's own frame. A pose moves surface and cameras together, so that the same
//! pictures meet the grid of the map in another way.

use glam::Vec3;
use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use semascan_evaluation::{SeenFrom, SeenSurface};
use semascan_inspection::source::{Source, SourceError, SourceInfo, TrueMesh};
use semascan_model::{ClassDef, Taxonomy};
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, RecordedLabels, View, covariance_of_prior};
use semascan_simulation::raycast::RayScene;
use std::sync::Arc;

/// What a depth camera adds to the true depth, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor {
    /// Standard deviation.
    pub(crate) sigma: f64,
    /// Step of the depth; 0 without steps.
    pub(crate) step: f64,
}

/// A picture, and where it was taken from.
#[derive(Clone, Debug)]
struct Picture {
    shape_from_camera: Isometry3<f64>,
    depth: Arc<DepthImage>,
    labels: Arc<RecordedLabels>,
}

/// Pictures of a surface, in its own frame.
#[derive(Clone, Debug)]
pub(crate) struct Pictures {
    camera: Intrinsics,
    taken: Vec<Picture>,
    components: u16,
    defects: u16,
    /// What of the surface they saw.
    pub(crate) seen: SeenSurface,
}

impl Pictures {
    /// Of `shape` by cameras that look at the origin from `distance` metres in `directions`.
    pub(crate) fn take(
        shape: &TrueMesh,
        directions: &[[f64; 3]],
        distance: f64,
        camera: Intrinsics,
        sensor: Sensor,
    ) -> Self {
        Self::take_with_defects(shape, &|_| 0, directions, distance, camera, sensor)
    }

    /// The same of a shape that has the defect `defect_at` each place, metres in its own frame.
    pub(crate) fn take_with_defects(
        shape: &TrueMesh,
        defect_at: &(dyn Fn([f32; 3]) -> u16 + Sync),
        directions: &[[f64; 3]],
        distance: f64,
        camera: Intrinsics,
        sensor: Sensor,
    ) -> Self {
        let surface = (shape, defect_at);
        let rays = RayScene::new(&shape.vertices, &shape.triangles);
        let taken: Vec<_> = directions
            .iter()
            .enumerate()
            .map(|(i, direction)| {
                let eye = Vector3::from(*direction).normalize() * distance;
                let up = if eye.x.hypot(eye.y) > 1e-3 { Vector3::z() } else { Vector3::x() };
                // Optical frame: y down.
                let shape_from_camera = Isometry3::face_towards(&eye.into(), &Point3::origin(), &-up);
                let (depth, labels) = capture(surface, &rays, &camera, &shape_from_camera, sensor, i as u64);
                Picture { shape_from_camera, depth: Arc::new(depth), labels: Arc::new(labels) }
            })
            .collect();
        let from: Vec<SeenFrom<'_>> = taken
            .iter()
            .map(|p| SeenFrom { intrinsics: &camera, depth: &p.depth, table_from_camera: p.shape_from_camera })
            .collect();
        let seen = SeenSurface::of(shape, &rays, &from, 200_000, 1);
        let components = shape.labels.iter().max().copied().unwrap_or(0);
        let defects = taken.iter().flat_map(|p| &p.labels.defects).max().copied().unwrap_or(0);
        Self { camera, components, defects, seen, taken }
    }

    /// The views of the surface at `table_from_shape`.
    pub(crate) fn posed(&self, table_from_shape: &Isometry3<f64>) -> PosedShape {
        let class = |id: u16| ClassDef { id, name: format!("class {id}"), color: [id as u8; 3] };
        let taxonomy = Taxonomy {
            components: (0..=self.components).map(class).collect(),
            defects: (0..=self.defects).map(class).collect(),
        };
        let info = SourceInfo {
            uri: "posed".into(),
            part: "posed shape".into(),
            taxonomy,
            view_count: Some(self.taken.len() as u32),
            turntable: None,
            volume: None,
            no_labels: None,
            settings: Vec::new(),
        };
        let Intrinsics { width, height, .. } = self.camera;
        let rgb = Arc::new(RgbImage::from_pixel(width, height, Rgb([120; 3])));
        let view = |(i, picture): (usize, &Picture)| View {
            index: i as u32,
            stamp: None,
            intrinsics: self.camera,
            rgb: Arc::clone(&rgb),
            depth: Arc::clone(&picture.depth),
            pose: PoseEvidence::World {
                table_from_camera: table_from_shape * picture.shape_from_camera,
                covariance: covariance_of_prior(1e-3, 1e-3),
            },
            labels: Some(Arc::clone(&picture.labels)),
            truth: None,
        };
        PosedShape { info, views: self.taken.iter().enumerate().map(view).collect::<Vec<_>>().into_iter() }
    }
}

/// Pose number `seed`: any rotation, and a shift of up to a voxel of 0.5 mm. Pose 0 is the surface's own frame, in which its
/// planes lie on faces of voxels.
pub(crate) fn pose(seed: u64) -> Isometry3<f64> {
    if seed == 0 {
        return Isometry3::identity();
    }
    let mut rng = Pcg64::seed_from_u64(seed);
    let axis = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0_f64));
    let rotation = UnitQuaternion::new(axis.normalize() * rng.random_range(0.0..std::f64::consts::PI));
    let shift = Translation3::from(Vector3::from_fn(|_, _| rng.random_range(0.0..5e-4)));
    Isometry3::from_parts(shift, rotation)
}

/// The views of a posed surface, as a source.
pub(crate) struct PosedShape {
    info: SourceInfo,
    views: std::vec::IntoIter<View>,
}

fn capture(
    (shape, defect_at): (&TrueMesh, &(dyn Fn([f32; 3]) -> u16 + Sync)),
    rays: &RayScene,
    k: &Intrinsics,
    shape_from_camera: &Isometry3<f64>,
    sensor: Sensor,
    seed: u64,
) -> (DepthImage, RecordedLabels) {
    let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    let row = |v: u32| -> Vec<(f32, u16, u16)> {
        let mut rng = Pcg64::seed_from_u64(seed << 32 | u64::from(v));
        let pixel = |u: u32| {
            let direction = shape_from_camera.rotation * k.unproject(f64::from(u), f64::from(v), 1.0).coords;
            // Box-Muller: a normal deviate of the depth's noise.
            let (a, b): (f64, f64) = (rng.random_range(1e-12..1.0), rng.random_range(0.0..std::f64::consts::TAU));
            let (origin, direction) = (single(shape_from_camera.translation.vector), single(direction));
            let Some(hit) = rays.first_hit(origin, direction) else {
                return (0.0, 0, 0);
            };
            let z = f64::from(hit.t) + sensor.sigma * (-2.0 * a.ln()).sqrt() * b.cos();
            let z = if sensor.step > 0.0 { (z / sensor.step).round() * sensor.step } else { z };
            let [second, third] = hit.barycentric;
            let nearest = if second.max(third) < 1.0 - second - third { 0 } else { 1 + usize::from(third > second) };
            let component = shape.labels[shape.triangles[hit.triangle as usize][nearest] as usize];
            (z as f32, component, defect_at((origin + direction * hit.t).to_array()))
        };
        (0..k.width).map(pixel).collect()
    };
    let rows: Vec<Vec<(f32, u16, u16)>> = (0..k.height).into_par_iter().map(row).collect();
    let (metres, (components, defects)): (Vec<f32>, (Vec<u16>, Vec<u16>)) =
        rows.into_iter().flatten().map(|(z, component, defect)| (z, (component, defect))).unzip();
    let labels = RecordedLabels { instances: vec![0; components.len()], components, defects };
    (DepthImage { width: k.width, height: k.height, metres }, labels)
}

impl Source for PosedShape {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        self.views.next().map(Ok)
    }
}
