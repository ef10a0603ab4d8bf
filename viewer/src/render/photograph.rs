//! A photograph on the mesh: its pixels, its camera, and the distances of the mesh as that camera sees it.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::mesh::Mesh;
use super::photograph_distances::{CameraContent, DISTANCE_FORMAT, DistancePass};
use super::pipeline::{DEPTH_FORMAT, buffer, uniform_entry};
use super::request::{DrawRequest, ProjectedPhotograph};
use crate::scene::photograph::Pixels;
use bytemuck::Zeroable;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, Buffer, Extent3d, FilterMode, Sampler, SamplerBindingType, SamplerDescriptor,
    ShaderStages, TexelCopyBufferLayout, Texture, TextureDescriptor, TextureDimension, TextureFormat,
    TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
};

/// What the shaders of the mesh begin with.
pub(super) const SHADER: &str = include_str!("photograph.wgsl");
/// Columns and rows of the distances.
const SIDE: u32 = 1024;
/// What distances are drawn with.
struct Distances {
    pass: DistancePass,
    target: TextureView,
    depth: TextureView,
    /// Camera and mesh of what was drawn.
    of: Option<(ProjectedPhotograph, u64)>,
}

/// A photograph, or none.
pub(super) struct Photograph {
    pub(super) layout: BindGroupLayout,
    pub(super) group: BindGroup,
    uniform: Buffer,
    sampler: Sampler,
    picture: Option<Texture>,
    /// Made with the first photograph.
    distances: Option<Distances>,
}

impl Photograph {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let layout = layout(gpu);
        let uniform = buffer::<CameraContent>(gpu, "photograph");
        let sampler = gpu.device.create_sampler(&SamplerDescriptor {
            label: Some("photograph"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            ..SamplerDescriptor::default()
        });
        let picture = view(&texture(gpu, TextureFormat::Rgba8Unorm, (1, 1), TextureUsages::COPY_DST));
        let none = view(&texture(gpu, DISTANCE_FORMAT, (1, 1), TextureUsages::RENDER_ATTACHMENT));
        let group = group(gpu, &layout, &uniform, &sampler, &picture, &none);
        Self { layout, group, uniform, sampler, picture: None, distances: None }
    }

    /// Takes the pixels of a photograph in the place of the one before, or takes it away.
    pub(super) fn set(&mut self, gpu: &Gpu, frame: &FrameUniform, mesh: &Mesh, pixels: Option<&Pixels>) {
        if let Some(before) = self.picture.take() {
            before.destroy();
        }
        let most = gpu.device.limits().max_texture_dimension_2d;
        let Some(pixels) = pixels.filter(|p| p.width.max(p.height) <= most && p.width.min(p.height) > 0) else {
            return;
        };
        if pixels.rgba.len() != pixels.width as usize * pixels.height as usize * 4 {
            return;
        }
        let texture = texture(gpu, TextureFormat::Rgba8Unorm, (pixels.width, pixels.height), TextureUsages::COPY_DST);
        let row = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * pixels.width), rows_per_image: None };
        gpu.queue.write_texture(texture.as_image_copy(), &pixels.rgba, row, texture.size());
        let distances = self.distances.get_or_insert_with(|| Distances::new(gpu, frame, mesh));
        self.group = group(gpu, &self.layout, &self.uniform, &self.sampler, &view(&texture), &distances.target);
        self.picture = Some(texture);
    }

    /// Puts what the frame needs on the device; `meshes` is another number for every mesh.
    pub(super) fn prepare(&mut self, gpu: &Gpu, frame: &FrameUniform, request: &DrawRequest, mesh: &Mesh, meshes: u64) {
        let photograph = request.content.photograph.filter(|_| self.picture.is_some() && request.content.mesh);
        let content = match &photograph {
            Some(photograph) => CameraContent::of(&photograph.camera, photograph.strength, request.voxel),
            None => CameraContent::zeroed(),
        };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&content));
        let (Some(photograph), Some(distances)) = (photograph, &mut self.distances) else { return };
        // How strongly it covers the mesh changes no distance.
        let of = Some((ProjectedPhotograph { strength: 0.0, ..photograph }, meshes));
        if distances.of != of {
            distances.of = of;
            distances.pass.draw(gpu, frame, mesh, &content, &distances.target, &distances.depth);
        }
    }
}

impl Distances {
    fn new(gpu: &Gpu, frame: &FrameUniform, mesh: &Mesh) -> Self {
        let target = texture(gpu, DISTANCE_FORMAT, (SIDE, SIDE), TextureUsages::RENDER_ATTACHMENT);
        let depth = texture(gpu, DEPTH_FORMAT, (SIDE, SIDE), TextureUsages::RENDER_ATTACHMENT);
        Self { pass: DistancePass::new(gpu, frame, mesh), target: view(&target), depth: view(&depth), of: None }
    }
}

impl Drop for Photograph {
    fn drop(&mut self) {
        // At once, not at the garbage collector's leisure.
        if let Some(picture) = &self.picture {
            picture.destroy();
        }
    }
}

fn layout(gpu: &Gpu) -> BindGroupLayout {
    let texture_entry = |binding, sample_type| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty: BindingType::Texture { sample_type, view_dimension: TextureViewDimension::D2, multisampled: false },
        count: None,
    };
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("photograph"),
        entries: &[
            uniform_entry(0),
            texture_entry(1, TextureSampleType::Float { filterable: true }),
            BindGroupLayoutEntry {
                binding: 2,
                visibility: ShaderStages::FRAGMENT,
                ty: BindingType::Sampler(SamplerBindingType::Filtering),
                count: None,
            },
            texture_entry(3, TextureSampleType::Uint),
        ],
    })
}

fn group(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    uniform: &Buffer,
    sampler: &Sampler,
    picture: &TextureView,
    distances: &TextureView,
) -> BindGroup {
    gpu.device.create_bind_group(&BindGroupDescriptor {
        label: Some("photograph"),
        layout,
        entries: &[
            BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: BindingResource::TextureView(picture) },
            BindGroupEntry { binding: 2, resource: BindingResource::Sampler(sampler) },
            BindGroupEntry { binding: 3, resource: BindingResource::TextureView(distances) },
        ],
    })
}

fn texture(gpu: &Gpu, format: TextureFormat, (width, height): (u32, u32), usage: TextureUsages) -> Texture {
    gpu.device.create_texture(&TextureDescriptor {
        label: Some("photograph"),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | usage,
        view_formats: &[],
    })
}

fn view(texture: &Texture) -> TextureView {
    texture.create_view(&TextureViewDescriptor::default())
}
