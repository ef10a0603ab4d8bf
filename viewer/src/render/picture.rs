//! The picture before it comes onto the canvas: drawn on a target of its own, with several samples a pixel while nothing
//! moves, then shaded by its depth (see picture.wgsl).

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::pipeline::{DEPTH_FORMAT, Primitive, buffer, uniform_entry};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, Buffer, Color, CommandEncoder, CompareFunction, Extent3d, LoadOp, Operations,
    PrimitiveTopology, RenderPass, RenderPassColorAttachment, RenderPassDepthStencilAttachment, RenderPassDescriptor,
    RenderPipeline, Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages, StoreOp, TextureDescriptor,
    TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor,
    TextureViewDimension,
};

/// Samples along an edge of a pixel while nothing moves.
const FINE: u32 = 2;
/// Most samples of a picture: beyond it a pixel has one, as a device with so many pixels has small ones.
const MOST_SAMPLES: u64 = 12_000_000;

/// Colours and depths of a frame, and how they come onto the canvas.
pub(super) struct Picture {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
    uniform: Buffer,
    nearest: Sampler,
    /// With one sample a pixel.
    coarse: Target,
    /// With several; made when it is first wanted.
    fine: Option<Target>,
    is_fine: bool,
}

struct Target {
    /// Columns and rows.
    size: (u32, u32),
    color: TextureView,
    depth: TextureView,
    group: BindGroup,
}

impl Picture {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let layout = gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("picture"),
            entries: &[uniform_entry(0), texture_entry(1), texture_entry(2), SAMPLER],
        });
        let pipeline = Primitive {
            name: "picture",
            shader: include_str!("picture.wgsl"),
            groups: &[&frame.layout, &layout],
            vertices: None,
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: false,
            depth_compare: CompareFunction::Always,
            target: None,
        }
        .flat_pipeline(gpu);
        let uniform = buffer::<[u32; 4]>(gpu, "picture");
        let nearest =
            gpu.device.create_sampler(&SamplerDescriptor { label: Some("picture"), ..SamplerDescriptor::default() });
        let coarse = Target::new(gpu, 1, &layout, &uniform, &nearest);
        Self { pipeline, layout, uniform, nearest, coarse, fine: None, is_fine: false }
    }

    /// Makes room for a frame of the canvas's size, with several samples a pixel if `fine` and there are not too many, shaded by its
    /// depth if `is_lit`. Returns the samples along an edge of a pixel.
    pub(super) fn prepare(&mut self, gpu: &Gpu, fine: bool, is_lit: bool) -> u32 {
        let (width, height) = (gpu.config.width, gpu.config.height);
        let all = u64::from(width) * u64::from(height) * u64::from(FINE * FINE);
        let largest = width.max(height).saturating_mul(FINE);
        self.is_fine = fine && all <= MOST_SAMPLES && largest <= gpu.device.limits().max_texture_dimension_2d;
        let samples = if self.is_fine { FINE } else { 1 };
        let made = |target: &Target| target.size == (width * samples, height * samples);
        if self.is_fine {
            if !self.fine.as_ref().is_some_and(made) {
                self.fine = Some(Target::new(gpu, samples, &self.layout, &self.uniform, &self.nearest));
            }
        } else if !made(&self.coarse) {
            self.coarse = Target::new(gpu, samples, &self.layout, &self.uniform, &self.nearest);
        }
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&[samples, u32::from(is_lit), 0, 0]));
        samples
    }

    /// Columns and rows of the frame, in samples.
    pub(super) fn size(&self) -> (u32, u32) {
        self.target().size
    }

    /// The pass that draws the frame, or goes on with it.
    pub(super) fn begin<'a>(&self, encoder: &'a mut CommandEncoder, goes_on: bool) -> RenderPass<'a> {
        let target = self.target();
        let (color, depth) = match goes_on {
            true => (LoadOp::Load, LoadOp::Load),
            false => (LoadOp::Clear(Color::BLACK), LoadOp::Clear(1.0)),
        };
        encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("frame"),
            color_attachments: &[Some(attachment(&target.color, color))],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &target.depth,
                depth_ops: Some(Operations { load: depth, store: StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// Puts the frame onto the canvas.
    pub(super) fn finish(&self, encoder: &mut CommandEncoder, frame: &FrameUniform, canvas: &TextureView) {
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(attachment(canvas, LoadOp::Clear(Color::BLACK)))],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &frame.group, &[]);
        pass.set_bind_group(1, &self.target().group, &[]);
        pass.draw(0..3, 0..1);
    }

    fn target(&self) -> &Target {
        self.fine.as_ref().filter(|_| self.is_fine).unwrap_or(&self.coarse)
    }
}

impl Target {
    fn new(gpu: &Gpu, samples: u32, layout: &BindGroupLayout, uniform: &Buffer, nearest: &Sampler) -> Self {
        let size = (gpu.config.width * samples, gpu.config.height * samples);
        let color = texture(gpu, size, gpu.config.format);
        let depth = texture(gpu, size, DEPTH_FORMAT);
        let group = gpu.device.create_bind_group(&BindGroupDescriptor {
            label: Some("picture"),
            layout,
            entries: &[
                BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                BindGroupEntry { binding: 1, resource: BindingResource::TextureView(&color) },
                BindGroupEntry { binding: 2, resource: BindingResource::TextureView(&depth) },
                BindGroupEntry { binding: 3, resource: BindingResource::Sampler(nearest) },
            ],
        });
        Self { size, color, depth, group }
    }
}

fn texture(gpu: &Gpu, (width, height): (u32, u32), format: TextureFormat) -> TextureView {
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: Some("picture"),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&TextureViewDescriptor::default())
}

const SAMPLER: BindGroupLayoutEntry = BindGroupLayoutEntry {
    binding: 3,
    visibility: ShaderStages::FRAGMENT,
    ty: BindingType::Sampler(SamplerBindingType::NonFiltering),
    count: None,
};

fn texture_entry(binding: u32) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty: BindingType::Texture {
            sample_type: TextureSampleType::Float { filterable: false },
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

fn attachment(view: &TextureView, load: LoadOp<Color>) -> RenderPassColorAttachment<'_> {
    RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: Operations { load, store: StoreOp::Store },
    }
}
