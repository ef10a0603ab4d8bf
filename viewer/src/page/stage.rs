//! Model, camera and renderer; draws a frame when one is due, and no other.

use super::figures::{app_event, class_figures};
use super::graphics::Graphics;
use super::hooks;
use super::mesh_of_model::MeshOfModel;
use super::pace::Pace;
use super::scene::{Scene, hidden_flags};
use super::ticker::Ticker;
use crate::app::{AppState, Event};
use crate::link::LinkEvent;
use crate::model::{LiveModel, ModelChange};
use crate::render::{BackendChoice, DrawRequest};
use crate::tools::{CameraInput, OrbitCamera};
use leptos::prelude::*;
use semascan_model::SemanticCloud;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use web_sys::{Document, Window};

/// Least time between two counts of the model's figures while it grows, milliseconds.
const FIGURES_MS: f64 = 200.0;
/// The camera counts as moving until so long after the last input, milliseconds.
const MOVING_MS: f64 = 180.0;

/// Size of the viewport in CSS pixels, and device pixels in one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Size {
    pub(super) width: f32,
    pub(super) height: f32,
    pub(super) ratio: f32,
}

/// What is seen and from where.
pub(super) struct Stage {
    pub(super) state: RwSignal<AppState>,
    pub(super) send: Callback<Event>,
    pub(super) document: Document,
    pub(super) graphics: Graphics,
    pub(super) model: RefCell<LiveModel>,
    pub(super) mesh: MeshOfModel,
    camera: Cell<OrbitCamera>,
    /// The camera keeps the whole model in view until the person moves it.
    follows: Cell<bool>,
    size: Cell<Size>,
    pace: Cell<Pace>,
    /// The person moved the camera since the last frame.
    steered: Cell<bool>,
    /// Time of the last frame, and of the last one that followed an input, in the clock of animation frames.
    now: Cell<f64>,
    moved_at: Cell<f64>,
    draw_due: Cell<bool>,
    figures_due: Cell<bool>,
    figures_at: Cell<f64>,
    ticker: Ticker,
}

impl Stage {
    pub(super) fn new(
        state: RwSignal<AppState>,
        window: &Window,
        document: &Document,
        choice: BackendChoice,
    ) -> Rc<Self> {
        Rc::new_cyclic(|weak: &std::rc::Weak<Self>| {
            let this = weak.clone();
            let ticker = Ticker::new(window.clone(), move |now| {
                if let Some(stage) = this.upgrade() {
                    stage.frame(now);
                }
            });
            Self {
                state,
                send: Callback::new(move |event: Event| state.update(|s| s.reduce(event))),
                document: document.clone(),
                graphics: Graphics::new(choice),
                model: RefCell::default(),
                mesh: MeshOfModel::default(),
                camera: Cell::default(),
                follows: Cell::new(true),
                size: Cell::default(),
                pace: Cell::default(),
                steered: Cell::default(),
                now: Cell::default(),
                moved_at: Cell::new(f64::NEG_INFINITY),
                draw_due: Cell::new(true),
                figures_due: Cell::new(false),
                figures_at: Cell::new(f64::NEG_INFINITY),
                ticker,
            }
        })
    }

    /// Follows one event of the link: model, picture and state.
    pub(super) fn hear(&self, event: LinkEvent) {
        let change = self.model.borrow_mut().apply(&event);
        if change != ModelChange::None {
            self.graphics.follow(change, &self.model.borrow());
            self.mesh.follow(self, change);
            self.figures_due.set(true);
            self.redraw();
        }
        if let LinkEvent::Connected { inspection, .. } | LinkEvent::Cleared(inspection) = &event
            && self.state.with_untracked(|s| s.inspection.id != inspection.id)
        {
            self.follows.set(true);
        }
        // Every chunk of a final model is sent before the word that it is final: that word finds the figures counted.
        if matches!(event, LinkEvent::Progress(_)) {
            self.count();
        }
        let emptied = matches!(change, ModelChange::Cleared | ModelChange::Exchanged);
        if let Some(event) = app_event(event) {
            self.send.run(event);
        }
        if emptied {
            self.count();
        }
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

    /// Follows the person's hand.
    pub(super) fn steer(&self, input: CameraInput) {
        self.follows.set(matches!(input, CameraInput::Fit | CameraInput::View(_)));
        let mut camera = self.camera.get();
        camera.apply(input, self.model.borrow().bounds());
        self.camera.set(camera);
        self.steered.set(true);
        self.redraw();
    }

    /// The viewport has another size.
    pub(super) fn resize(&self, size: Size) {
        if self.size.replace(size) != size {
            let mut camera = self.camera.get();
            camera.set_viewport(size.width, size.height);
            self.camera.set(camera);
            self.redraw();
        }
    }

    /// Every point of the model, for exports.
    pub(super) fn cloud(&self) -> SemanticCloud {
        self.model.borrow().to_cloud()
    }

    /// Puts the whole model into a renderer that has nothing yet.
    pub(super) fn fill_renderer(&self) {
        self.graphics.fill(&self.model.borrow());
        self.mesh.show(self);
    }

    fn frame(self: &Rc<Self>, now: f64) {
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
        let mut pace = self.pace.get();
        let budget = if moving { pace.moving(now, points) } else { None };
        if !moving {
            pace.still();
        }
        self.pace.set(pace);
        if self.draw_due.replace(false) {
            self.draw(budget);
        }
        if moving {
            // Once it stands still the picture is drawn with every point.
            self.draw_due.set(self.draw_due.get() || budget.is_some());
            self.ticker.request();
        }
    }

    fn draw(self: &Rc<Self>, budget: Option<usize>) {
        let size = self.size.get();
        if size.width < 1.0 || size.height < 1.0 {
            return;
        }
        let bounds = self.model.borrow().bounds();
        let mut camera = self.camera.get();
        if let Some(bounds) = bounds.filter(|_| self.follows.get()) {
            // Each time: the viewport may have changed as well as the model.
            camera.fit(bounds);
            self.camera.set(camera);
        }
        let mut request = DrawRequest {
            camera,
            bounds,
            voxel: self.model.borrow().voxel(),
            point_budget: budget,
            ..DrawRequest::default()
        };
        self.state.with_untracked(|s| Scene::of(s).fill(&mut request));
        if let Some(reason) = self.graphics.draw(&request, size) {
            Graphics::lost(self, reason);
        }
    }

    /// Counts the model's figures and tells them.
    fn count(&self) {
        if self.figures_due.replace(false) {
            self.figures_at.set(self.now.get());
            let hidden = self.state.with_untracked(hidden_flags);
            let (classes, voxel, hash) = {
                let model = self.model.borrow();
                (class_figures(&model, hidden), model.voxel().into(), model.hash())
            };
            hooks::tell_hash(&self.document, hash);
            self.send.run(Event::Figures { classes, voxel, hash });
        }
    }
}
