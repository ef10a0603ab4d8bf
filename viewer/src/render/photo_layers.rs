//! The photographs that colour the mesh together: their pixels with smaller pictures of them for surface far away, and the distances
//! of the mesh as each camera sees it, each as a layer of one texture (see photo_layers.wgsl).

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::mesh::Mesh;
use super::photograph_camera::PhotographCamera;
use super::photograph_distances::{CameraContent, DISTANCE_FORMAT, DistancePass};
use super::pipeline::{DEPTH_FORMAT, buffer, uniform_entry};
use super::request::{DrawRequest, PhotoLayer};
use crate::display::ColorMode;
use crate::scene::photo_layers::{LayerSize, MOST_LAYERS, Upload};
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, Buffer, Extent3d, FilterMode, MipmapFilterMode, Origin3d, Sampler,
    SamplerBindingType, SamplerDescriptor, ShaderStages, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture,
    TextureAspect, TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureView,
    TextureViewDescriptor, TextureViewDimension,
};

/// What the shader of the mesh needs of them.
pub(super) const SHADER: &str = include_str!("photo_layers.wgsl");

/// See photo_layers.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LayerContent {
    camera: CameraContent,
    eye: [f32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    count: [u32; 4],
    list: [LayerContent; MOST_LAYERS],
}

/// What a layer of the textures holds.
#[derive(Clone, Copy, Default)]
struct Held {
    has_pixels: bool,
    /// Camera and mesh of its distances.
    distances: Option<(PhotographCamera, u64)>,
}

/// Room for photographs.
struct Room {
    size: LayerSize,
    pictures: Texture,
    distances: Texture,
    depth: Texture,
    slots: Vec<Held>,
}

/// The photographs, or none.
pub(super) struct PhotoLayers {
    pub(super) layout: BindGroupLayout,
    pub(super) group: BindGroup,
    uniform: Buffer,
    sampler: Sampler,
    room: Option<Room>,
    /// Made with the first photograph.
    pass: Option<DistancePass>,
}

impl PhotoLayers {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let layout = layout(gpu);
        let uniform = buffer::<Content>(gpu, "photographs");
        let sampler = gpu.device.create_sampler(&SamplerDescriptor {
            label: Some("photographs"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..SamplerDescriptor::default()
        });
        let group = empty_group(gpu, &layout, &uniform, &sampler);
        Self { layout, group, uniform, sampler, room: None, pass: None }
    }

    /// Makes room for photographs of this size in the place of those before; of the same size, they stay.
    pub(super) fn set_size(&mut self, gpu: &Gpu, size: Option<LayerSize>) {
        if self.room.as_ref().map(|room| room.size) == size {
            return;
        }
        // Given back before there is room for others.
        self.room = None;
        self.room = size.map(|size| Room::new(gpu, size));
        let (layout, uniform, sampler) = (&self.layout, &self.uniform, &self.sampler);
        self.group = match &self.room {
            Some(room) => group(gpu, layout, uniform, sampler, &array(&room.pictures), &array(&room.distances)),
            None => empty_group(gpu, layout, uniform, sampler),
        };
    }

    /// Takes the pixels of a photograph.
    pub(super) fn put(&mut self, gpu: &Gpu, upload: &Upload) {
        let Some(room) = &mut self.room else { return };
        let Some(held) = room.slots.get_mut(upload.slot as usize) else { return };
        for (level, pixels) in (0..room.size.levels()).zip(&upload.levels) {
            let (width, height) = room.size.of_level(level);
            let to = TexelCopyTextureInfo {
                texture: &room.pictures,
                mip_level: level,
                origin: Origin3d { x: 0, y: 0, z: upload.slot },
                aspect: TextureAspect::All,
            };
            let rows =
                TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: Some(height) };
            let extent = Extent3d { width, height, depth_or_array_layers: 1 };
            gpu.queue.write_texture(to, pixels, rows, extent);
        }
        held.has_pixels = true;
    }

    /// Puts what the frame needs on the device; `meshes` is another number for every mesh.
    pub(super) fn prepare(&mut self, gpu: &Gpu, frame: &FrameUniform, request: &DrawRequest, mesh: &Mesh, meshes: u64) {
        let mut content = Content::zeroed();
        let shows = request.content.mesh && request.content.color_mode == ColorMode::Photo;
        if let Some(room) = self.room.as_mut().filter(|_| shows) {
            let pass = self.pass.get_or_insert_with(|| DistancePass::new(gpu, frame, mesh));
            let held = |layer: &&PhotoLayer| room.slots.get(layer.slot as usize).is_some_and(|held| held.has_pixels);
            let layers: Vec<PhotoLayer> =
                request.content.layers.iter().filter(held).take(MOST_LAYERS).copied().collect();
            for (layer, to) in layers.iter().zip(&mut content.list) {
                let eye = layer.camera.eye();
                let camera = CameraContent::of(&layer.camera, layer.quality, request.voxel);
                *to = LayerContent { camera, eye: [eye.x, eye.y, eye.z, layer.slot as f32] };
                let held = &mut room.slots[layer.slot as usize];
                let of = Some((layer.camera, meshes));
                if std::mem::replace(&mut held.distances, of) != of {
                    pass.draw(gpu, frame, mesh, &camera, &one(&room.distances, layer.slot), &one(&room.depth, 0));
                }
            }
            content.count[0] = layers.len() as u32;
        }
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&content));
    }
}

impl Room {
    fn new(gpu: &Gpu, size: LayerSize) -> Self {
        let layers = [size.width, size.height, size.slots];
        let drawn = TextureUsages::RENDER_ATTACHMENT;
        Self {
            size,
            pictures: texture(gpu, TextureFormat::Rgba8Unorm, layers, size.levels(), TextureUsages::COPY_DST),
            distances: texture(gpu, DISTANCE_FORMAT, layers, 1, drawn),
            depth: texture(gpu, DEPTH_FORMAT, [size.width, size.height, 1], 1, drawn),
            slots: vec![Held::default(); size.slots as usize],
        }
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        // At once, not at the garbage collector's leisure.
        [&self.pictures, &self.distances, &self.depth].into_iter().for_each(Texture::destroy);
    }
}

fn layout(gpu: &Gpu) -> BindGroupLayout {
    let texture_entry = |binding, sample_type| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty: BindingType::Texture { sample_type, view_dimension: TextureViewDimension::D2Array, multisampled: false },
        count: None,
    };
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("photographs"),
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
    pictures: &TextureView,
    distances: &TextureView,
) -> BindGroup {
    gpu.device.create_bind_group(&BindGroupDescriptor {
        label: Some("photographs"),
        layout,
        entries: &[
            BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: BindingResource::TextureView(pictures) },
            BindGroupEntry { binding: 2, resource: BindingResource::Sampler(sampler) },
            BindGroupEntry { binding: 3, resource: BindingResource::TextureView(distances) },
        ],
    })
}

/// Without any photograph: it is never read.
fn empty_group(gpu: &Gpu, layout: &BindGroupLayout, uniform: &Buffer, sampler: &Sampler) -> BindGroup {
    // One layer alone would be no array to WebGL2.
    let none = |format| array(&texture(gpu, format, [2, 1, 2], 1, TextureUsages::COPY_DST));
    group(gpu, layout, uniform, sampler, &none(TextureFormat::Rgba8Unorm), &none(DISTANCE_FORMAT))
}

fn texture(
    gpu: &Gpu,
    format: TextureFormat,
    [width, height, layers]: [u32; 3],
    levels: u32,
    usage: TextureUsages,
) -> Texture {
    gpu.device.create_texture(&TextureDescriptor {
        label: Some("photographs"),
        size: Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | usage,
        view_formats: &[],
    })
}

/// All layers.
fn array(texture: &Texture) -> TextureView {
    let dimension = Some(TextureViewDimension::D2Array);
    texture.create_view(&TextureViewDescriptor { dimension, ..TextureViewDescriptor::default() })
}

/// One layer.
fn one(texture: &Texture, layer: u32) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..TextureViewDescriptor::default()
    })
}
