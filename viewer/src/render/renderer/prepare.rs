//! What a frame needs on the device before it can be drawn.

use super::Renderer;
use crate::camera::Bounds;
use crate::render::axes;
use crate::render::floor::FloorPlace;
use crate::render::frame::Frame;
use crate::render::frustum;
use crate::render::request::DrawRequest;
use glam::{Vec2, Vec3};

/// Side of the square that holds the axes, and its distance from the corner, CSS pixels.
const AXES_SIDE: f32 = 84.0;
pub(super) const AXES_MARGIN: f32 = 8.0;

impl Renderer {
    pub(super) fn prepare(&mut self, request: &DrawRequest) {
        let gpu = &self.gpu;
        let pixels = Vec2::new(gpu.config.width as f32, gpu.config.height as f32);
        let model = request.bounds.filter(|b| !b.is_empty());
        let mut scene = model.unwrap_or(Bounds::EMPTY);
        match &request.content.turntable {
            Some(disc) => {
                self.turntable.prepare(gpu, disc, request.content.color_scheme);
                let corner = Vec3::new(disc.radius, disc.radius, 0.0);
                let height = Vec3::Z * disc.height;
                scene = scene.union(Bounds::from_corners(height - corner, height + corner));
            }
            None => {
                let place = FloorPlace::under(model);
                self.floor.prepare(gpu, place, request.content.color_scheme);
                scene = scene.union(place.bounds());
            }
        }
        let depth = model.map_or(0.08, |b| b.radius() * 0.6).clamp(0.03, 0.3);
        let segments: Vec<_> = request
            .content
            .frusta
            .iter()
            .flat_map(|f| frustum::segments(f, depth, request.content.color_scheme))
            .collect();
        for segment in &segments {
            scene.include(segment.from);
            scene.include(segment.to);
        }
        self.frusta.write(gpu, &segments);
        let forward = request.camera.forward();
        let right = forward.cross(Vec3::Z).normalize_or(Vec3::X);
        self.axes.write(gpu, &axes::segments(right, right.cross(forward)));
        if let Some(side) = self.axes_side() {
            self.axes_frame.write(gpu, &Frame::axes(&request.camera, side, self.scale));
        }
        self.frame.write(gpu, &Frame::scene(&request.camera, pixels, self.scale, scene));
        self.background.prepare(gpu, request.content.color_scheme);
        self.points.prepare(gpu, request);
        self.mesh.prepare(gpu, request);
    }

    /// Side of the axes' square in device pixels; none on a picture too small for it.
    pub(super) fn axes_side(&self) -> Option<f32> {
        let side = AXES_SIDE * self.scale;
        let room = self.gpu.config.width.min(self.gpu.config.height) as f32;
        (side * 3.0 < room).then_some(side)
    }
}
