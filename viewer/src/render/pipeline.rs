//! Pipelines and uniforms of the primitives: what they have in common.

use super::gpu::Gpu;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingType, BlendState, Buffer, BufferBindingType, BufferDescriptor, BufferUsages, ColorTargetState, ColorWrites,
    CompareFunction, DepthBiasState, DepthStencilState, FragmentState, MultisampleState, PipelineCompilationOptions,
    PipelineLayoutDescriptor, PrimitiveState, PrimitiveTopology, RenderPipeline, RenderPipelineDescriptor,
    ShaderModuleDescriptor, ShaderSource, ShaderStages, StencilState, TextureFormat, VertexBufferLayout, VertexState,
};

/// Depth buffer of every pass that draws the scene.
pub(super) const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// What every shader begins with.
const FRAME: &str = include_str!("frame.wgsl");

/// What tells one primitive's pipeline from another's. Entry points are `vs_<name>` and `fs_<name>`.
pub(super) struct Primitive<'a> {
    pub(super) name: &'a str,
    pub(super) shader: &'a str,
    /// Bind group 0 is the frame's.
    pub(super) groups: &'a [&'a BindGroupLayout],
    pub(super) vertices: Option<VertexBufferLayout<'a>>,
    pub(super) topology: PrimitiveTopology,
    pub(super) blend: Option<BlendState>,
    pub(super) writes_depth: bool,
    pub(super) depth_compare: CompareFunction,
    /// Format of what is drawn on; `None` for the canvas's.
    pub(super) target: Option<TextureFormat>,
}

impl Primitive<'_> {
    pub(super) fn pipeline(&self, gpu: &Gpu) -> RenderPipeline {
        let depth = DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(self.writes_depth),
            depth_compare: Some(self.depth_compare),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        };
        self.pipeline_on(gpu, Some(depth))
    }

    /// For a pass without depths.
    pub(super) fn flat_pipeline(&self, gpu: &Gpu) -> RenderPipeline {
        self.pipeline_on(gpu, None)
    }

    fn pipeline_on(&self, gpu: &Gpu, depth_stencil: Option<DepthStencilState>) -> RenderPipeline {
        let device = &gpu.device;
        let source = [FRAME, self.shader].concat();
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some(self.name),
            source: ShaderSource::Wgsl(source.into()),
        });
        let groups: Vec<Option<&BindGroupLayout>> = self.groups.iter().copied().map(Some).collect();
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some(self.name),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let (vertex, fragment) = (format!("vs_{}", self.name), format!("fs_{}", self.name));
        let buffers: Vec<_> = self.vertices.iter().cloned().map(Some).collect();
        let target = ColorTargetState {
            format: self.target.unwrap_or(gpu.config.format),
            blend: self.blend,
            write_mask: ColorWrites::ALL,
        };
        device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some(self.name),
            layout: Some(&layout),
            vertex: VertexState {
                module: &module,
                entry_point: Some(&vertex),
                compilation_options: PipelineCompilationOptions::default(),
                buffers: &buffers,
            },
            primitive: PrimitiveState { topology: self.topology, ..PrimitiveState::default() },
            depth_stencil,
            multisample: MultisampleState::default(),
            fragment: Some(FragmentState {
                module: &module,
                entry_point: Some(&fragment),
                compilation_options: PipelineCompilationOptions::default(),
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// A uniform of type `T` in a bind group of its own, binding 0, seen by both stages.
pub(super) struct Uniform<T> {
    pub(super) layout: BindGroupLayout,
    pub(super) group: BindGroup,
    buffer: Buffer,
    content: std::marker::PhantomData<T>,
}

impl<T: bytemuck::Pod> Uniform<T> {
    pub(super) fn new(gpu: &Gpu, name: &str) -> Self {
        let buffer = buffer::<T>(gpu, name);
        let entries = [uniform_entry(0)];
        let layout =
            gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(name), entries: &entries });
        let group = gpu.device.create_bind_group(&BindGroupDescriptor {
            label: Some(name),
            layout: &layout,
            entries: &[BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        Self { layout, group, buffer, content: std::marker::PhantomData }
    }

    pub(super) fn write(&self, gpu: &Gpu, content: &T) {
        gpu.queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(content));
    }
}

/// A buffer for one `T`.
pub(super) fn buffer<T>(gpu: &Gpu, name: &str) -> Buffer {
    gpu.device.create_buffer(&BufferDescriptor {
        label: Some(name),
        size: size_of::<T>() as u64,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// The layout entry of a uniform buffer.
pub(super) fn uniform_entry(binding: u32) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::VERTEX_FRAGMENT,
        ty: BindingType::Buffer { ty: BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

/// An sRGB colour (0xRRGGBB) with opacity, as shaders take it.
pub(super) fn rgba(rgb: u32, opacity: f32) -> [f32; 4] {
    let [_, r, g, b] = rgb.to_be_bytes();
    [f32::from(r) / 255.0, f32::from(g) / 255.0, f32::from(b) / 255.0, opacity]
}
