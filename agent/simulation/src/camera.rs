//! The structured-light camera: renders colour, depth and exact labels of the scene from one pose.
//!
//! One primary ray a pixel finds depth and labels; colour is shaded there with several light samples, and with four
//! rays of its own where the pixel touches an edge. Rows are independent and every random draw hashes the pixel, so the
//! picture is the same on any number of threads.

use glam::{Vec2, Vec3};
use image::RgbImage;
use nalgebra::Isometry3;
use rayon::prelude::*;

use super::develop::{Film, develop};
use super::lighting::{Lighting, ViewLighting};
use super::noise::{Noise, hash2};
use super::part::{Scene, SurfacePoint};
use super::raycast::Hit;
use super::sensor::{Beam, SensorModel};
use semascan_perception::view::{DepthImage, Intrinsics, RecordedLabels};

/// From the lens to the projector along the camera's x axis, metres.
const BASELINE: f64 = 0.1;
/// Shadow rays a pixel, and primary rays at an edge.
const SAMPLES: u32 = 4;
/// Depth difference between neighbours that makes an edge, as a share of the depth.
const STEP: f32 = 0.012;

/// A picture of the scene.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub(super) rgb: RgbImage,
    pub(super) depth: DepthImage,
    pub(super) labels: RecordedLabels,
}

/// The camera and the light it works in.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    pub(super) intrinsics: Intrinsics,
    pub(super) lighting: Lighting,
    /// `None`: an ideal sensor.
    pub(super) sensor: Option<SensorModel>,
    pub(super) film: Film,
    /// Waves of the sensor's slow error along one pixel.
    pub(super) ripple_step: f32,
}

impl Camera {
    /// Waves along a whole picture's width.
    pub(super) const RIPPLE_WAVES: f32 = 24.0;
}

struct Rig<'a> {
    camera: &'a Camera,
    scene: &'a Scene,
    light: ViewLighting,
    eye: Vec3,
    axes: [Vec3; 3],
    seed: u32,
    ripple: Noise,
}

#[derive(Clone, Default)]
struct Pixel {
    color: Vec3,
    depth: f32,
    component: u16,
    defect: u16,
    instance: u16,
}

impl Camera {
    /// Takes the picture from `table_from_camera` with the table turned by `table_angle`; `seed` is the view's own.
    pub(super) fn capture(
        &self,
        scene: &Scene,
        table_from_camera: &Isometry3<f64>,
        table_angle: f64,
        seed: u32,
    ) -> Picture {
        let point = |p: nalgebra::Point3<f64>| {
            let q = table_from_camera * p;
            Vec3::new(q.x as f32, q.y as f32, q.z as f32)
        };
        let eye = point(nalgebra::Point3::origin());
        let axis = |x, y, z| point(nalgebra::Point3::new(x, y, z)) - eye;
        let projector = point(nalgebra::Point3::new(BASELINE, 0.0, 0.0));
        let rig = Rig {
            camera: self,
            scene,
            light: self.lighting.for_view(table_angle as f32, projector),
            eye,
            axes: [axis(1.0, 0.0, 0.0), axis(0.0, 1.0, 0.0), axis(0.0, 0.0, 1.0)],
            seed,
            ripple: Noise::new(seed),
        };
        let (w, h) = (self.intrinsics.width as usize, self.intrinsics.height as usize);
        let mut hits: Vec<Option<Hit>> = vec![None; w * h];
        hits.par_chunks_mut(w).enumerate().for_each(|(v, row)| {
            for (u, hit) in row.iter_mut().enumerate() {
                *hit = scene.rays.first_hit(rig.eye, rig.direction(u as f32, v as f32));
            }
        });
        let mut pixels = vec![Pixel::default(); w * h];
        pixels.par_chunks_mut(w).enumerate().for_each(|(v, row)| {
            for (u, pixel) in row.iter_mut().enumerate() {
                *pixel = rig.pixel(&hits, u, v);
            }
        });
        let colors: Vec<Vec3> = pixels.iter().map(|p| p.color).collect();
        let noise = self.sensor.map_or(0.0, |s| s.color);
        Picture {
            rgb: develop(&colors, &self.intrinsics, &self.film, noise, seed),
            depth: DepthImage {
                width: self.intrinsics.width,
                height: self.intrinsics.height,
                metres: pixels.iter().map(|p| p.depth).collect(),
            },
            labels: RecordedLabels {
                components: pixels.iter().map(|p| p.component).collect(),
                defects: pixels.iter().map(|p| p.defect).collect(),
                instances: pixels.iter().map(|p| p.instance).collect(),
            },
        }
    }
}

impl Rig<'_> {
    /// Ray through pixel `(u, v)` in the table frame; one unit along it is one metre of depth.
    fn direction(&self, u: f32, v: f32) -> Vec3 {
        let k = &self.camera.intrinsics;
        let x = (f64::from(u) - k.cx) / k.fx;
        let y = (f64::from(v) - k.cy) / k.fy;
        self.axes[0] * x as f32 + self.axes[1] * y as f32 + self.axes[2]
    }

    fn pixel(&self, hits: &[Option<Hit>], u: usize, v: usize) -> Pixel {
        let w = self.camera.intrinsics.width as usize;
        let i = v * w + u;
        let draw = hash2(self.seed, i as u32);
        let direction = self.direction(u as f32, v as f32);
        let point = hits[i].map(|hit| self.scene.surface(&hit, self.eye, direction));
        let (edge, behind) = self.edge(hits, u, v);
        let color = if edge {
            let sample = |k: u32| {
                let offset = Vec2::new((k & 1) as f32, (k >> 1) as f32) * 0.5 - Vec2::splat(0.25);
                let direction = self.direction(u as f32 + offset.x, v as f32 + offset.y);
                match self.scene.rays.first_hit(self.eye, direction) {
                    Some(hit) => self.light.shade(
                        self.scene,
                        &self.scene.surface(&hit, self.eye, direction),
                        self.eye,
                        hash2(draw, k),
                    ),
                    None => self.light.lighting.backdrop.at(direction),
                }
            };
            (0..SAMPLES).map(sample).sum::<Vec3>() / SAMPLES as f32
        } else {
            match &point {
                Some(point) => self.light.shade(self.scene, point, self.eye, draw),
                None => self.light.lighting.backdrop.at(direction),
            }
        };
        let Some((point, hit)) = point.zip(hits[i]) else {
            return Pixel { color, ..Pixel::default() };
        };
        let depth = self.depth(&point, hit.t, u, v, draw, behind);
        Pixel { color, depth, component: point.tag.class, defect: point.defect, instance: point.tag.instance }
    }

    fn depth(&self, point: &SurfacePoint, z: f32, u: usize, v: usize, draw: u32, behind: Option<f32>) -> f32 {
        let Some(sensor) = &self.camera.sensor else {
            return z;
        };
        let place = Vec2::new(u as f32, v as f32) * self.camera.ripple_step;
        let ripple = 1.8 * self.ripple.at(place.extend(0.5));
        let patch = if sensor.patches < 1.0 { self.ripple.at((place * 0.8).extend(9.5)) } else { 0.0 };
        let beam = Beam { eye: self.eye, z, draw, ripple, patch, behind };
        sensor.measure(self.scene, &self.light, point, &beam)
    }

    /// Whether the pixel touches an edge of the picture's content, and the depth of the surface beyond a depth step.
    fn edge(&self, hits: &[Option<Hit>], u: usize, v: usize) -> (bool, Option<f32>) {
        let (w, h) = (self.camera.intrinsics.width as usize, self.camera.intrinsics.height as usize);
        let mine = hits[v * w + u];
        let (mut edge, mut other) = (false, None);
        let neighbours = [(u.wrapping_sub(1), v), (u + 1, v), (u, v.wrapping_sub(1)), (u, v + 1)];
        for (a, b) in neighbours.into_iter().filter(|&(a, b)| a < w && b < h) {
            match (mine, hits[b * w + a]) {
                (None, None) => {}
                (Some(m), Some(n)) => {
                    if (n.t - m.t).abs() > STEP * m.t {
                        (edge, other) = (true, Some(n.t));
                    } else if m.triangle != n.triangle {
                        let (i, j) = (m.triangle as usize, n.triangle as usize);
                        let (p, q) = (self.scene.mesh.normals[i][0], self.scene.mesh.normals[j][0]);
                        edge |= self.scene.mesh.tags[i] != self.scene.mesh.tags[j] || p.dot(q) < 0.85;
                    }
                }
                _ => edge = true,
            }
        }
        (edge, other)
    }
}
