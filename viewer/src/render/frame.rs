//! What every primitive knows of the frame: camera, viewport, depth, and what is cut away.

use super::gpu::Gpu;
use super::pipeline::Uniform;
use crate::camera::{Bounds, OrbitCamera};
use crate::display::Cut;
use bytemuck::{Pod, Zeroable};
use glam::camera::rh::{proj, view};
use glam::{Mat4, Vec2, Vec3};

/// The content of bind group 0, see frame.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Frame {
    clip_from_table: [[f32; 4]; 4],
    view_from_table: [[f32; 4]; 4],
    viewport: [f32; 4],
    depth: [f32; 4],
    cut: [f32; 4],
    low: [f32; 4],
    high: [f32; 4],
}

/// Farther than anything, and not so far that a product of it is no number.
const FAR: f32 = 1e9;

impl Frame {
    /// The scene as `camera` sees it on `pixels` device pixels.
    pub(super) fn scene(camera: &OrbitCamera, pixels: Vec2, scale: f32, scene: Bounds, cut: &Cut) -> Self {
        let mut camera = *camera;
        camera.set_viewport(pixels.x, pixels.y);
        let (near, far) = camera.near_far(scene);
        let view = camera.view_from_table();
        Self::new(
            camera.clip_from_view(near, far) * view,
            view,
            pixels,
            camera.pixels_per_metre(1.0),
            scale,
            (near, far),
            cut,
        )
    }

    /// A unit cross seen by a camera of the same direction, on a square of `side` device pixels.
    pub(super) fn axes(camera: &OrbitCamera, side: f32, scale: f32) -> Self {
        let (distance, near, far) = (8.0, 1.0, 16.0);
        let view = view::look_to_mat4(camera.forward() * -distance, camera.forward(), Vec3::Z);
        // The cross with its letters spans 1.6 units to either side.
        let focal = side / 2.0 * distance / 1.6;
        let fov = 2.0 * (side / 2.0 / focal).atan();
        let clip = proj::directx::perspective(fov, 1.0, near, far) * view;
        Self::new(clip, view, Vec2::splat(side), focal, scale, (near, far), &Cut::default())
    }

    fn new(clip: Mat4, view: Mat4, pixels: Vec2, focal: f32, scale: f32, (near, far): (f32, f32), cut: &Cut) -> Self {
        // Clip depth of a point at distance d: a + b / d.
        let a = far / (far - near);
        let ([x, y, z], offset) = cut.plane.unwrap_or(([0.0; 3], FAR));
        let [low, high] = cut.limits.unwrap_or([[-FAR; 3], [FAR; 3]]).map(|[x, y, z]| [x, y, z, 0.0]);
        Self {
            clip_from_table: clip.to_cols_array_2d(),
            view_from_table: view.to_cols_array_2d(),
            viewport: [pixels.x, pixels.y, focal, scale],
            depth: [a, -a * near, near, far],
            cut: [x, y, z, offset],
            low,
            high,
        }
    }
}

/// Bind group 0.
pub(super) type FrameUniform = Uniform<Frame>;

/// A frame uniform of its own.
pub(super) fn uniform(gpu: &Gpu) -> FrameUniform {
    Uniform::new(gpu, "frame")
}
