//! The 3D view: model, mesh, camera and renderer; draws a frame when one is due, and no other.

use super::graphics::{Graphics, Size};
use super::moving_detail::{Detail, MovingDetail};
use super::open_recording::RecordingWorker;
use super::painting::Painting;
use super::permalink::Permalink;
use super::pick_queue::{PickQueue, Purpose, Wanted};
use super::ticker::Ticker;
use super::{anchors, canvas_data};
use crate::camera::{Button, CameraInput, OrbitCamera, PointerInput, Puck};
use crate::export::ExportWorker;
use crate::features::correct::{CorrectEvent, Tool};
use crate::features::inspect::InspectEvent;
use crate::features::measure::MeasureEvent;
use crate::features::review::ReviewEvent;
use crate::features::section::{Ray, SectionEvent};
use crate::features::view::{Controller, Host};
use crate::features::{FeatureEvent, mounted};
use crate::link::LinkEvent;
use crate::link::api::Agent;
use crate::mesh_worker::MeshWorker;
use crate::render::seen::Seen;
use crate::render::{BackendChoice, DrawRequest};
use crate::scene::figures::class_counts;
use crate::scene::frame_content::frame_content;
use crate::scene::pick::picked_point;
use crate::scene::{HeldLayers, HeldMesh, HeldModel, HeldPhotograph, ModelChange};
use crate::state::Event;
use crate::ui::Ui;
use glam::{Vec2, Vec3};
use semascan_protocol::server_message::Body;
use std::cell::{Cell, OnceCell, RefCell};
use std::rc::{Rc, Weak};
use web_sys::{Document, HtmlCanvasElement, Window};

/// Least time between two counts of the model's figures while it grows, milliseconds.
const FIGURES_MS: f64 = 200.0;
/// The camera counts as moving until so long after the last input, milliseconds.
const MOVING_MS: f64 = 180.0;
/// Once nothing has changed for so long, the picture is drawn as finely as can be, milliseconds.
const STILL_MS: f64 = 150.0;
/// A mouse that has not moved for so long rests, milliseconds.
const REST_MS: f64 = 160.0;
/// Shortest steps in which strokes are drawn, CSS pixels.
const STROKE_STEP: f32 = 6.0;
/// Time between pictures while a stroke is drawn, milliseconds.
const STROKE_PICTURE_MS: f64 = 200.0;
/// By how much the drawn surface may be in front of a point on it, voxels: splats are larger than voxels, and tilted.
const PROBE_TOLERANCE: f32 = 4.0;

/// What is seen and from where.
pub(super) struct Viewport {
    pub(super) ui: Ui,
    pub(super) document: Document,
    graphics: Rc<Graphics>,
    pub(super) model: Rc<RefCell<HeldModel>>,
    pub(super) mesh: Rc<RefCell<HeldMesh>>,
    photograph: Rc<RefCell<HeldPhotograph>>,
    layers: Rc<RefCell<HeldLayers>>,
    pub(super) mesh_worker: Rc<MeshWorker>,
    pub(super) export_worker: ExportWorker,
    pub(super) recording_worker: RecordingWorker,
    pub(super) agent: Agent,
    controllers: OnceCell<Vec<Rc<dyn Controller>>>,
    camera: Rc<Cell<OrbitCamera>>,
    /// The camera keeps the whole model in view until the person moves it.
    follows: Cell<bool>,
    /// The inspection that the camera looks at, by its id.
    shown: RefCell<String>,
    /// Where a link wants the camera, and what at, until there is an inspection.
    linked_camera: Cell<Option<(Vec3, Vec3)>>,
    /// What a link cuts away, until then.
    linked_cut: RefCell<Option<SectionEvent>>,
    size: Cell<Size>,
    moving_detail: Cell<MovingDetail>,
    /// The person moved the camera since the last frame.
    steered: Cell<bool>,
    /// Time of the last frame, and of the last one that followed an input, in the clock of animation frames.
    now: Cell<f64>,
    moved_at: Cell<f64>,
    draw_due: Cell<bool>,
    /// Time of the last frame, while that is one of a moving picture.
    coarse_since: Cell<Option<f64>>,
    painting: Painting,
    /// Revision of the photograph that the renderer has; `None` with a new renderer.
    drawn_photograph: Cell<Option<u64>>,
    figures_due: Cell<bool>,
    figures_at: Cell<f64>,
    picks: RefCell<PickQueue>,
    /// Number of the stroke that is being drawn; `None` while none is.
    stroke: Cell<Option<u32>>,
    /// Whether a loop is being drawn.
    is_looping: Cell<bool>,
    /// Where the mouse was last, and since which frame; `None` once it rests, or has left.
    mouse: Cell<Option<(Vec2, Option<f64>)>>,
    /// Where the mouse is over a section that is being read, since the last frame; the inner `None` once it has left.
    aimed: Cell<Option<Option<Vec2>>>,
    /// Whether it has to be found out anew which anchored elements are seen.
    probe_due: Cell<bool>,
    ticker: Ticker,
    /// What is done after each picture.
    after_drawing: OnceCell<Box<dyn Fn()>>,
}

impl Viewport {
    pub(super) fn new(ui: Ui, window: &Window, document: &Document, choice: BackendChoice) -> Rc<Self> {
        let viewport = Rc::new_cyclic(|weak: &Weak<Self>| {
            let on_frame = call(weak, Self::frame);
            let on_input = call(weak, Self::point);
            let on_ready = call(weak, |viewport, ()| viewport.fill_renderer());
            Self {
                ui,
                document: document.clone(),
                graphics: Graphics::new(ui, document, choice, on_input, move || on_ready(())),
                model: Rc::default(),
                mesh: Rc::default(),
                photograph: Rc::default(),
                layers: Rc::default(),
                mesh_worker: Rc::default(),
                export_worker: ExportWorker::default(),
                recording_worker: RecordingWorker::default(),
                agent: Agent::default(),
                controllers: OnceCell::new(),
                camera: Rc::default(),
                follows: Cell::new(true),
                shown: RefCell::default(),
                linked_camera: Cell::default(),
                linked_cut: RefCell::default(),
                size: Cell::default(),
                moving_detail: Cell::default(),
                steered: Cell::default(),
                now: Cell::default(),
                moved_at: Cell::new(f64::NEG_INFINITY),
                draw_due: Cell::new(true),
                coarse_since: Cell::default(),
                painting: Painting::default(),
                drawn_photograph: Cell::default(),
                figures_due: Cell::new(false),
                figures_at: Cell::new(f64::NEG_INFINITY),
                picks: RefCell::default(),
                stroke: Cell::default(),
                is_looping: Cell::default(),
                mouse: Cell::default(),
                aimed: Cell::default(),
                probe_due: Cell::default(),
                ticker: Ticker::new(window.clone(), on_frame),
                after_drawing: OnceCell::new(),
            }
        });
        let redraw = call(&Rc::downgrade(&viewport), |viewport, ()| viewport.redraw());
        let host = Host {
            ui,
            model: viewport.model.clone(),
            mesh: viewport.mesh.clone(),
            photograph: viewport.photograph.clone(),
            layers: viewport.layers.clone(),
            paint: viewport.painting.paint.clone(),
            camera: viewport.camera.clone(),
            mesh_worker: viewport.mesh_worker.clone(),
            agent: viewport.agent.clone(),
            redraw: Rc::new(move || redraw(())),
        };
        viewport.controllers.get_or_init(|| mounted::controllers(&host));
        viewport
    }

    /// Starts to draw on the page's canvas.
    pub(super) fn open(&self, canvas: HtmlCanvasElement) {
        self.graphics.open(canvas);
    }

    /// Follows one event of the link: model, picture and state.
    pub(super) fn handle_link(&self, event: LinkEvent) {
        let change = self.model.borrow_mut().apply(&event);
        if change != ModelChange::None {
            self.graphics.follow(change, &self.model.borrow());
            self.painting.follow(change);
            self.controllers().iter().for_each(|controller| controller.model_changed(change));
            self.figures_due.set(true);
            self.redraw();
        }
        if let LinkEvent::Connected { inspection, .. } | LinkEvent::Cleared(inspection) = &event
            // An agent that was started anew does not know at first which inspection it will show.
            && !inspection.id.is_empty()
            && self.shown.replace(inspection.id.clone()) != inspection.id
        {
            match self.linked_camera.take() {
                Some((eye, target)) => self.steer(CameraInput::From { eye, target }),
                None => self.follows.set(true),
            }
        }
        // Every chunk of a final model is sent before the message that it is final: that message finds the figures counted.
        if matches!(event, LinkEvent::Message(Body::Progress(_))) {
            self.count();
        }
        // Chunks concern the model alone.
        if !event.is_bulk() {
            self.ui.send(Event::from(event));
        }
        if self.ui.read(|s| !s.inspection.id.is_empty())
            && let Some(cut) = self.linked_cut.take()
        {
            self.ui.send_feature(cut);
        }
        if matches!(change, ModelChange::Cleared | ModelChange::Exchanged) {
            self.count();
        }
    }

    /// The page is there: the tools may follow the state.
    pub(super) fn begin(&self) {
        self.controllers().iter().for_each(|controller| controller.begin());
    }

    /// Carries out what an event asks of the tools, after the state has followed it.
    pub(super) fn handle_feature(&self, event: &FeatureEvent) {
        self.controllers().iter().for_each(|controller| controller.handle(event));
    }

    /// A frame is due.
    pub(super) fn redraw(&self) {
        self.draw_due.set(true);
        self.ticker.request();
    }

    /// The model's figures are due.
    pub(super) fn recount(&self) {
        self.figures_due.set(true);
        self.ticker.request();
    }

    /// Does what the pointer asks for.
    fn point(&self, input: PointerInput) {
        match input {
            PointerInput::Camera(input) => self.steer(input),
            PointerInput::Drag { button, from, to } => self.drag(button, from, to),
            PointerInput::Lift => self.lift(),
            PointerInput::Click(at) => {
                self.mouse.set(None);
                self.click(self.in_viewport(at));
            }
            PointerInput::Hover(place) if self.ui.read(|s| s.features.section.reads()) => {
                self.aimed.set(Some(place.map(|at| self.in_viewport(at))));
                self.ticker.request();
            }
            PointerInput::Hover(place) => {
                self.mouse.set(place.map(|at| (self.in_viewport(at), None)));
                self.picks.borrow_mut().leave();
                self.forget_hover();
                self.ticker.request();
            }
        }
    }

    /// Follows a drag: it moves the camera, unless a tool draws with it.
    fn drag(&self, button: Button, from: Vec2, to: Vec2) {
        let tool = self.ui.read(|s| s.features.correct.tool);
        let draws = matches!(tool, Some(Tool::Brush | Tool::Lasso | Tool::Outline));
        let pixels = to - from;
        match (button, draws) {
            (Button::Primary, true) if tool == Some(Tool::Lasso) => self.draw_loop(from, to),
            (Button::Primary, true) => self.draw_stroke(from, to),
            (Button::Secondary, true) | (Button::Primary, false) => self.steer(CameraInput::Orbit { pixels }),
            (Button::Secondary, false) => self.steer(CameraInput::Pan { pixels }),
        }
    }

    /// Takes a piece of a stroke, in steps that leave no gap.
    fn draw_stroke(&self, from: Vec2, to: Vec2) {
        let stroke = self.stroke.get().unwrap_or_else(|| {
            let number = self.ui.read(|s| s.features.correct.next_number());
            self.ui.send_feature(CorrectEvent::Begun { number });
            self.stroke.set(Some(number));
            self.picks.borrow_mut().draw(number, self.in_viewport(from));
            number
        });
        // A wide brush leaves no gap with long steps.
        let camera = self.camera.get();
        let radius = self.ui.read(|s| s.features.correct.brush_radius().unwrap_or_default());
        let pixels = radius * camera.pixels_per_metre(camera.eye().distance(camera.target()));
        let steps = (from.distance(to) / STROKE_STEP.max(pixels)).ceil().max(1.0) as u32;
        let mut picks = self.picks.borrow_mut();
        for step in 1..=steps {
            picks.draw(stroke, self.in_viewport(from.lerp(to, step as f32 / steps as f32)));
        }
        drop(picks);
        canvas_data::write_drawing(&self.document, true);
        self.mouse.set(None);
        self.ticker.request();
    }

    /// Takes a piece of a loop.
    fn draw_loop(&self, from: Vec2, to: Vec2) {
        let viewport = self.camera.get().viewport();
        if !self.is_looping.replace(true) {
            self.ui.send_feature(CorrectEvent::Looped(self.in_viewport(from) / viewport));
        }
        self.ui.send_feature(CorrectEvent::Looped(self.in_viewport(to) / viewport));
        self.mouse.set(None);
    }

    /// The stroke, or the loop, is over.
    fn lift(&self) {
        if self.is_looping.take() {
            self.ui.send_feature(CorrectEvent::LoopClosed);
        }
        if let Some(stroke) = self.stroke.take() {
            self.ui.send_feature(CorrectEvent::Lifted(stroke));
        }
    }

    /// Shows what a link leads to, as soon as it is there.
    pub(super) fn follow_link(&self, link: &Permalink) {
        if let Some((eye, target)) = link.camera {
            match self.ui.read(|s| s.inspection.id.is_empty()) {
                true => self.linked_camera.set(link.camera),
                false => self.steer(CameraInput::From { eye, target }),
            }
        }
        if link.plane.is_some() || link.limits.is_some() {
            let cut = SectionEvent::Follow { plane: link.plane, limits: link.limits };
            match self.ui.read(|s| s.inspection.id.is_empty()) {
                true => *self.linked_cut.borrow_mut() = Some(cut),
                false => self.ui.send_feature(cut),
            }
        }
        if let Some(mode) = link.color_mode {
            self.ui.send(Event::ColorMode(mode));
        }
        if let Some(finding) = link.finding {
            self.ui.send_feature(ReviewEvent::Wanted(finding));
        }
    }

    /// What is seen.
    pub(super) fn permalink(&self) -> Permalink {
        let camera = self.camera.get();
        self.ui.read(|s| Permalink {
            camera: Some((camera.eye(), camera.target())),
            color_mode: Some(s.display.color_mode),
            finding: s.features.review.selected,
            plane: s.features.section.plane(),
            limits: s.features.section.limits,
        })
    }

    /// The link that leads others to what is seen.
    ///
    /// * `page`: the page's address without query and fragment.
    pub(super) fn link(&self, page: &str) -> String {
        // Only what the agent keeps can be asked for by name.
        let inspection = self.ui.read(|s| s.features.review.case.inspection.clone());
        self.permalink().address(page, Some(inspection.as_str()).filter(|inspection| !inspection.is_empty()))
    }

    /// Whether the person has moved the camera away from where it follows the model.
    pub(super) fn is_steered(&self) -> bool {
        !self.follows.get()
    }

    /// Has `done` done after each picture from now on. Set once.
    pub(super) fn after_drawing(&self, done: impl Fn() + 'static) {
        // Set once, when the page starts.
        let _ = self.after_drawing.set(Box::new(done));
    }

    /// Draws the picture of now as finely as can be, at once.
    pub(super) fn draw_finely(&self) {
        self.draw(Detail::WHOLE, true, None);
    }

    /// The canvas, while something draws on it.
    pub(super) fn canvas(&self) -> Option<HtmlCanvasElement> {
        self.graphics.canvas()
    }

    /// Picks what lies in the middle of the view.
    pub(super) fn pick_middle(&self) {
        self.click(self.camera.get().viewport() / 2.0);
    }

    /// The anchored elements are others.
    pub(super) fn place_anchors(&self) {
        self.probe_due.set(true);
        self.ticker.request();
    }

    fn click(&self, at: Vec2) {
        if self.ui.read(|s| s.features.section.reads()) {
            return self.ui.send_feature(SectionEvent::Clicked(self.ray(at)));
        }
        let collects = self.ui.read(|s| s.features.measure.kind.is_some() || s.features.correct.tool.is_some());
        self.picks.borrow_mut().click(at, collects);
        self.ticker.request();
    }

    /// The line of sight through a place of the camera's viewport.
    fn ray(&self, at: Vec2) -> Ray {
        let camera = self.camera.get();
        Ray { eye: camera.eye(), toward: camera.toward(at), pixel: 1.0 / camera.pixels_per_metre(1.0) }
    }

    /// A place on the canvas as it lies on the page, in the camera's viewport.
    fn in_viewport(&self, at: Vec2) -> Vec2 {
        self.graphics.canvas_size().map_or(at, |size| at / size * self.camera.get().viewport())
    }

    fn forget_hover(&self) {
        if self.ui.read(|s| s.features.inspect.hovered.is_some()) {
            self.ui.send_feature(InspectEvent::Hovered(None));
        }
    }

    /// Moves the camera as the person asks.
    pub(super) fn steer(&self, input: CameraInput) {
        self.follows.set(matches!(input, CameraInput::Fit | CameraInput::View(_)));
        let mut camera = self.camera.get();
        camera.apply(input, self.model.borrow().focus());
        self.camera.set(camera);
        self.steered.set(true);
        self.mouse.set(None);
        self.picks.borrow_mut().leave();
        self.forget_hover();
        self.redraw();
    }

    /// Moves the camera as a puck asks that was held so for some seconds.
    pub(super) fn follow_puck(&self, puck: Puck, seconds: f32) {
        for input in puck.inputs(seconds, self.size.get().height) {
            self.steer(input);
        }
    }

    /// The viewport has another size.
    pub(super) fn resize(&self, size: Size) {
        if self.size.replace(size) != size {
            let mut camera = self.camera.get();
            camera.set_viewport(size.width, size.height);
            camera.set_covered(size.covered);
            self.camera.set(camera);
            self.redraw();
        }
    }

    /// Puts the whole model into a renderer that has nothing yet.
    fn fill_renderer(&self) {
        self.graphics.fill(&self.model.borrow());
        self.painting.forget();
        self.drawn_photograph.set(None);
        self.layers.borrow_mut().forget();
        self.picks.borrow_mut().lost();
        self.redraw();
    }

    fn controllers(&self) -> &[Rc<dyn Controller>] {
        self.controllers.get().map_or(&[], Vec::as_slice)
    }

    fn frame(&self, now: f64) {
        if self.steered.take() {
            self.moved_at.set(now);
        }
        self.now.set(now);
        if self.figures_due.get() {
            if now - self.figures_at.get() >= FIGURES_MS {
                self.count();
            } else {
                self.ticker.request();
            }
        }
        if let Some(place) = self.aimed.take() {
            self.ui.send_feature(SectionEvent::Aimed(place.map(|at| self.ray(at))));
        }
        if let Some(seen) = self.graphics.picked() {
            self.answer(seen);
        }
        // A stroke is picked as fast as the hand draws; its picture follows a few times a second.
        let drawn_at = self.coarse_since.get().unwrap_or(f64::NEG_INFINITY);
        let waits = self.picks.borrow().is_drawing() && now - drawn_at < STROKE_PICTURE_MS;
        if waits && !self.graphics.is_busy() {
            self.pick(now, false);
            self.ticker.request();
            return;
        }
        if self.draw_due.get() && self.graphics.is_busy() {
            self.ticker.request();
            return;
        }
        let points = self.model.borrow().point_count();
        let moving = now - self.moved_at.get() < MOVING_MS;
        let mut moving_detail = self.moving_detail.get();
        let size = self.size.get();
        let pixels = (size.width * size.height * size.ratio * size.ratio) as usize;
        let detail = if moving { moving_detail.moving(now, points, pixels) } else { moving_detail.at_once(points) };
        if !moving {
            moving_detail.still();
        }
        // A sample of a fine picture costs as much as a pixel of a coarse one.
        let step = detail.points.map(|points| points / 2);
        self.moving_detail.set(moving_detail);
        if self.draw_due.replace(false) {
            self.draw(detail, false, None);
            self.coarse_since.set(Some(now));
            self.probe_due.set(true);
        }
        if moving {
            // Once it stands still the picture is drawn with every point.
            self.draw_due.set(self.draw_due.get() || detail != Detail::WHOLE);
            self.ticker.request();
        } else if let Some(since) = self.coarse_since.get() {
            if now - since >= STILL_MS && !self.graphics.is_busy() {
                self.coarse_since.set(None);
                self.draw(Detail::WHOLE, true, step);
            } else {
                self.ticker.request();
            }
        } else if self.graphics.is_unfinished() && !self.graphics.is_busy() {
            self.graphics.go_on(step);
            self.drawn(true);
        }
        if self.graphics.is_unfinished() {
            self.ticker.request();
        }
        self.pick(now, moving);
    }

    /// Puts the anchored elements to their places, and asks for the next pick.
    fn pick(&self, now: f64, moving: bool) {
        let anchors = anchors::place(&self.document, &self.camera.get());
        let is_still = !moving && !self.draw_due.get();
        if is_still && self.probe_due.replace(false) {
            self.picks.borrow_mut().probe(anchors.into_iter().map(|anchor| (anchor.name, anchor.at)));
        }
        match self.mouse.get() {
            Some((at, None)) => self.mouse.set(Some((at, Some(now)))),
            Some((at, Some(since))) if now - since >= REST_MS => {
                self.mouse.set(None);
                self.picks.borrow_mut().rest(at);
            }
            _ => {}
        }
        let mut picks = self.picks.borrow_mut();
        let may_pick =
            !self.graphics.is_busy() && !self.graphics.is_unfinished() && (!self.draw_due.get() || picks.is_drawing());
        let next = if may_pick { picks.next(is_still) } else { None };
        drop(picks);
        if let Some(at) = next {
            self.graphics.pick(at);
            if !self.graphics.is_picking() {
                // There is no picture.
                self.answer(Seen::Nothing);
            }
        }
        if self.mouse.get().is_some() || self.picks.borrow().is_busy() || self.probe_due.get() {
            self.ticker.request();
        }
    }

    /// Says to the tools what a pick found.
    fn answer(&self, seen: Seen) {
        let Some(wanted) = self.picks.borrow_mut().answered() else { return };
        let found = match seen {
            Seen::Changed => return self.ask_again(wanted),
            Seen::Nothing => None,
            Seen::Surface { of, place, distance } => {
                picked_point(&self.model.borrow(), &self.mesh.borrow(), of, place).map(|point| (point, distance))
            }
        };
        let point = found.map(|(point, _)| point);
        match wanted.purpose {
            Purpose::Click if self.ui.read(|s| s.features.correct.tool.is_some()) => {
                self.ui.send_feature(CorrectEvent::Dotted(point));
            }
            Purpose::Stroke(number) => {
                self.ui.send_feature(CorrectEvent::Drawn { number, point });
                self.redraw();
            }
            Purpose::Click if self.ui.read(|s| s.features.measure.kind.is_some()) => {
                self.ui.send_feature(MeasureEvent::Picked(point));
            }
            Purpose::Click => self.ui.send_feature(InspectEvent::Picked(point)),
            Purpose::Hover => self.ui.send_feature(InspectEvent::Hovered(point)),
            Purpose::Probe(name) => {
                let tolerance = PROBE_TOLERANCE * self.model.borrow().spacing();
                let seen_at = found.map(|(_, distance)| distance);
                anchors::probed(&self.document, &self.camera.get(), &name, seen_at, tolerance);
            }
        }
    }

    /// The model has changed under the pick: it is repeated with the next picture.
    fn ask_again(&self, wanted: Wanted) {
        self.picks.borrow_mut().again(wanted);
        self.redraw();
    }

    /// Draws a picture, or the first step of it, of so many points.
    fn draw(&self, detail: Detail, is_still: bool, step: Option<usize>) {
        let size = self.size.get();
        if size.width < 1.0 || size.height < 1.0 {
            return;
        }
        self.painting.bring(&self.graphics, &self.model.borrow(), &self.mesh.borrow());
        {
            let photograph = self.photograph.borrow();
            if self.drawn_photograph.replace(Some(photograph.revision())) != Some(photograph.revision()) {
                self.graphics.show_photograph(photograph.pixels());
            }
        }
        self.graphics.show_layers(&mut self.layers.borrow_mut());
        let (focus, bounds, voxel) = {
            let model = self.model.borrow();
            (model.focus(), model.bounds(), model.spacing())
        };
        let mut camera = self.camera.get();
        if let Some(focus) = focus.filter(|_| self.follows.get()) {
            // Each time: the viewport may have changed as well as the model.
            camera.fit(focus);
            self.camera.set(camera);
        }
        let content = self.ui.read(frame_content);
        let request = DrawRequest { camera, focus, bounds, voxel, point_budget: detail.points, is_still, content };
        let size = Size { ratio: size.ratio / detail.coarseness as f32, ..size };
        self.graphics.draw(&request, size, step);
        self.drawn(is_still);
    }

    /// Tells who waits for it that there is a picture, once it is whole.
    fn drawn(&self, is_still: bool) {
        if self.graphics.is_unfinished() {
            return;
        }
        canvas_data::write_drawing(&self.document, self.picks.borrow().is_drawing());
        self.controllers().iter().for_each(|controller| controller.drawn(is_still));
        if let Some(done) = self.after_drawing.get() {
            done();
        }
    }

    /// Counts the model's figures for the state.
    fn count(&self) {
        if self.figures_due.replace(false) {
            self.figures_at.set(self.now.get());
            let hidden = self.ui.read(|s| s.display.hidden_flags());
            let (classes, voxel, scales, hash) = {
                let model = self.model.borrow();
                (class_counts(&model, hidden), model.voxel().into(), model.share_scales(), model.hash())
            };
            canvas_data::write_hash(&self.document, hash);
            self.ui.send(Event::Figures { classes, voxel, scales, hash });
        }
    }
}

/// What calls `method` while there is a viewport.
fn call<T: 'static>(viewport: &Weak<Viewport>, method: impl Fn(&Viewport, T) + 'static) -> impl Fn(T) + 'static {
    let viewport = viewport.clone();
    move |value| {
        if let Some(viewport) = viewport.upgrade() {
            method(&viewport, value);
        }
    }
}
