//! A keyframe: the surface that one view shows, made better by every frame that is tracked against it.
//!
//! All keyframes together are the model that is tracked against. Within a keyframe the surface is a depth picture that
//! frames are averaged into, along the rays of its pixels, as a volume averages distances ([Newcombe 2011], section 3.3;
//! [Engel 2013] for a picture in place of a volume); a new keyframe takes over what earlier ones know of its surface, so
//! that it is tracked against the mean of all frames and not against the last one. Unlike a volume, the model bends where a
//! loop closes: its keyframes move.

use super::super::into_picture::IntoPicture;
use super::super::model_view::ModelView;
use super::super::texture::ViewTexture;
use super::alignment::Target;
use super::frame::Frame;
use nalgebra::Isometry3;
use rayon::prelude::*;
use semascan_geometry::vector::{dot, sub, unit};

/// Distance from the surface up to which a frame's point is a measurement of it, metres a metre of distance.
const SAME_SURFACE: f32 = 0.02;
/// Smallest cosine between the normals of one surface.
const SAME_NORMAL: f32 = 0.8;
/// Frames after which the mean follows new ones as a sliding one: what has moved is forgotten.
const MOST_FRAMES: f32 = 60.0;
/// Share of their certainty that another keyframe's points keep: its pose is not exact.
const TAKEN_OVER: f32 = 0.5;

/// A surface with its picture and its place.
pub(super) struct Keyframe {
    /// The surface, and the pose: `world_from_camera`.
    pub(super) surface: ModelView,
    /// Frames that were averaged in each pixel, by what they are worth.
    weights: Vec<f32>,
    /// Its picture.
    pub(super) texture: Option<ViewTexture>,
}

impl Keyframe {
    /// Of a frame at `world_from_camera`; `earlier` keyframes that show the same surface lend what they know of it.
    pub(super) fn new(frame: &Frame, world_from_camera: Isometry3<f64>, earlier: &[&Self]) -> Self {
        let mut surface = frame.surface.clone();
        surface.table_from_camera = world_from_camera;
        let weights = surface.points.iter().zip(&surface.normals).map(|(p, n)| worth(*p, *n)).collect();
        let mut keyframe = Self { surface, weights, texture: frame.texture.clone() };
        for other in earlier {
            keyframe.average(&other.surface, Some(&other.weights));
        }
        keyframe
    }

    /// The pose: `world_from_camera`.
    pub(super) fn pose(&self) -> Isometry3<f64> {
        self.surface.table_from_camera
    }

    /// What frames are aligned with.
    pub(super) fn target(&self) -> Target<'_> {
        Target { surface: &self.surface, texture: self.texture.as_ref() }
    }

    /// Averages a frame that was found at `world_from_camera` into the surface.
    pub(super) fn fuse(&mut self, frame: &Frame, world_from_camera: &Isometry3<f64>) {
        let mut surface = frame.surface.clone();
        surface.table_from_camera = *world_from_camera;
        self.average(&surface, None);
    }

    /// Averages `other` into the surface, whose points count by `weights`, or by what one frame's are worth.
    fn average(&mut self, other: &ModelView, weights: Option<&[f32]>) {
        let own = self.surface.table_from_camera;
        let there = IntoPicture::new(&(other.table_from_camera.inverse() * own), &other.intrinsics);
        let back = IntoPicture::new(&(own.inverse() * other.table_from_camera), &other.intrinsics);
        let width = self.surface.intrinsics.width.max(1) as usize;
        self.surface
            .points
            .par_chunks_mut(width)
            .zip(self.surface.normals.par_chunks_mut(width))
            .zip(self.weights.par_chunks_mut(width))
            .for_each(|((points, normals), own_weights)| {
                for ((p, n), w) in points.iter_mut().zip(normals).zip(own_weights) {
                    if p[2] <= 0.0 {
                        continue;
                    }
                    let Some(at) = there.pixel(there.place(*p)) else { continue };
                    if other.points[at][2] <= 0.0 {
                        continue;
                    }
                    let (q, m) = (back.place(other.points[at]), back.turn(other.normals[at]));
                    // Where the ray of the pixel meets the other's tangent plane.
                    let (along, off) = (dot(m, *p), dot(m, sub(q, *p)));
                    if dot(*n, m) < SAME_NORMAL || off.abs() > SAME_SURFACE * p[2] || along > -0.1 * p[2] {
                        continue;
                    }
                    let added = match weights {
                        Some(weights) => TAKEN_OVER * weights[at],
                        None => worth(other.points[at], other.normals[at]),
                    };
                    let share = added / (*w + added).max(f32::MIN_POSITIVE);
                    let stretch = 1.0 + share * off / along;
                    *p = p.map(|x| x * stretch);
                    *n = unit(std::array::from_fn(|i| n[i] + share * (m[i] - n[i])), 0.0).unwrap_or(*n);
                    *w = (*w + added).min(MOST_FRAMES);
                }
            });
    }
}

/// What a measured point is worth, at most 1: a surface that is seen from the side is measured worse.
fn worth(p: [f32; 3], n: [f32; 3]) -> f32 {
    let distance = dot(p, p).sqrt().max(f32::MIN_POSITIVE);
    (-dot(p, n) / distance).max(0.0)
}
