//! The 3D view: model, mesh, camera and renderer; draws a frame when one is due, and no other.

use super::canvas_data;
use super::graphics::{Graphics, Size};
use super::point_budget::PointBudget;
use super::ticker::Ticker;
use crate::camera::{CameraInput, OrbitCamera};
use crate::features::view::{Controller, Host};
use crate::features::{FeatureEvent, mounted};
use crate::link::LinkEvent;
use crate::mesh_worker::MeshWorker;
use crate::render::{BackendChoice, DrawRequest};
use crate::scene::figures::class_counts;
use crate::scene::frame_content::frame_content;
use crate::scene::{HeldMesh, HeldModel, ModelChange};
use crate::state::Event;
use crate::ui::Ui;
use semascan_protocol::server_message::Body;
use std::cell::{Cell, OnceCell, RefCell};
use std::rc::{Rc, Weak};
use web_sys::{Document, HtmlCanvasElement, Window};

/// Least time between two counts of the model's figures while it grows, milliseconds.
const FIGURES_MS: f64 = 200.0;
/// The camera counts as moving until so long after the last input, milliseconds.
const MOVING_MS: f64 = 180.0;

/// What is seen and from where.
pub(super) struct Viewport {
    pub(super) ui: Ui,
    pub(super) document: Document,
    graphics: Rc<Graphics>,
    pub(super) model: Rc<RefCell<HeldModel>>,
    pub(super) mesh: Rc<RefCell<HeldMesh>>,
    controllers: OnceCell<Vec<Rc<dyn Controller>>>,
    camera: Cell<OrbitCamera>,
    /// The camera keeps the whole model in view until the person moves it.
    follows: Cell<bool>,
    size: Cell<Size>,
    point_budget: Cell<PointBudget>,
    /// The person moved the camera since the last frame.
    steered: Cell<bool>,
    /// Time of the last frame, and of the last one that followed an input, in the clock of animation frames.
    now: Cell<f64>,
    moved_at: Cell<f64>,
    draw_due: Cell<bool>,
    /// Revision of the mesh that the renderer has; `None` with a new renderer.
    drawn_mesh: Cell<Option<u64>>,
    figures_due: Cell<bool>,
    figures_at: Cell<f64>,
    ticker: Ticker,
}

impl Viewport {
    pub(super) fn new(ui: Ui, window: &Window, document: &Document, choice: BackendChoice) -> Rc<Self> {
        let viewport = Rc::new_cyclic(|weak: &Weak<Self>| {
            let on_frame = call(weak, Self::frame);
            let on_input = call(weak, Self::steer);
            let on_ready = call(weak, |viewport, ()| viewport.fill_renderer());
            Self {
                ui,
                document: document.clone(),
                graphics: Graphics::new(ui, document, choice, on_input, move || on_ready(())),
                model: Rc::default(),
                mesh: Rc::default(),
                controllers: OnceCell::new(),
                camera: Cell::default(),
                follows: Cell::new(true),
                size: Cell::default(),
                point_budget: Cell::default(),
                steered: Cell::default(),
                now: Cell::default(),
                moved_at: Cell::new(f64::NEG_INFINITY),
                draw_due: Cell::new(true),
                drawn_mesh: Cell::default(),
                figures_due: Cell::new(false),
                figures_at: Cell::new(f64::NEG_INFINITY),
                ticker: Ticker::new(window.clone(), on_frame),
            }
        });
        let redraw = call(&Rc::downgrade(&viewport), |viewport, ()| viewport.redraw());
        let host = Host {
            ui,
            model: viewport.model.clone(),
            mesh: viewport.mesh.clone(),
            mesh_worker: Rc::new(MeshWorker::default()),
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
            self.controllers().iter().for_each(|controller| controller.model_changed(change));
            self.figures_due.set(true);
            self.redraw();
        }
        if let LinkEvent::Connected { inspection, .. } | LinkEvent::Cleared(inspection) = &event
            && self.ui.read(|s| s.inspection.id != inspection.id)
        {
            self.follows.set(true);
        }
        // Every chunk of a final model is sent before the message that it is final: that message finds the figures counted.
        if matches!(event, LinkEvent::Message(Body::Progress(_))) {
            self.count();
        }
        // Chunks concern the model alone.
        if !event.is_bulk() {
            self.ui.send(Event::from(event));
        }
        if matches!(change, ModelChange::Cleared | ModelChange::Exchanged) {
            self.count();
        }
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

    /// Moves the camera as the person asks.
    pub(super) fn steer(&self, input: CameraInput) {
        self.follows.set(matches!(input, CameraInput::Fit | CameraInput::View(_)));
        let mut camera = self.camera.get();
        camera.apply(input, self.model.borrow().focus());
        self.camera.set(camera);
        self.steered.set(true);
        self.redraw();
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
        self.drawn_mesh.set(None);
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
        if self.draw_due.get() && self.graphics.is_busy() {
            self.ticker.request();
            return;
        }
        let points = self.model.borrow().point_count();
        let moving = now - self.moved_at.get() < MOVING_MS;
        let mut point_budget = self.point_budget.get();
        let budget = if moving { point_budget.moving(now, points) } else { None };
        if !moving {
            point_budget.still();
        }
        self.point_budget.set(point_budget);
        if self.draw_due.replace(false) {
            self.draw(budget);
        }
        if moving {
            // Once it stands still the picture is drawn with every point.
            self.draw_due.set(self.draw_due.get() || budget.is_some());
            self.ticker.request();
        }
    }

    fn draw(&self, point_budget: Option<usize>) {
        let size = self.size.get();
        if size.width < 1.0 || size.height < 1.0 {
            return;
        }
        {
            let mesh = self.mesh.borrow();
            if self.drawn_mesh.replace(Some(mesh.revision())) != Some(mesh.revision()) {
                self.graphics.show_mesh(mesh.mesh().map(|m| (m.as_ref(), mesh.deviations())));
            }
        }
        let (focus, bounds, voxel) = {
            let model = self.model.borrow();
            (model.focus(), model.bounds(), model.voxel())
        };
        let mut camera = self.camera.get();
        if let Some(focus) = focus.filter(|_| self.follows.get()) {
            // Each time: the viewport may have changed as well as the model.
            camera.fit(focus);
            self.camera.set(camera);
        }
        let content = self.ui.read(frame_content);
        self.graphics.draw(&DrawRequest { camera, focus, bounds, voxel, point_budget, content }, size);
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
