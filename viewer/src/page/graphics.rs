//! Getting a renderer, feeding it, and getting another one when its device is lost. The panels do not depend on any of
//! it: without a renderer the page says why, and goes on.

use super::hooks;
use super::stage::{Size, Stage};
use crate::app::Event;
use crate::app::connection::Gpu;
use crate::model::{LiveModel, ModelChange};
use crate::render::{BackendChoice, DrawRequest, RenderError, Renderer};
use crate::tools::CameraPointer;
use leptos::prelude::Callable;
use semascan_model::SemanticMesh;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::HtmlCanvasElement;

/// Lost devices that are replaced in the life of a page; a device that keeps going away will not stay the next time.
const MOST_LOSSES: u32 = 3;

/// The renderer, if there is one, and the pointer on its canvas.
pub(super) struct Graphics {
    choice: BackendChoice,
    renderer: RefCell<Option<Renderer>>,
    pointer: RefCell<Option<CameraPointer>>,
    losses: Cell<u32>,
}

impl Graphics {
    pub(super) fn new(choice: BackendChoice) -> Self {
        Self { choice, renderer: RefCell::default(), pointer: RefCell::default(), losses: Cell::default() }
    }

    /// Starts to draw on the page's canvas.
    pub(super) fn open(stage: &Rc<Stage>, canvas: HtmlCanvasElement) {
        let stage = stage.clone();
        spawn_local(async move {
            let made = Renderer::new(canvas, stage.graphics.choice).await;
            Self::ready(&stage, made);
        });
    }

    /// The device is gone: its renderer is replaced, as long as that makes sense.
    pub(super) fn lost(stage: &Rc<Stage>, reason: String) {
        let graphics = &stage.graphics;
        let Some(renderer) = graphics.renderer.borrow_mut().take() else {
            return;
        };
        graphics.pointer.borrow_mut().take();
        graphics.losses.set(graphics.losses.get() + 1);
        if graphics.losses.get() > MOST_LOSSES {
            Self::unavailable(stage, format!("The graphics device was lost again and again: {reason}."));
            return;
        }
        web_sys::console::warn_1(&format!("semascan: graphics device lost: {reason}; opening another").into());
        stage.send.run(Event::Gpu(Gpu::Starting));
        let stage = stage.clone();
        spawn_local(async move {
            let made = renderer.rebuild(stage.graphics.choice).await;
            Self::ready(&stage, made);
        });
    }

    /// Brings the renderer level with a change of the model.
    pub(super) fn follow(&self, change: ModelChange, model: &LiveModel) {
        let mut renderer = self.renderer.borrow_mut();
        let Some(renderer) = renderer.as_mut() else {
            return;
        };
        match change {
            ModelChange::None => {}
            ModelChange::Cleared => renderer.clear(),
            ModelChange::Exchanged => {
                renderer.clear();
                for (id, chunk) in model.chunks() {
                    renderer.set_chunk(id, &chunk.cloud);
                }
            }
            ModelChange::Removed(id) => renderer.remove_chunk(id),
            ModelChange::Replaced(id) => {
                if let Some(chunk) = model.chunk(id) {
                    renderer.set_chunk(id, &chunk.cloud);
                }
            }
        }
    }

    /// Puts the whole model into the renderer.
    pub(super) fn fill(&self, model: &LiveModel) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.clear();
            for (id, chunk) in model.chunks() {
                renderer.set_chunk(id, &chunk.cloud);
            }
        }
    }

    /// Takes the mesh, with a deviation for each vertex if it was compared.
    pub(super) fn show_mesh(&self, mesh: Option<(&SemanticMesh, &[f32])>) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.set_mesh(mesh);
        }
    }

    /// Whether a frame would have to wait for earlier ones.
    pub(super) fn is_busy(&self) -> bool {
        self.renderer.borrow().as_ref().is_some_and(Renderer::is_busy)
    }

    /// Draws a frame; the reason if the device turns out to be lost. Without a renderer there is nothing to do.
    pub(super) fn draw(&self, request: &DrawRequest, size: Size) -> Option<String> {
        let mut renderer = self.renderer.borrow_mut();
        let renderer = renderer.as_mut()?;
        renderer.resize(size.width, size.height, size.ratio);
        renderer.draw(request).err().map(|error| error.to_string())
    }

    fn ready(stage: &Rc<Stage>, made: Result<Renderer, RenderError>) {
        let renderer = match made {
            Ok(renderer) => renderer,
            Err(error) => return Self::unavailable(stage, error.to_string()),
        };
        let steer = stage.clone();
        match CameraPointer::attach(renderer.canvas(), move |input| steer.steer(input)) {
            Ok(pointer) => drop(stage.graphics.pointer.borrow_mut().replace(pointer)),
            Err(error) => web_sys::console::error_1(&error),
        }
        let loser = Rc::downgrade(stage);
        renderer.on_lost(move |reason| {
            if let Some(stage) = loser.upgrade() {
                Self::lost(&stage, reason);
            }
        });
        let backend = renderer.backend().name().to_owned();
        stage.graphics.renderer.borrow_mut().replace(renderer);
        stage.send.run(Event::Gpu(Gpu::Ready { backend }));
        stage.fill_renderer();
    }

    fn unavailable(stage: &Rc<Stage>, reason: String) {
        web_sys::console::error_1(&JsValue::from_str(&format!("semascan: {reason}")));
        hooks::tell_no_backend(&stage.document);
        stage.send.run(Event::Gpu(Gpu::Unavailable { reason }));
    }
}
