//! What lies at a place of the picture: the few pixels around it drawn once more, with numbers in place of colours (see
//! pick.wgsl), and read back.
//!
//! They are drawn with the uniforms of the last frame, so what can be picked is what the picture shows: the same classes,
//! marks and thinning. All vertices pass once more and hardly any pixel does, so a pick costs less than a frame. The page
//! never waits for the answer: the buffer is mapped when the device has filled it, and asked for with each animation frame.
//! Four unsigned integers a pixel are the one integer format that WebGL2 is sure to read back.

use super::cap::Cap;
use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::mesh::Mesh;
use super::pick_window::{self, ROW_BYTES, SIDE, WindowHit};
use super::pipeline::{DEPTH_FORMAT, Uniform};
use super::points::Points;
use glam::Vec2;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, Color, CommandEncoder, CommandEncoderDescriptor, Extent3d, LoadOp, MapMode,
    Operations, PollType, RenderPass, RenderPassColorAttachment, RenderPassDepthStencilAttachment,
    RenderPassDescriptor, RenderPipeline, StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

/// Format of the numbers.
pub(super) const PICK_FORMAT: TextureFormat = TextureFormat::Rgba32Uint;

/// Where in the picture the window is: its middle, -1..1, and the picture's size in windows.
pub(super) type Window = Uniform<[f32; 4]>;

const SIZE: Extent3d = Extent3d { width: SIDE as u32, height: SIDE as u32, depth_or_array_layers: 1 };

/// What is drawn once more for a pick.
#[derive(Clone, Copy)]
pub(super) struct Pickable<'a> {
    pub(super) points: &'a Points,
    pub(super) mesh: &'a Mesh,
    pub(super) cap: &'a Cap,
}

/// Draws numbers, and reads them back.
pub(super) struct Pick {
    window: Window,
    points: RenderPipeline,
    mesh: RenderPipeline,
    cap: RenderPipeline,
    numbers: Texture,
    numbers_view: TextureView,
    depth: TextureView,
}

/// How the mapping of a buffer stands.
const PENDING: u8 = 0;
const MAPPED: u8 = 1;
const FAILED: u8 = 2;

/// Numbers on their way back.
pub(super) struct Reading {
    buffer: Buffer,
    standing: Arc<AtomicU8>,
}

impl Pick {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform, drawn: Pickable<'_>) -> Self {
        let window = Window::new(gpu, "pick");
        let numbers = target(gpu, PICK_FORMAT, TextureUsages::COPY_SRC);
        Self {
            points: drawn.points.pick_pipeline(gpu, frame, &window),
            mesh: drawn.mesh.pick_pipeline(gpu, frame, &window),
            cap: drawn.cap.pick_pipeline(gpu, frame, &window),
            numbers_view: numbers.create_view(&TextureViewDescriptor::default()),
            depth: target(gpu, DEPTH_FORMAT, TextureUsages::empty()).create_view(&TextureViewDescriptor::default()),
            numbers,
            window,
        }
    }

    /// Draws the window around a pixel and begins to read it back.
    ///
    /// * `pixel`: device pixels from the picture's top left corner, the middle of one.
    /// * `of_mesh`: whether the last frame showed the mesh and not the points.
    pub(super) fn begin(
        &self,
        gpu: &Gpu,
        frame: &FrameUniform,
        drawn: Pickable<'_>,
        of_mesh: bool,
        pixel: Vec2,
    ) -> Reading {
        let picture = Vec2::new(gpu.config.width as f32, gpu.config.height as f32);
        let middle = (pixel / picture * 2.0 - 1.0) * Vec2::new(1.0, -1.0);
        let windows = picture / SIDE as f32;
        self.window.write(gpu, &[middle.x, middle.y, windows.x, windows.y]);
        let buffer = gpu.device.create_buffer(&BufferDescriptor {
            label: Some("pick"),
            size: (SIDE * ROW_BYTES) as u64,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("pick") });
        {
            let mut pass = numbers_pass(&mut encoder, "pick", &self.numbers_view, &self.depth);
            pass.set_bind_group(0, &frame.group, &[]);
            match of_mesh {
                true => drawn.mesh.draw_pick(&mut pass, &self.mesh, &self.window),
                false => drawn.points.draw_pick(&mut pass, &self.points, &self.window),
            }
            drawn.cap.draw_pick(&mut pass, &self.cap, &self.window);
        }
        let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(ROW_BYTES as u32), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            self.numbers.as_image_copy(),
            TexelCopyBufferInfo { buffer: &buffer, layout },
            SIZE,
        );
        gpu.queue.submit([encoder.finish()]);
        let standing = Arc::new(AtomicU8::new(PENDING));
        let reported = standing.clone();
        buffer.slice(..).map_async(MapMode::Read, move |mapped| {
            reported.store(if mapped.is_ok() { MAPPED } else { FAILED }, Ordering::Relaxed);
        });
        Reading { buffer, standing }
    }
}

impl Reading {
    /// What is meant, once that is known; the inner `None` where nothing lies.
    ///
    /// * `scale`: device pixels in a CSS pixel.
    pub(super) fn poll(&self, gpu: &Gpu, scale: f32) -> Option<Option<WindowHit>> {
        // WebGL2 is asked; WebGPU reports by itself. A device that fails here is lost, which is reported elsewhere.
        let _ = gpu.device.poll(PollType::Poll);
        match self.standing.load(Ordering::Relaxed) {
            PENDING => None,
            MAPPED => Some(
                self.buffer.slice(..).get_mapped_range().ok().and_then(|bytes| pick_window::nearest(&bytes, scale)),
            ),
            _ => Some(None),
        }
    }
}

impl Drop for Reading {
    fn drop(&mut self) {
        // At once, not at the garbage collector's leisure.
        self.buffer.destroy();
    }
}

/// A pass that draws unsigned integers on a target without any.
pub(super) fn numbers_pass<'a>(
    encoder: &'a mut CommandEncoder,
    label: &str,
    numbers: &TextureView,
    depth: &TextureView,
) -> RenderPass<'a> {
    encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(RenderPassColorAttachment {
            view: numbers,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
        })],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(Operations { load: LoadOp::Clear(1.0), store: StoreOp::Discard }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

fn target(gpu: &Gpu, format: TextureFormat, usage: TextureUsages) -> Texture {
    gpu.device.create_texture(&TextureDescriptor {
        label: Some("pick"),
        size: SIZE,
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | usage,
        view_formats: &[],
    })
}
