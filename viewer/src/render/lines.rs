//! Lines of constant width on the screen: camera frusta and the axes.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::pipeline::Primitive;
use super::segment::Segment;
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BlendState, Buffer, BufferDescriptor, BufferUsages, CompareFunction, PrimitiveTopology, RenderPass, RenderPipeline,
    VertexBufferLayout, VertexStepMode,
};

/// Vertices of a segment: two triangles. The segments are few, so each vertex carries its segment.
const CORNERS: usize = 6;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    from: [f32; 3],
    to: [f32; 3],
    color: [u8; 4],
    width: f32,
}

/// The pipeline of all lines.
pub(super) struct Lines {
    pipeline: RenderPipeline,
}

/// Some lines in a buffer that grows as needed.
#[derive(Default)]
pub(super) struct LineBuffer {
    buffer: Option<Buffer>,
    vertices: u32,
}

impl Lines {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Float32];
        let pipeline = Primitive {
            name: "lines",
            shader: include_str!("lines.wgsl"),
            groups: &[&frame.layout],
            vertices: Some(VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: VertexStepMode::Vertex,
                attributes: &attributes,
            }),
            topology: PrimitiveTopology::TriangleList,
            blend: Some(BlendState::ALPHA_BLENDING),
            writes_depth: false,
            depth_compare: CompareFunction::LessEqual,
            target: None,
        }
        .pipeline(gpu);
        Self { pipeline }
    }

    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, lines: &LineBuffer) {
        if let Some(buffer) = lines.buffer.as_ref().filter(|_| lines.vertices > 0) {
            pass.set_pipeline(&self.pipeline);
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..lines.vertices, 0..1);
        }
    }
}

impl LineBuffer {
    pub(super) fn write(&mut self, gpu: &Gpu, segments: &[Segment]) {
        let mut vertices = Vec::with_capacity(segments.len() * CORNERS);
        for Segment { from, to, color, width } in segments {
            vertices.extend([Vertex { from: (*from).into(), to: (*to).into(), color: *color, width: *width }; CORNERS]);
        }
        self.vertices = vertices.len() as u32;
        if vertices.is_empty() {
            return;
        }
        let bytes: &[u8] = bytemuck::cast_slice(&vertices);
        let size = (bytes.len() as u64).next_power_of_two();
        let buffer = match self.buffer.take() {
            Some(buffer) if buffer.size() >= size => buffer,
            _ => gpu.device.create_buffer(&BufferDescriptor {
                label: Some("lines"),
                size,
                usage: BufferUsages::VERTEX | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        };
        gpu.queue.write_buffer(&buffer, 0, bytes);
        self.buffer = Some(buffer);
    }
}
