//! The renderer: owns device, canvas and primitives, draws a frame when asked.
//!
//! Nothing runs by itself: a still model costs nothing. After each frame the canvas says what it shows in its data
//! attributes: `data-backend` (`webgpu`, `webgl2`), `data-points` and `data-triangles` (shown), `data-frames` (drawn) and
//! `data-sequence` (changes of the model that the picture has taken in).

mod prepare;

use super::background::Background;
use super::error::RenderError;
use super::floor::Floor;
use super::frame::{self, FrameUniform};
use super::frames_in_flight::FramesInFlight;
use super::gpu::{Backend, Gpu, replace_canvas};
use super::lines::{LineBuffer, Lines};
use super::mesh::Mesh;
use super::pipeline::DEPTH_FORMAT;
use super::points::Points;
use super::request::{BackendChoice, DrawRequest};
use super::self_test;
use super::turntable::Turntable;
use prepare::AXES_MARGIN;
use semascan_model::{SemanticCloud, SemanticMesh};
use web_sys::HtmlCanvasElement;
use wgpu::{
    Color, CommandEncoderDescriptor, CurrentSurfaceTexture, Extent3d, LoadOp, Operations, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp, SurfaceTexture, TextureDescriptor,
    TextureDimension, TextureUsages, TextureView, TextureViewDescriptor,
};

/// What a frame showed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameStats {
    /// Points shown: of visible classes, not hidden, after thinning; none where the mesh is.
    pub points: usize,
    /// Triangles shown: of visible classes.
    pub triangles: usize,
    /// Frames drawn by this renderer, this one included.
    pub frames: u64,
}

/// Draws the model on a canvas.
pub struct Renderer {
    gpu: Gpu,
    frame: FrameUniform,
    axes_frame: FrameUniform,
    background: Background,
    points: Points,
    mesh: Mesh,
    turntable: Turntable,
    floor: Floor,
    lines: Lines,
    frusta: LineBuffer,
    axes: LineBuffer,
    depth: TextureView,
    in_flight: FramesInFlight,
    scale: f32,
    frames: u64,
    sequence: u64,
}

impl Renderer {
    /// Starts to draw on `canvas`. A graphics interface counts only if it passes the self-test; before another one is
    /// tried the canvas element is replaced by a fresh one with the same attributes, so ask for [`Renderer::canvas`]
    /// before adding listeners.
    ///
    /// # Errors
    /// [`RenderError`] if no interface, or not the one chosen, draws.
    pub async fn new(canvas: HtmlCanvasElement, choice: BackendChoice) -> Result<Self, RenderError> {
        let first = match choice {
            BackendChoice::Auto => Backend::WebGpu,
            BackendChoice::WebGpu => return Self::open(canvas, Backend::WebGpu).await,
            BackendChoice::WebGl2 => return Self::open(canvas, Backend::WebGl2).await,
        };
        let webgpu = match Self::open(canvas.clone(), first).await {
            Ok(renderer) => return Ok(renderer),
            Err(error) => error.to_string(),
        };
        web_sys::console::warn_1(&format!("semascan: {webgpu}; trying webgl2").into());
        let fresh = replace_canvas(&canvas)?;
        match Self::open(fresh, Backend::WebGl2).await {
            Ok(renderer) => Ok(renderer),
            Err(error) => Err(RenderError::Nothing { webgpu, webgl2: error.to_string() }),
        }
    }

    /// A new renderer on a fresh canvas in the place of one whose device was lost. With [`BackendChoice::Auto`] it takes
    /// WebGL2: WebGPU has failed already, now or at the start. Set every chunk again.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub async fn rebuild(self, choice: BackendChoice) -> Result<Self, RenderError> {
        let fresh = replace_canvas(self.canvas())?;
        drop(self);
        let backend = match choice {
            BackendChoice::Auto | BackendChoice::WebGl2 => Backend::WebGl2,
            BackendChoice::WebGpu => Backend::WebGpu,
        };
        Self::open(fresh, backend).await
    }

    async fn open(canvas: HtmlCanvasElement, backend: Backend) -> Result<Self, RenderError> {
        let gpu = Gpu::open(canvas, backend).await?;
        let frame = frame::uniform(&gpu);
        let mut renderer = Self {
            axes_frame: frame::uniform(&gpu),
            background: Background::new(&gpu, &frame),
            points: Points::new(&gpu, &frame),
            mesh: Mesh::new(&gpu, &frame),
            turntable: Turntable::new(&gpu, &frame),
            floor: Floor::new(&gpu, &frame),
            lines: Lines::new(&gpu, &frame),
            frusta: LineBuffer::default(),
            axes: LineBuffer::default(),
            depth: depth_buffer(&gpu),
            in_flight: FramesInFlight::default(),
            scale: 1.0,
            frames: 0,
            sequence: 0,
            frame,
            gpu,
        };
        self_test::run(&mut renderer).await?;
        renderer.frames = 0;
        renderer.sequence = 0;
        Ok(renderer)
    }

    /// The canvas element that is drawn on.
    pub fn canvas(&self) -> &HtmlCanvasElement {
        &self.gpu.canvas
    }

    /// The graphics interface in use.
    pub fn backend(&self) -> Backend {
        self.gpu.backend
    }

    /// Why the device was lost, if it was.
    pub fn lost(&self) -> Option<String> {
        self.gpu.lost.reason()
    }

    /// Calls `on_lost` with the reason when the device is lost, from the page's event loop.
    pub fn on_lost(&self, on_lost: impl FnOnce(String) + 'static) {
        let lost = self.gpu.lost.clone();
        wasm_bindgen_futures::spawn_local(async move { on_lost(lost.wait().await) });
    }

    /// Sets the size of the picture in CSS pixels and how many device pixels one of them has.
    pub fn resize(&mut self, width: f32, height: f32, device_pixel_ratio: f32) {
        let scale = if device_pixel_ratio.is_finite() { device_pixel_ratio.clamp(0.25, 8.0) } else { 1.0 };
        let before = (self.gpu.config.width, self.gpu.config.height);
        self.scale = scale;
        self.gpu.resize((width * scale).round() as u32, (height * scale).round() as u32);
        if before != (self.gpu.config.width, self.gpu.config.height) {
            self.depth = depth_buffer(&self.gpu);
        }
    }

    /// Puts `cloud` (table frame, metres) in the place of whatever chunk `id` held.
    pub fn set_chunk(&mut self, id: [i32; 3], cloud: &SemanticCloud) {
        self.points.set_chunk(&self.gpu, id, cloud);
        self.sequence += 1;
    }

    /// Takes chunk `id` out.
    pub fn remove_chunk(&mut self, id: [i32; 3]) {
        self.points.remove_chunk(&self.gpu, id);
        self.sequence += 1;
    }

    /// Takes everything out.
    pub fn clear(&mut self) {
        self.points.clear();
        self.sequence += 1;
    }

    /// Takes a mesh in the place of the one before, with a deviation in metres for each vertex if it has such.
    pub fn set_mesh(&mut self, mesh: Option<(&SemanticMesh, &[f32])>) {
        self.mesh.set(&self.gpu, mesh);
    }

    /// Whether the graphics processor is still at earlier frames, so that another would only come late.
    pub fn is_busy(&self) -> bool {
        self.in_flight.is_full(&self.gpu.device) && self.lost().is_none()
    }

    /// Draws one frame.
    ///
    /// # Errors
    /// [`RenderError::Lost`] when the device or the surface is gone.
    pub fn draw(&mut self, request: &DrawRequest) -> Result<FrameStats, RenderError> {
        if let Some(reason) = self.lost() {
            return Err(RenderError::Lost(reason));
        }
        self.prepare(request);
        let texture = self.acquire()?;
        let view = texture.texture.create_view(&TextureViewDescriptor::default());
        let mut encoder = self.gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("frame") });
        {
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("frame"),
                color_attachments: &[Some(RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: Operations { load: LoadOp::Clear(Color::BLACK), store: StoreOp::Store },
                })],
                depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                    view: &self.depth,
                    depth_ops: Some(Operations { load: LoadOp::Clear(1.0), store: StoreOp::Discard }),
                    stencil_ops: None,
                }),
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_bind_group(0, &self.frame.group, &[]);
            self.background.draw(&mut pass);
            match request.content.mesh {
                true => self.mesh.draw(&mut pass),
                false => self.points.draw(&mut pass),
            }
            match request.content.turntable {
                Some(_) => self.turntable.draw(&mut pass),
                None => self.floor.draw(&mut pass),
            }
            self.lines.draw(&mut pass, &self.frusta);
            if let Some(side) = self.axes_side() {
                let y = self.gpu.config.height as f32 - side - AXES_MARGIN * self.scale;
                // Depth range of zero width: nothing is in front of the axes.
                pass.set_viewport(AXES_MARGIN * self.scale, y, side, side, 0.0, 0.0);
                pass.set_bind_group(0, &self.axes_frame.group, &[]);
                self.lines.draw(&mut pass, &self.axes);
            }
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.queue.present(texture);
        self.in_flight.submit(&self.gpu.queue);
        self.frames += 1;
        let (points, triangles) =
            if request.content.mesh { (0, self.mesh.shown()) } else { (self.points.shown(request), 0) };
        let stats = FrameStats { points, triangles, frames: self.frames };
        self.write_statistics(stats);
        Ok(stats)
    }

    fn acquire(&self) -> Result<SurfaceTexture, RenderError> {
        match self.gpu.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture) | CurrentSurfaceTexture::Suboptimal(texture) => Ok(texture),
            // Once more with a fresh configuration, then give up.
            _ => {
                self.gpu.surface.configure(&self.gpu.device, &self.gpu.config);
                match self.gpu.surface.get_current_texture() {
                    CurrentSurfaceTexture::Success(texture) | CurrentSurfaceTexture::Suboptimal(texture) => Ok(texture),
                    other => Err(RenderError::Lost(format!("the surface is {other:?}"))),
                }
            }
        }
    }

    /// Writes what the frame showed into the canvas's data attributes.
    fn write_statistics(&self, stats: FrameStats) {
        let data = self.gpu.canvas.dataset();
        let entries = [
            ("backend", self.backend().name().to_owned()),
            ("points", stats.points.to_string()),
            ("triangles", stats.triangles.to_string()),
            ("frames", stats.frames.to_string()),
            ("sequence", self.sequence.to_string()),
        ];
        for (name, value) in entries {
            // Fails only for names that are no identifiers.
            let _ = data.set(name, &value);
        }
    }
}

fn depth_buffer(gpu: &Gpu) -> TextureView {
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: Some("depth"),
        size: Extent3d { width: gpu.config.width, height: gpu.config.height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: DEPTH_FORMAT,
        usage: TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&TextureViewDescriptor::default())
}
