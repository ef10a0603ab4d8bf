//! The model's surface: one vertex and one index buffer, triangles in order of their component (see mesh.wgsl).

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::lookup::Lookup;
use super::mesh_vertex::{self, MeshVertex};
use super::photo_layers::{self, PhotoLayers};
use super::photograph::{self, Photograph};
use super::pick::{PICK_FORMAT, Window};
use super::pipeline::{Primitive, buffer, uniform_entry};
use super::request::DrawRequest;
use crate::display::{ClassMask, ColorMode, deviation_colors};
use bytemuck::{Pod, Zeroable};
use semascan_model::SemanticMesh;
use std::ops::Range;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingResource,
    BindingType, Buffer, BufferDescriptor, BufferUsages, CompareFunction, IndexFormat, PrimitiveTopology, RenderPass,
    RenderPipeline, ShaderStages, TextureSampleType, TextureViewDimension, VertexAttribute, VertexBufferLayout,
    VertexStepMode,
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    scale: [f32; 4],
    share: [f32; 4],
    select: [u32; 4],
}

/// The position of a vertex.
const POSITION: [VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x3];

/// A mesh on the graphics device.
struct Loaded {
    vertices: Buffer,
    indices: Buffer,
    /// Indices of each component class.
    ranges: Vec<(u16, Range<u32>)>,
}

pub(super) struct Mesh {
    pipeline: RenderPipeline,
    uniform: Buffer,
    style: BindGroup,
    lookup: Lookup,
    loaded: Option<Loaded>,
    visible: ClassMask,
}

impl Mesh {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform, photograph: &Photograph, layers: &PhotoLayers) -> Self {
        let lookup = Lookup::new(gpu);
        let layout = gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("mesh"),
            entries: &[
                uniform_entry(0),
                BindGroupLayoutEntry {
                    binding: 1,
                    visibility: ShaderStages::VERTEX_FRAGMENT,
                    ty: BindingType::Texture {
                        sample_type: TextureSampleType::Float { filterable: false },
                        view_dimension: TextureViewDimension::D2,
                        multisampled: false,
                    },
                    count: None,
                },
            ],
        });
        let uniform = buffer::<Content>(gpu, "mesh");
        let style = gpu.device.create_bind_group(&BindGroupDescriptor {
            label: Some("mesh"),
            layout: &layout,
            entries: &[
                BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                BindGroupEntry { binding: 1, resource: BindingResource::TextureView(&lookup.view) },
            ],
        });
        let attributes = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Snorm8x4, 2 => Unorm8x4, 3 => Uint16x4, 4 => Float32
        ];
        let pipeline = Primitive {
            name: "mesh",
            shader: &[photograph::SHADER, photo_layers::SHADER, include_str!("mesh.wgsl")].concat(),
            groups: &[&frame.layout, &layout, &photograph.layout, &layers.layout],
            vertices: Some(VertexBufferLayout {
                array_stride: size_of::<MeshVertex>() as u64,
                step_mode: VertexStepMode::Vertex,
                attributes: &attributes,
            }),
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: None,
        }
        .pipeline(gpu);
        Self { pipeline, uniform, style, lookup, loaded: None, visible: ClassMask::ALL }
    }

    /// Puts a mesh in the place of the one before, or takes it out; `deviations` are metres a vertex.
    pub(super) fn set(&mut self, gpu: &Gpu, mesh: Option<(&SemanticMesh, &[f32])>) {
        self.loaded = mesh.filter(|(mesh, _)| !mesh.triangles.is_empty()).map(|(mesh, deviations)| {
            let (indices, ranges) = mesh_vertex::by_component(mesh);
            Loaded {
                vertices: filled(gpu, BufferUsages::VERTEX, bytemuck::cast_slice(&mesh_vertex::pack(mesh, deviations))),
                indices: filled(gpu, BufferUsages::INDEX, bytemuck::cast_slice(&indices)),
                ranges,
            }
        });
    }

    /// How many triangles the frame shows.
    pub(super) fn shown(&self) -> usize {
        self.ranges().map(|r| r.len() / 3).sum()
    }

    pub(super) fn prepare(&mut self, gpu: &Gpu, request: &DrawRequest) {
        self.lookup.prepare(gpu, request);
        self.visible = request.content.visible_classes;
        let (mode, shading) = match request.content.color_mode {
            ColorMode::Appearance => (0, 0.55),
            ColorMode::Component => (1, 0.85),
            ColorMode::Confidence => (2, 0.6),
            ColorMode::Views => (3, 0.6),
            ColorMode::Defect => (4, 0.85),
            ColorMode::Deviation => (5, 0.5),
            ColorMode::Sigma => (6, 0.6),
            ColorMode::Photo => (7, 0.55),
        };
        let content = Content {
            scale: [
                1.0 / request.content.tolerance.max(1e-9),
                deviation_colors::TOP,
                1.0 / f32::from(request.content.views_top.max(1)),
                shading,
            ],
            share: request.content.share_scale(),
            select: [mode, 0, 0, 0],
        };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&content));
    }

    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, photograph: &Photograph, layers: &PhotoLayers) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.style, &[]);
        pass.set_bind_group(2, &photograph.group, &[]);
        pass.set_bind_group(3, &layers.group, &[]);
        self.draw_ranges(pass, self.ranges());
    }

    /// Draws the triangles of every component, with the pipeline that is set.
    pub(super) fn draw_whole(&self, pass: &mut RenderPass<'_>) {
        self.draw_ranges(pass, self.loaded.iter().flat_map(|l| &l.ranges).map(|(_, range)| range));
    }

    fn draw_ranges<'a>(&self, pass: &mut RenderPass<'_>, ranges: impl Iterator<Item = &'a Range<u32>>) {
        let Some(loaded) = &self.loaded else { return };
        pass.set_vertex_buffer(0, loaded.vertices.slice(..));
        pass.set_index_buffer(loaded.indices.slice(..), IndexFormat::Uint32);
        for range in ranges {
            pass.draw_indexed(range.clone(), 0, 0..1);
        }
    }

    /// Where a vertex has its position, for pipelines that need nothing else of it.
    pub(super) fn positions(&self) -> VertexBufferLayout<'static> {
        VertexBufferLayout {
            array_stride: size_of::<MeshVertex>() as u64,
            step_mode: VertexStepMode::Vertex,
            attributes: &POSITION,
        }
    }

    /// The pipeline that draws numbers in place of colours.
    pub(super) fn pick_pipeline(&self, gpu: &Gpu, frame: &FrameUniform, window: &Window) -> RenderPipeline {
        Primitive {
            name: "mesh_pick",
            shader: concat!(include_str!("pick.wgsl"), include_str!("mesh_pick.wgsl")),
            groups: &[&frame.layout, &window.layout],
            vertices: Some(self.positions()),
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: Some(PICK_FORMAT),
        }
        .pipeline(gpu)
    }

    /// Draws the numbers of the triangles that the last frame showed.
    pub(super) fn draw_pick(&self, pass: &mut RenderPass<'_>, pipeline: &RenderPipeline, window: &Window) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &window.group, &[]);
        self.draw_ranges(pass, self.ranges());
    }

    /// Indices of the visible components.
    fn ranges(&self) -> impl Iterator<Item = &Range<u32>> {
        let all = self.loaded.iter().flat_map(|l| &l.ranges);
        all.filter(|(label, _)| self.visible.has(*label)).map(|(_, range)| range)
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        // At once, not at the garbage collector's leisure.
        self.vertices.destroy();
        self.indices.destroy();
    }
}

/// A buffer with `bytes` in it.
fn filled(gpu: &Gpu, usage: BufferUsages, bytes: &[u8]) -> Buffer {
    let buffer = gpu.device.create_buffer(&BufferDescriptor {
        label: Some("mesh"),
        size: bytes.len().next_multiple_of(4) as u64,
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}
