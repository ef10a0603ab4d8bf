//! What a section plane cuts through, closed with a hatched area as on a drawing (see cap.wgsl).

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::pick::{PICK_FORMAT, Window};
use super::pipeline::{Primitive, Uniform, rgba};
use super::request::SectionPicture;
use super::scale::round_step;
use crate::display::ColorScheme;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::sync::Arc;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CompareFunction, PrimitiveTopology, RenderPass, RenderPipeline,
    VertexAttribute, VertexBufferLayout, VertexStepMode,
};

/// Distance of the hatching's lines as a share of the section's size.
const HATCH: f32 = 0.02;
/// The corners of a quad as two triangles.
const CORNERS: [usize; 6] = [0, 1, 2, 0, 2, 3];

const POSITION: [VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32];

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    fill: [f32; 4],
    line: [f32; 4],
    hatch: [f32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    /// Metres across the hatching.
    across: f32,
}

pub(super) struct Cap {
    pipeline: RenderPipeline,
    uniform: Uniform<Content>,
    /// What lies in the buffer.
    of: Option<Arc<SectionPicture>>,
    buffer: Option<Buffer>,
    vertices: u32,
    /// Distance of the hatching's lines, metres.
    step: f32,
}

impl Cap {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let uniform = Uniform::new(gpu, "cap");
        let pipeline = Primitive {
            name: "cap",
            shader: include_str!("cap.wgsl"),
            groups: &[&frame.layout, &uniform.layout],
            vertices: Some(vertices()),
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: None,
        }
        .pipeline(gpu);
        Self { pipeline, uniform, of: None, buffer: None, vertices: 0, step: 1e-3 }
    }

    pub(super) fn prepare(&mut self, gpu: &Gpu, section: Option<&Arc<SectionPicture>>, color_scheme: ColorScheme) {
        let is_same = match (&self.of, section) {
            (Some(before), Some(now)) => Arc::ptr_eq(before, now),
            (before, now) => before.is_none() && now.is_none(),
        };
        if !is_same {
            self.of = section.cloned();
            self.write(gpu);
        }
        let (fill, line) = match color_scheme {
            ColorScheme::Dark => (0x3a_434e, 0x8b_98a8),
            ColorScheme::Light => (0xe3_e8ee, 0x7c_8796),
        };
        let hatch = [self.step, 0.0, 0.0, 0.0];
        self.uniform.write(gpu, &Content { fill: rgba(fill, 1.0), line: rgba(line, 1.0), hatch });
    }

    fn write(&mut self, gpu: &Gpu) {
        let quads = self.of.as_ref().map(|section| section.cap.as_slice()).unwrap_or_default();
        let corners = || quads.iter().flatten().map(|(place, _)| *place);
        let (low, high) = (corners().fold(Vec3::INFINITY, Vec3::min), corners().fold(Vec3::NEG_INFINITY, Vec3::max));
        self.step = round_step((high - low).length() * HATCH);
        let of = |(place, across): (Vec3, f32)| Vertex { position: place.into(), across };
        let vertices: Vec<Vertex> = quads.iter().flat_map(|quad| CORNERS.map(|i| of(quad[i]))).collect();
        self.vertices = vertices.len() as u32;
        if let Some(before) = self.buffer.take() {
            // At once, not at the garbage collector's leisure.
            before.destroy();
        }
        if vertices.is_empty() {
            return;
        }
        let bytes: &[u8] = bytemuck::cast_slice(&vertices);
        let buffer = gpu.device.create_buffer(&BufferDescriptor {
            label: Some("cap"),
            size: bytes.len() as u64,
            usage: BufferUsages::VERTEX | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue.write_buffer(&buffer, 0, bytes);
        self.buffer = Some(buffer);
    }

    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.uniform.group, &[]);
        self.draw_quads(pass);
    }

    /// The pipeline that draws in a pick that nothing lies there: what the area hides cannot be picked.
    pub(super) fn pick_pipeline(&self, gpu: &Gpu, frame: &FrameUniform, window: &Window) -> RenderPipeline {
        Primitive {
            name: "cap_pick",
            shader: concat!(include_str!("pick.wgsl"), include_str!("cap_pick.wgsl")),
            groups: &[&frame.layout, &window.layout],
            vertices: Some(vertices()),
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: Some(PICK_FORMAT),
        }
        .pipeline(gpu)
    }

    pub(super) fn draw_pick(&self, pass: &mut RenderPass<'_>, pipeline: &RenderPipeline, window: &Window) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &window.group, &[]);
        self.draw_quads(pass);
    }

    fn draw_quads(&self, pass: &mut RenderPass<'_>) {
        if let Some(buffer) = &self.buffer {
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..self.vertices, 0..1);
        }
    }
}

fn vertices() -> VertexBufferLayout<'static> {
    VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: VertexStepMode::Vertex,
        attributes: &POSITION,
    }
}

impl Drop for Cap {
    fn drop(&mut self) {
        if let Some(buffer) = &self.buffer {
            buffer.destroy();
        }
    }
}
