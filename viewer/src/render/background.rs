//! The ground behind everything: a quiet gradient that follows the theme.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::pipeline::{Primitive, Uniform, rgba};
use crate::display::ColorScheme;
use bytemuck::{Pod, Zeroable};
use wgpu::{CompareFunction, PrimitiveTopology, RenderPass, RenderPipeline};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    top: [f32; 4],
    bottom: [f32; 4],
}

pub(super) struct Background {
    pipeline: RenderPipeline,
    uniform: Uniform<Content>,
}

impl Background {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let uniform = Uniform::new(gpu, "background");
        let pipeline = Primitive {
            name: "background",
            shader: include_str!("background.wgsl"),
            groups: &[&frame.layout, &uniform.layout],
            vertices: None,
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: false,
            depth_compare: CompareFunction::Always,
            target: None,
        }
        .pipeline(gpu);
        Self { pipeline, uniform }
    }

    pub(super) fn prepare(&self, gpu: &Gpu, color_scheme: ColorScheme) {
        let (top, bottom) = match color_scheme {
            ColorScheme::Dark => (0x20_2730, 0x10_1419),
            ColorScheme::Light => (0xf8_fafb, 0xdf_e5ec),
        };
        self.uniform.write(gpu, &Content { top: rgba(top, 1.0), bottom: rgba(bottom, 1.0) });
    }

    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.uniform.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
