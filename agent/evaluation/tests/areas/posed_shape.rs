//! A surface in any pose, seen by depth cameras around it: views for an inspection, and how much of the surface they saw.

use glam::Vec3;
use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use semascan_evaluation::{SeenFrom, SeenSurface};
use semascan_inspection::source::{Source, SourceError, SourceInfo, TrueMesh};
use semascan_model::{ClassDef, Taxonomy};
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, RecordedLabels, View, covariance_of_prior};
use semascan_simulation::raycast::RayScene;
use std::sync::Arc;

/// What a depth camera adds to the true depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor {
    /// Standard deviation in metres.
    pub(crate) sigma: f64,
    /// Step of the depth in metres; 0 without steps.
    pub(crate) step: f64,
}

/// A surface and the cameras that look at it.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    /// The surface in its own frame, metres.
    pub(crate) shape: TrueMesh,
    /// Cameras in the shape's frame.
    pub(crate) shape_from_camera: Vec<Isometry3<f64>>,
    pub(crate) camera: Intrinsics,
}

impl Setup {
    /// Cameras that look at the origin from `distance` metres, by direction.
    pub(crate) fn around(shape: TrueMesh, directions: &[[f64; 3]], distance: f64, camera: Intrinsics) -> Self {
        let shape_from_camera = directions
            .iter()
            .map(|d| {
                let eye = Vector3::from(*d).normalize() * distance;
                let up = if eye.x.hypot(eye.y) > 1e-3 { Vector3::z() } else { Vector3::x() };
                // Optical frame: y down.
                Isometry3::face_towards(&eye.into(), &Point3::origin(), &-up)
            })
            .collect();
        Self { shape, shape_from_camera, camera }
    }
}

/// Random rotation and a shift of up to a voxel of 0.5 mm, seeded.
pub(crate) fn pose(seed: u64) -> Isometry3<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let axis = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0_f64));
    let rotation = UnitQuaternion::new(axis.normalize() * rng.random_range(0.0..std::f64::consts::PI));
    let shift = Translation3::from(Vector3::from_fn(|_, _| rng.random_range(0.0..5e-4)));
    Isometry3::from_parts(shift, rotation)
}

/// The views of a posed surface.
pub(crate) struct PosedShape {
    info: SourceInfo,
    truth: TrueMesh,
    rays: RayScene,
    views: Vec<View>,
    next: usize,
}

impl PosedShape {
    pub(crate) fn new(setup: &Setup, table_from_shape: &Isometry3<f64>, sensor: Sensor, seed: u64) -> Self {
        let mut truth = setup.shape.clone();
        for p in &mut truth.vertices {
            let q = table_from_shape * Point3::from(p.map(f64::from));
            *p = [q.x, q.y, q.z].map(|c| c as f32);
        }
        let rays = RayScene::new(&truth.vertices, &truth.triangles);
        let most = truth.labels.iter().max().copied().unwrap_or(0);
        let class = |id: u16| ClassDef { id, name: format!("class {id}"), color: [id as u8; 3] };
        let taxonomy = Taxonomy { components: (0..=most).map(class).collect(), defects: vec![class(0)] };
        let info = SourceInfo {
            uri: "posed".into(),
            part: "posed shape".into(),
            taxonomy,
            view_count: Some(setup.shape_from_camera.len() as u32),
            turntable: None,
            volume: None,
            no_labels: None,
            settings: Vec::new(),
        };
        let views = setup.shape_from_camera.iter().enumerate();
        let views = views
            .map(|(i, camera)| {
                let pose = table_from_shape * camera;
                capture(i as u32, &truth, &rays, &setup.camera, pose, sensor, seed * 1000 + i as u64)
            })
            .collect();
        Self { info, truth, rays, views, next: 0 }
    }

    /// What the views have seen.
    pub(crate) fn seen(&self, samples: usize) -> SeenSurface {
        let pictures: Vec<SeenFrom<'_>> = self
            .views
            .iter()
            .map(|v| SeenFrom {
                intrinsics: &v.intrinsics,
                depth: &v.depth,
                table_from_camera: v.truth.as_ref().expect("simulated").table_from_camera,
            })
            .collect();
        SeenSurface::of(&self.truth, &self.rays, &pictures, samples, 1)
    }
}

fn capture(
    index: u32,
    truth: &TrueMesh,
    rays: &RayScene,
    k: &Intrinsics,
    table_from_camera: Isometry3<f64>,
    sensor: Sensor,
    seed: u64,
) -> View {
    let mut rng = Pcg64::seed_from_u64(seed);
    let pixels = (k.width * k.height) as usize;
    let (mut depth, mut components) = (vec![0.0_f32; pixels], vec![0_u16; pixels]);
    let vector = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    for i in 0..pixels {
        let (u, v) = ((i % k.width as usize) as f64, (i / k.width as usize) as f64);
        let direction = table_from_camera.rotation * k.unproject(u, v, 1.0).coords;
        // Box-Muller: a normal deviate of the depth's noise.
        let (a, b): (f64, f64) = (rng.random_range(1e-12..1.0), rng.random_range(0.0..std::f64::consts::TAU));
        let Some(hit) = rays.first_hit(vector(table_from_camera.translation.vector), vector(direction)) else {
            continue;
        };
        let z = f64::from(hit.t) + sensor.sigma * (-2.0 * a.ln()).sqrt() * b.cos();
        depth[i] = if sensor.step > 0.0 { (z / sensor.step).round() * sensor.step } else { z } as f32;
        let [first, second] = hit.barycentric;
        let nearest = if first.max(second) < 1.0 - first - second { 0 } else { 1 + usize::from(second > first) };
        components[i] = truth.labels[truth.triangles[hit.triangle as usize][nearest] as usize];
    }
    let labels = RecordedLabels { components, defects: vec![0; pixels], instances: vec![0; pixels] };
    View {
        index,
        stamp: None,
        intrinsics: *k,
        rgb: Arc::new(RgbImage::from_pixel(k.width, k.height, Rgb([120; 3]))),
        depth: Arc::new(DepthImage { width: k.width, height: k.height, metres: depth }),
        pose: PoseEvidence::World { table_from_camera, covariance: covariance_of_prior(1e-3, 1e-3) },
        labels: Some(Arc::new(labels)),
        truth: Some(semascan_perception::view::ViewTruth { table_from_camera }),
    }
}

impl Source for PosedShape {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        self.next += 1;
        self.views.get(self.next - 1).cloned().map(Ok)
    }

    fn truth(&self) -> Option<&TrueMesh> {
        Some(&self.truth)
    }
}
