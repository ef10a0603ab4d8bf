//! The colour tables as a small texture: component classes (opacity: shown or not), defect classes, the ramp, the
//! deviations.

use super::gpu::Gpu;
use super::request::DrawRequest;
use crate::display::color_ramp::{UNKNOWN, ramp};
use crate::display::{ClassMask, Palette, deviation_colors};
use wgpu::{
    Extent3d, TexelCopyBufferLayout, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
    TextureView, TextureViewDescriptor,
};

const WIDTH: usize = 256;
const ROWS: usize = 4;

pub(super) struct Lookup {
    texture: Texture,
    pub(super) view: TextureView,
    written: Option<(Palette, ClassMask)>,
}

impl Lookup {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let texture = gpu.device.create_texture(&TextureDescriptor {
            label: Some("lookup"),
            size: SIZE,
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba8Unorm,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&TextureViewDescriptor::default());
        Self { texture, view, written: None }
    }

    /// Writes the tables if they have changed.
    pub(super) fn prepare(&mut self, gpu: &Gpu, request: &DrawRequest) {
        let wanted = (&request.content.palette, &request.content.visible_classes);
        if self.written.as_ref().is_some_and(|(palette, mask)| (palette, mask) == wanted) {
            return;
        }
        let mut texels = vec![[0_u8; 4]; WIDTH * ROWS];
        for class in 0..WIDTH {
            let [r, g, b] = request.content.palette.components.get(class).copied().unwrap_or(UNKNOWN);
            let shown = request.content.visible_classes.has(class as u16);
            texels[class] = [r, g, b, if shown { 255 } else { 0 }];
            let [r, g, b] = request.content.palette.defects.get(class).copied().unwrap_or(UNKNOWN);
            texels[WIDTH + class] = [r, g, b, 255];
            let [r, g, b] = ramp(class as f32 / (WIDTH - 1) as f32);
            texels[2 * WIDTH + class] = [r, g, b, 255];
            let share = class as f32 / (WIDTH - 1) as f32;
            let [r, g, b] = deviation_colors::color(deviation_colors::TOP * (2.0 * share - 1.0));
            texels[3 * WIDTH + class] = [r, g, b, 255];
        }
        let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(WIDTH as u32 * 4), rows_per_image: None };
        gpu.queue.write_texture(self.texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, SIZE);
        self.written = Some((request.content.palette.clone(), request.content.visible_classes));
    }
}

const SIZE: Extent3d = Extent3d { width: WIDTH as u32, height: ROWS as u32, depth_or_array_layers: 1 };
