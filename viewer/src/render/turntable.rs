//! The turntable: a disc with rings and a scale of degrees.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::pipeline::{Primitive, Uniform, rgba};
use super::request;
use super::scale::round_step;
use crate::display::ColorScheme;
use bytemuck::{Pod, Zeroable};
use wgpu::{BlendState, CompareFunction, PrimitiveTopology, RenderPass, RenderPipeline};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    shape: [f32; 4],
    fill: [f32; 4],
    line: [f32; 4],
    zero: [f32; 4],
}

pub(super) struct Turntable {
    pipeline: RenderPipeline,
    uniform: Uniform<Content>,
}

impl Turntable {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let uniform = Uniform::new(gpu, "turntable");
        let pipeline = Primitive {
            name: "turntable",
            shader: include_str!("turntable.wgsl"),
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

    pub(super) fn prepare(&self, gpu: &Gpu, disc: &request::Turntable, color_scheme: ColorScheme) {
        let (fill, line, zero) = match color_scheme {
            ColorScheme::Dark => (rgba(0x6d_7d90, 0.16), rgba(0x9f_b2c8, 0.55), rgba(0x5e_c8ff, 0.95)),
            ColorScheme::Light => (rgba(0x8a_9bb0, 0.20), rgba(0x46_586e, 0.55), rgba(0x0b_6cb8, 0.95)),
        };
        let shape = [disc.radius, disc.height, round_step(disc.radius / 4.0), 0.0];
        self.uniform.write(gpu, &Content { shape, fill, line, zero });
    }

    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.uniform.group, &[]);
        pass.draw(0..4, 0..1);
    }
}
