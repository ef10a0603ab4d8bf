//! A photograph on the mesh: its pixels, its camera, and the distances of the mesh as that camera sees it, by which the shader knows
//! what the camera did not see. Distances are the bits of a float in an unsigned integer, the one format of such that WebGL2 is sure
//! to draw on.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::mesh::Mesh;
use super::pick::{PICK_FORMAT, numbers_pass};
use super::pipeline::{DEPTH_FORMAT, Primitive, Uniform, buffer, uniform_entry};
use super::request::{DrawRequest, ProjectedPhotograph};
use crate::scene::photograph::Pixels;
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, Buffer, CommandEncoderDescriptor, CompareFunction, Extent3d, FilterMode,
    PrimitiveTopology, RenderPipeline, Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages,
    TexelCopyBufferLayout, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType,
    TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
};

/// What the shaders of the mesh begin with.
pub(super) const SHADER: &str = include_str!("photograph.wgsl");
/// Columns and rows of the distances.
const SIDE: u32 = 1024;
/// How far a surface may lie behind the distance at its pixel, voxels.
const TOLERANCE: f32 = 1.5;

/// See photograph.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Content {
    camera_from_table: [[f32; 4]; 4],
    camera: [f32; 4],
    size: [f32; 4],
}

/// What distances are drawn with.
struct Distances {
    uniform: Uniform<Content>,
    pipeline: RenderPipeline,
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
        let uniform = buffer::<Content>(gpu, "photograph");
        let sampler = gpu.device.create_sampler(&SamplerDescriptor {
            label: Some("photograph"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            ..SamplerDescriptor::default()
        });
        let picture = view(&texture(gpu, TextureFormat::Rgba8Unorm, (1, 1), TextureUsages::COPY_DST));
        let none = view(&texture(gpu, PICK_FORMAT, (1, 1), TextureUsages::RENDER_ATTACHMENT));
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
            Some(photograph) => Content::of(photograph, TOLERANCE * request.voxel),
            None => Content::zeroed(),
        };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&content));
        let (Some(photograph), Some(distances)) = (photograph, &mut self.distances) else { return };
        // How strongly it covers the mesh changes no distance.
        let of = Some((ProjectedPhotograph { strength: 0.0, ..photograph }, meshes));
        if distances.of != of {
            distances.of = of;
            distances.uniform.write(gpu, &content);
            distances.draw(gpu, frame, mesh);
        }
    }
}

impl Content {
    fn of(photograph: &ProjectedPhotograph, tolerance: f32) -> Self {
        let camera = &photograph.camera;
        Self {
            camera_from_table: camera.camera_from_table.to_cols_array_2d(),
            camera: [camera.focal.x, camera.focal.y, camera.center.x, camera.center.y],
            size: [camera.size.x, camera.size.y, photograph.strength, tolerance],
        }
    }
}

impl Distances {
    fn new(gpu: &Gpu, frame: &FrameUniform, mesh: &Mesh) -> Self {
        let uniform = Uniform::new(gpu, "photograph");
        let pipeline = Primitive {
            name: "mesh_distance",
            shader: concat!(include_str!("photograph.wgsl"), include_str!("photograph_distance.wgsl")),
            groups: &[&frame.layout, &uniform.layout],
            vertices: Some(mesh.positions()),
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: Some(PICK_FORMAT),
        }
        .pipeline(gpu);
        let target = texture(gpu, PICK_FORMAT, (SIDE, SIDE), TextureUsages::RENDER_ATTACHMENT);
        let depth = texture(gpu, DEPTH_FORMAT, (SIDE, SIDE), TextureUsages::RENDER_ATTACHMENT);
        Self { uniform, pipeline, target: view(&target), depth: view(&depth), of: None }
    }

    /// Draws the whole mesh, what is hidden or cut away of it too: it hid the rest from the camera all the same.
    fn draw(&self, gpu: &Gpu, frame: &FrameUniform, mesh: &Mesh) {
        let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("photograph") });
        {
            let mut pass = numbers_pass(&mut encoder, "photograph", &self.target, &self.depth);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &frame.group, &[]);
            pass.set_bind_group(1, &self.uniform.group, &[]);
            mesh.draw_whole(&mut pass);
        }
        gpu.queue.submit([encoder.finish()]);
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
