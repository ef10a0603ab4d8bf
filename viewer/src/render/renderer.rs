//! The renderer: owns device, canvas and primitives, draws a frame when asked.
//!
//! Nothing runs by itself: a still model costs nothing. After each frame the canvas says what it shows in its data
//! attributes: `data-backend` (`webgpu`, `webgl2`), `data-points` and `data-triangles` (shown), `data-frames` (drawn),
//! `data-samples` (along an edge of a pixel), `data-still` (whether it is drawn as finely as can be), `data-self-test` (`running`,
//! `over`: only then the page shows the canvas) and `data-sequence` (changes of the model that the picture has taken in).

use super::axes;
use super::background::Background;
use super::cap::Cap;
use super::error::RenderError;
use super::floor::{Floor, FloorPlace};
use super::frame::{self, Frame, FrameUniform};
use super::frames_in_flight::FramesInFlight;
use super::frustum;
use super::gpu::{Backend, Gpu};
use super::lines::{LineBuffer, Lines};
use super::mesh::Mesh;
use super::photo_layers::PhotoLayers;
use super::photograph::Photograph;
use super::pick::{Pick, Pickable, Reading};
use super::pick_window::WindowHit;
use super::picture::Picture;
use super::points::Points;
use super::request::DrawRequest;
use super::seen::{Piece, Seen};
use super::segment::Segment;
use super::turntable::Turntable;
use crate::camera::{Bounds, OrbitCamera};
use crate::display::ColorMode;
use crate::scene::photo_layers::{LayerSize, Upload};
use crate::scene::photograph::Pixels;
use glam::{Vec2, Vec3};
use semascan_model::{SemanticCloud, SemanticMesh};
use std::collections::BTreeMap;
use web_sys::HtmlCanvasElement;
use wgpu::{CommandEncoderDescriptor, CurrentSurfaceTexture, RenderPass, SurfaceTexture, TextureViewDescriptor};

/// Side of the square that holds the axes, and its distance from the corner, CSS pixels.
const AXES_SIDE: f32 = 84.0;
const AXES_MARGIN: f32 = 8.0;

/// How far what is drawn may lie from what is looked at, in its radii.
const REACH: f32 = 20.0;

/// What a frame shows.
#[derive(Clone, Copy)]
struct FrameStats {
    /// Points of visible classes, not hidden, after thinning, cut away or not; none where the mesh is.
    points: usize,
    /// Triangles of visible classes, cut away or not.
    triangles: usize,
}

/// What the last frame showed, as far as picks need to know.
#[derive(Clone, Copy)]
struct Drawn {
    camera: OrbitCamera,
    of_mesh: bool,
}

/// A frame that is drawn step by step.
#[derive(Clone, Copy)]
struct Unfinished {
    drawn: Drawn,
    has_turntable: bool,
    is_still: bool,
    stats: FrameStats,
    /// The slot of the points that comes next.
    next: usize,
}

/// A pick whose answer is on its way.
struct Asked {
    reading: Reading,
    drawn: Drawn,
    /// Columns and rows of the picture that was asked about, and how many of them a CSS pixel had.
    picture: Vec2,
    scale: f32,
    /// Middle of the pixel that was asked for, device pixels.
    pixel: Vec2,
    /// Changes of the model, and meshes, until then.
    sequence: u64,
    meshes: u64,
}

/// Opacity of marks where they lie behind the model or inside it, in parts of their own.
const BEHIND: f32 = 0.4;

/// Draws the model on a canvas.
pub struct Renderer {
    gpu: Gpu,
    frame: FrameUniform,
    axes_frame: FrameUniform,
    background: Background,
    points: Points,
    mesh: Mesh,
    photograph: Photograph,
    layers: PhotoLayers,
    cap: Cap,
    turntable: Turntable,
    floor: Floor,
    lines: Lines,
    frusta: LineBuffer,
    marks: LineBuffer,
    marks_behind: LineBuffer,
    /// The section's outlines, as far as nothing is before them.
    outlines: LineBuffer,
    axes: LineBuffer,
    picture: Picture,
    /// Along an edge of a pixel of the last frame.
    samples: u32,
    /// Made with the first pick.
    pick: Option<Pick>,
    drawn: Option<Drawn>,
    unfinished: Option<Unfinished>,
    asked: Option<Asked>,
    /// Change of the model at which each chunk came or went, and at which everything did.
    changed: BTreeMap<[i32; 3], u64>,
    cleared: u64,
    /// Meshes that were taken.
    meshes: u64,
    in_flight: FramesInFlight,
    /// What the self-test draws is not for people.
    is_tested: bool,
    scale: f32,
    frames: u64,
    sequence: u64,
}

impl Renderer {
    /// A renderer on `gpu`, which may not draw although it was opened: see [`super::open`].
    pub(super) fn on(gpu: Gpu) -> Self {
        let frame = frame::uniform(&gpu);
        let (photograph, layers) = (Photograph::new(&gpu), PhotoLayers::new(&gpu));
        Self {
            axes_frame: frame::uniform(&gpu),
            background: Background::new(&gpu, &frame),
            points: Points::new(&gpu, &frame),
            mesh: Mesh::new(&gpu, &frame, &photograph, &layers),
            photograph,
            layers,
            cap: Cap::new(&gpu, &frame),
            turntable: Turntable::new(&gpu, &frame),
            floor: Floor::new(&gpu, &frame),
            lines: Lines::new(&gpu, &frame),
            frusta: LineBuffer::default(),
            marks: LineBuffer::default(),
            marks_behind: LineBuffer::default(),
            outlines: LineBuffer::default(),
            axes: LineBuffer::default(),
            picture: Picture::new(&gpu, &frame),
            samples: 1,
            pick: None,
            drawn: None,
            unfinished: None,
            asked: None,
            changed: BTreeMap::new(),
            cleared: 0,
            meshes: 0,
            in_flight: FramesInFlight::default(),
            is_tested: false,
            scale: 1.0,
            frames: 0,
            sequence: 0,
            frame,
            gpu,
        }
    }

    /// Forgets what was drawn for the self-test, which is over.
    pub(super) fn restart_counts(&mut self) {
        self.is_tested = true;
        self.frames = 0;
        self.sequence = 0;
        self.cleared = 0;
        self.drawn = None;
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

    /// Sets the size of the picture in CSS pixels and how many pixels of the picture one of them has; with the next frame that is whole.
    pub fn resize(&mut self, width: f32, height: f32, device_pixel_ratio: f32) {
        let scale = if device_pixel_ratio.is_finite() { device_pixel_ratio.clamp(0.25, 8.0) } else { 1.0 };
        self.scale = scale;
        self.gpu.resize((width * scale).round() as u32, (height * scale).round() as u32);
    }

    /// Puts `cloud` (table frame, metres) in the place of whatever chunk `id` held.
    pub fn set_chunk(&mut self, id: [i32; 3], cloud: &SemanticCloud) {
        self.points.set_chunk(&self.gpu, id, cloud);
        self.sequence += 1;
        self.changed.insert(id, self.sequence);
    }

    /// Takes chunk `id` out.
    pub fn remove_chunk(&mut self, id: [i32; 3]) {
        self.points.remove_chunk(&self.gpu, id);
        self.sequence += 1;
        self.changed.remove(&id);
    }

    /// Takes everything out.
    pub fn clear(&mut self) {
        self.points.clear();
        self.sequence += 1;
        self.changed.clear();
        self.cleared = self.sequence;
    }

    /// Takes a mesh in the place of the one before, with a deviation in metres for each vertex if it has such.
    pub fn set_mesh(&mut self, mesh: Option<(&SemanticMesh, &[f32])>) {
        self.mesh.set(&self.gpu, mesh);
        self.meshes += 1;
    }

    /// Takes the pixels of a photograph in the place of the one before, or takes it away. Where it lies on the mesh is said with each
    /// frame.
    pub fn set_photograph(&mut self, pixels: Option<&Pixels>) {
        self.photograph.set(&self.gpu, &self.frame, &self.mesh, pixels);
    }

    /// Makes room for the photographs that colour the mesh; what was there of another size is gone.
    pub fn set_layer_size(&mut self, size: Option<LayerSize>) {
        self.layers.set_size(&self.gpu, size);
    }

    /// Takes the pixels of one of them. Where it lies on the mesh is said with each frame.
    pub fn put_layer(&mut self, upload: &Upload) {
        self.layers.put(&self.gpu, upload);
    }

    /// Asks what the last frame shows at `at` (CSS pixels from the picture's top left corner), or within a few CSS pixels
    /// of it; in the place of what was asked before. [`Renderer::picked`] answers.
    pub fn pick(&mut self, at: Vec2) {
        let Some(drawn) = self.drawn else { return };
        let picture = self.gpu.size();
        let pixel = (at / drawn.camera.viewport() * picture).floor() + 0.5;
        let (gpu, frame) = (&self.gpu, &self.frame);
        let pickable = Pickable { points: &self.points, mesh: &self.mesh, cap: &self.cap };
        let pick = self.pick.get_or_insert_with(|| Pick::new(gpu, frame, pickable));
        let reading = pick.begin(gpu, frame, pickable, drawn.of_mesh, pixel);
        let (sequence, meshes) = (self.sequence, self.meshes);
        self.asked = Some(Asked { reading, drawn, picture, scale: self.scale, pixel, sequence, meshes });
    }

    /// Whether an answer is on its way.
    pub fn is_picking(&self) -> bool {
        self.asked.is_some()
    }

    /// The answer to [`Renderer::pick`], once it is there; it never waits for it.
    pub fn picked(&mut self) -> Option<Seen> {
        let asked = self.asked.as_ref()?;
        let hit = asked.reading.poll(&self.gpu, asked.scale)?;
        let asked = self.asked.take()?;
        Some(hit.map_or(Seen::Nothing, |hit| self.seen(&asked, hit)))
    }

    /// What was hit.
    fn seen(&self, asked: &Asked, hit: WindowHit) -> Seen {
        let of = match asked.drawn.of_mesh {
            true if self.meshes > asked.meshes => return Seen::Changed,
            true => Piece::Vertex(hit.number),
            false => match self.points.place_of(hit.number) {
                Some((chunk, block, slot)) if self.changed.get(&chunk).is_some_and(|at| *at <= asked.sequence) => {
                    Piece::Slot { chunk, block, slot }
                }
                _ => return Seen::Changed,
            },
        };
        if self.cleared > asked.sequence {
            return Seen::Changed;
        }
        let camera = asked.drawn.camera;
        let at = (asked.pixel + hit.offset) / asked.picture * camera.viewport();
        Seen::Surface { of, place: camera.unproject(at, hit.distance), distance: hit.distance }
    }

    /// Whether the graphics processor is still at earlier frames, so that another would only come late.
    pub fn is_busy(&self) -> bool {
        self.in_flight.is_full(&self.gpu.device) && self.lost().is_none()
    }

    /// Draws one frame, or the first step of it: after so many points, at `most`, the frame is gone on with by [`Self::go_on`], and the
    /// canvas shows the one before until it is whole.
    ///
    /// # Errors
    /// [`RenderError::Lost`] when the device or the surface is gone.
    pub fn draw(&mut self, request: &DrawRequest, most: Option<usize>) -> Result<(), RenderError> {
        if let Some(reason) = self.lost() {
            return Err(RenderError::Lost(reason));
        }
        self.prepare(request);
        let (points, triangles) =
            if request.content.mesh { (0, self.mesh.shown()) } else { (self.points.shown(request), 0) };
        self.unfinished = Some(Unfinished {
            drawn: Drawn { camera: request.camera, of_mesh: request.content.mesh },
            has_turntable: request.content.turntable.is_some(),
            is_still: request.is_still,
            stats: FrameStats { points, triangles },
            next: 0,
        });
        self.go_on(most)
    }

    /// Whether a frame is being drawn step by step.
    pub fn is_unfinished(&self) -> bool {
        self.unfinished.is_some()
    }

    /// Goes on with the frame that [`Self::draw`] began, as it does; nothing where there is none.
    ///
    /// # Errors
    /// As of [`Self::draw`].
    pub fn go_on(&mut self, most: Option<usize>) -> Result<(), RenderError> {
        if let Some(reason) = self.lost() {
            return Err(RenderError::Lost(reason));
        }
        let Some(unfinished) = self.unfinished.take() else { return Ok(()) };
        let mut encoder = self.gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("frame") });
        let mut pass = self.picture.begin(&mut encoder, unfinished.next > 0);
        pass.set_bind_group(0, &self.frame.group, &[]);
        if unfinished.next == 0 {
            self.background.draw(&mut pass);
        }
        let next = if unfinished.drawn.of_mesh {
            self.mesh.draw(&mut pass, &self.photograph, &self.layers);
            None
        } else {
            self.points.draw(&mut pass, unfinished.next, most)
        };
        if let Some(next) = next {
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
            self.in_flight.submit(&self.gpu.queue);
            self.unfinished = Some(Unfinished { next, ..unfinished });
            return Ok(());
        }
        self.draw_rest(&mut pass, unfinished.has_turntable);
        drop(pass);
        let texture = self.acquire()?;
        let view = texture.texture.create_view(&TextureViewDescriptor::default());
        self.picture.finish(&mut encoder, &self.frame, &view);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.queue.present(texture);
        self.in_flight.submit(&self.gpu.queue);
        self.frames += 1;
        self.drawn = Some(unfinished.drawn);
        self.write_statistics(unfinished.stats, unfinished.is_still);
        Ok(())
    }

    /// What is drawn after the model.
    fn draw_rest(&self, pass: &mut RenderPass<'_>, has_turntable: bool) {
        self.cap.draw(pass);
        match has_turntable {
            true => self.turntable.draw(pass),
            false => self.floor.draw(pass),
        }
        self.lines.draw(pass, &self.frusta);
        self.lines.draw(pass, &self.marks);
        // Depth range of zero width: nothing is in front of these.
        let (width, height) = self.picture.size();
        pass.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 0.0);
        self.lines.draw(pass, &self.outlines);
        self.lines.draw(pass, &self.marks_behind);
        if let Some((side, margin)) = self.axes_square() {
            pass.set_viewport(margin, height as f32 - side - margin, side, side, 0.0, 0.0);
            pass.set_bind_group(0, &self.axes_frame.group, &[]);
            self.lines.draw(pass, &self.axes);
        }
    }

    /// Puts what the frame needs on the device.
    fn prepare(&mut self, request: &DrawRequest) {
        let gpu = &self.gpu;
        // Photographs have their own light.
        let is_lit = !(request.content.mesh && request.content.color_mode == ColorMode::Photo);
        self.samples = self.picture.prepare(gpu, request.is_still, is_lit);
        let (width, height) = self.picture.size();
        let model = request.focus.filter(|b| !b.is_empty());
        let reach = model.map_or(Bounds::EMPTY, |focus| focus.grown(REACH));
        let mut scene =
            model.unwrap_or(Bounds::EMPTY).union(request.bounds.unwrap_or(Bounds::EMPTY).intersection(reach));
        match &request.content.turntable {
            Some(disc) => {
                self.turntable.prepare(gpu, disc, request.content.color_scheme);
                let corner = Vec3::new(disc.radius, disc.radius, 0.0);
                let height = Vec3::Z * disc.height;
                scene = scene.union(Bounds::from_corners(height - corner, height + corner));
            }
            None => {
                let place = FloorPlace::under(model);
                self.floor.prepare(gpu, place, request.content.color_scheme);
                scene = scene.union(place.bounds());
            }
        }
        let depth = model.map_or(0.08, |b| b.radius() * 0.6).clamp(0.03, 0.3);
        let segments: Vec<_> = request
            .content
            .frusta
            .iter()
            .flat_map(|f| frustum::segments(f, depth, request.content.color_scheme))
            .collect();
        for segment in &segments {
            scene.include(segment.from);
            scene.include(segment.to);
        }
        self.frusta.write(gpu, &segments);
        let section = request.content.section.as_ref();
        self.cap.prepare(gpu, section, request.content.color_scheme);
        let outlines = section.map(|section| section.lines.as_slice()).unwrap_or_default();
        // From the open side nothing of the model is before them; from the other one they are marks like all others.
        let is_open = request.content.cut.opens_toward(request.camera.eye().into());
        let (before, among): (&[Segment], &[Segment]) = if is_open { (outlines, &[]) } else { (&[], outlines) };
        self.outlines.write(gpu, before);
        let marks = [among, &request.content.marks].concat();
        self.marks.write(gpu, &marks);
        let faint = |segment: &Segment| {
            let [r, g, b, opacity] = segment.color;
            Segment { color: [r, g, b, (f32::from(opacity) * BEHIND) as u8], ..*segment }
        };
        self.marks_behind.write(gpu, &marks.iter().map(faint).collect::<Vec<_>>());
        let forward = request.camera.forward();
        let right = forward.cross(Vec3::Z).normalize_or(Vec3::X);
        self.axes.write(gpu, &axes::segments(right, right.cross(forward)));
        let scale = self.scale * self.samples as f32;
        if let Some((side, _)) = self.axes_square() {
            self.axes_frame.write(gpu, &Frame::axes(&request.camera, side, scale));
        }
        let size = Vec2::new(width as f32, height as f32);
        self.frame.write(gpu, &Frame::scene(&request.camera, size, scale, scene, &request.content.cut));
        self.background.prepare(gpu, request.content.color_scheme);
        self.points.prepare(gpu, request);
        self.photograph.prepare(gpu, &self.frame, request, &self.mesh, self.meshes);
        self.layers.prepare(gpu, &self.frame, request, &self.mesh, self.meshes);
        self.mesh.prepare(gpu, request);
    }

    /// Side of the axes' square and its distance from the corner, in samples; none on a picture too small for it.
    fn axes_square(&self) -> Option<(f32, f32)> {
        let scale = self.scale * self.samples as f32;
        let (width, height) = self.picture.size();
        let side = AXES_SIDE * scale;
        (side * 3.0 < width.min(height) as f32).then_some((side, AXES_MARGIN * scale))
    }

    fn acquire(&mut self) -> Result<SurfaceTexture, RenderError> {
        self.gpu.bring_to_size();
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
    fn write_statistics(&self, stats: FrameStats, is_still: bool) {
        let data = self.gpu.canvas.dataset();
        let entries = [
            ("backend", self.backend().name().to_owned()),
            ("points", stats.points.to_string()),
            ("triangles", stats.triangles.to_string()),
            ("frames", self.frames.to_string()),
            ("samples", self.samples.to_string()),
            ("still", is_still.to_string()),
            ("selfTest", if self.is_tested { "over" } else { "running" }.to_owned()),
            ("sequence", self.sequence.to_string()),
        ];
        for (name, value) in entries {
            // Fails only for names that are no identifiers.
            let _ = data.set(name, &value);
        }
    }
}
