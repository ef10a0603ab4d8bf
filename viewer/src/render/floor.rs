//! The floor grid of scenes without a turntable.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::pipeline::{Primitive, Uniform, rgba};
use super::scale::round_step;
use crate::camera::Bounds;
use crate::display::ColorScheme;
use bytemuck::{Pod, Zeroable};
use wgpu::{BlendState, CompareFunction, PrimitiveTopology, RenderPass, RenderPipeline};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    place: [f32; 4],
    step: [f32; 4],
    line: [f32; 4],
}

/// How far the grid reaches, in radii of the model.
const REACH: f32 = 3.0;

pub(super) struct Floor {
    pipeline: RenderPipeline,
    uniform: Uniform<Content>,
}

impl Floor {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let uniform = Uniform::new(gpu, "floor");
        let pipeline = Primitive {
            name: "floor",
            shader: include_str!("floor.wgsl"),
            groups: &[&frame.layout, &uniform.layout],
            vertices: None,
            topology: PrimitiveTopology::TriangleStrip,
            blend: Some(BlendState::ALPHA_BLENDING),
            writes_depth: false,
            depth_compare: CompareFunction::LessEqual,
            target: None,
        }
        .pipeline(gpu);
        Self { pipeline, uniform }
    }

    pub(super) fn prepare(&self, gpu: &Gpu, place: FloorPlace, color_scheme: ColorScheme) {
        let line = match color_scheme {
            ColorScheme::Dark => rgba(0x9f_b2c8, 0.40),
            ColorScheme::Light => rgba(0x46_586e, 0.40),
        };
        let FloorPlace { center: [x, y], height, reach } = place;
        let step = [round_step(reach / (REACH * 10.0)), 0.0, 0.0, 0.0];
        self.uniform.write(gpu, &Content { place: [x, y, height, reach], step, line });
    }

    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.uniform.group, &[]);
        pass.draw(0..4, 0..1);
    }
}

/// Where the grid lies, metres.
#[derive(Clone, Copy)]
pub(super) struct FloorPlace {
    center: [f32; 2],
    height: f32,
    reach: f32,
}

impl FloorPlace {
    /// Under the model; at the origin while there is none.
    pub(super) fn under(model: Option<Bounds>) -> Self {
        match model {
            Some(b) => {
                Self { center: b.center().truncate().into(), height: b.min.z, reach: b.radius().max(0.05) * REACH }
            }
            None => Self { center: [0.0; 2], height: 0.0, reach: 0.1 * REACH },
        }
    }

    /// The box that it fills.
    pub(super) fn bounds(&self) -> Bounds {
        let [x, y] = self.center;
        let corner = |side: f32| glam::Vec3::new(x + side * self.reach, y + side * self.reach, self.height);
        Bounds::from_corners(corner(-1.0), corner(1.0))
    }
}
