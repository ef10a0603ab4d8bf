//! How much of a true surface was seen by views: what the area of a model is judged by.
//!
//! A model shows only what its views have seen, so its area is not that of the true mesh. Which part was seen is found by
//! ray casting: samples of the surface, each standing for an equal area (stratified Monte Carlo integration), count where
//! at least one picture has a depth at their pixel, they face its camera and nothing stands between them.

use crate::sampling::sample;
use glam::Vec3;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use semascan_inspection::source::TrueMesh;
use semascan_perception::view::{DepthImage, Intrinsics};
use semascan_simulation::raycast::RayScene;

/// Difference of measured and true depth, metres, up to which a pixel shows the point and nothing else.
const AGREEMENT: f64 = 5e-3;
/// Cosine of incidence from which on a surface counts as seen (78 degrees). Beyond, neighbouring pixels lie more than five
/// footprints apart on it, 2.5 voxels of a map whose voxels are two footprints wide: that is no closed surface.
const GRAZING: f64 = 0.2;

/// A picture with its true pose.
#[derive(Clone, Copy, Debug)]
pub struct SeenFrom<'a> {
    /// The camera.
    pub intrinsics: &'a Intrinsics,
    /// What it measured.
    pub depth: &'a DepthImage,
    /// Its true pose.
    pub table_from_camera: Isometry3<f64>,
}

/// A piece of a true surface that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenSample {
    /// Metres, table frame.
    pub position: [f64; 3],
    /// Component class.
    pub label: u16,
    /// Largest cosine of incidence under which it was seen.
    pub cosine: f64,
}

/// What of a true surface was seen.
#[derive(Clone, Debug, Default)]
pub struct SeenSurface {
    /// Samples that were seen.
    pub samples: Vec<SeenSample>,
    /// The area that a sample stands for, square metres.
    pub each: f64,
}

impl SeenSurface {
    /// What of `truth` the `pictures` have seen. `obstacles` are all surfaces that hide others, `truth` among them; of the
    /// whole surface `samples` are drawn with `seed`.
    pub fn of(truth: &TrueMesh, obstacles: &RayScene, pictures: &[SeenFrom<'_>], samples: usize, seed: u64) -> Self {
        let positions: Vec<[f64; 3]> = truth.vertices.iter().map(|p| p.map(f64::from)).collect();
        let drawn = sample(&positions, &truth.triangles, samples, seed);
        let each = area(&positions, &truth.triangles) / drawn.len().max(1) as f64;
        let samples = drawn
            .par_iter()
            .filter_map(|s| {
                let cosines =
                    pictures.iter().filter_map(|picture| sees(picture, obstacles, (s.position, s.normal), GRAZING));
                let cosine = cosines.fold(0.0, f64::max);
                let label = truth.labels.get(s.vertex as usize).copied().unwrap_or(0);
                (cosine > 0.0).then_some(SeenSample { position: s.position, label, cosine })
            })
            .collect();
        Self { samples, each }
    }

    /// Area in square metres.
    pub fn area(&self) -> f64 {
        self.each * self.samples.len() as f64
    }
}

/// Cosine of incidence under which a picture sees a point of the surface with its normal, if above `least_cosine`.
pub(crate) fn sees(
    picture: &SeenFrom<'_>,
    obstacles: &RayScene,
    (position, normal): ([f64; 3], [f32; 3]),
    least_cosine: f64,
) -> Option<f64> {
    let point = Point3::from(position);
    let in_camera = picture.table_from_camera.inverse_transform_point(&point);
    let (u, v) = picture.intrinsics.project(&in_camera)?;
    let depth = picture.depth.metres.get(picture.intrinsics.pixel(u, v)?).copied().filter(|z| *z > 0.0)?;
    let measured = (f64::from(depth) - in_camera.z).abs() < AGREEMENT;
    let centre = Point3::from(picture.table_from_camera.translation.vector);
    let towards = centre - point;
    let cosine = towards.dot(&Vector3::from(normal.map(f64::from))) / towards.norm();
    let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    // On the last two thousandths of the way a surface is its own obstacle.
    let free =
        measured && cosine > least_cosine && !obstacles.is_blocked(single(centre.coords), single(-towards), 1.0 - 5e-4);
    free.then_some(cosine)
}

fn area(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let corner = |i: u32| Point3::from(positions[i as usize]);
    triangles.iter().map(|t| t.map(corner)).map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum()
}
