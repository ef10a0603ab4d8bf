//! Getting a renderer, feeding it, and getting another one when its device is lost. The panels do not depend on any of
//! it: without a renderer the page says why, and goes on.

use super::test_hooks;
use super::viewport::{Size, Viewport};
use crate::camera::CameraPointer;
use crate::render::{BackendChoice, DrawRequest, RenderError, Renderer};
use crate::scene::{HeldModel, ModelChange};
use crate::state::Event;
use crate::state::connection::GraphicsStatus;
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
    pub(super) fn open(viewport: &Rc<Viewport>, canvas: HtmlCanvasElement) {
        let viewport = viewport.clone();
        spawn_local(async move {
            let made = Renderer::new(canvas, viewport.graphics.choice).await;
            Self::ready(&viewport, made);
        });
    }

    /// The device is gone: its renderer is replaced, as long as that makes sense.
    pub(super) fn replace_lost(viewport: &Rc<Viewport>, reason: String) {
        let graphics = &viewport.graphics;
        let Some(renderer) = graphics.renderer.borrow_mut().take() else {
            return;
        };
        graphics.pointer.borrow_mut().take();
        graphics.losses.set(graphics.losses.get() + 1);
        if graphics.losses.get() > MOST_LOSSES {
            Self::unavailable(viewport, format!("The graphics device was lost again and again: {reason}."));
            return;
        }
        web_sys::console::warn_1(&format!("semascan: graphics device lost: {reason}; opening another").into());
        viewport.ui.send(Event::Graphics(GraphicsStatus::Starting));
        let viewport = viewport.clone();
        spawn_local(async move {
            let made = renderer.rebuild(viewport.graphics.choice).await;
            Self::ready(&viewport, made);
        });
    }

    /// Brings the renderer level with a change of the model.
    pub(super) fn follow(&self, change: ModelChange, model: &HeldModel) {
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
    pub(super) fn fill(&self, model: &HeldModel) {
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

    fn ready(viewport: &Rc<Viewport>, made: Result<Renderer, RenderError>) {
        let renderer = match made {
            Ok(renderer) => renderer,
            Err(error) => return Self::unavailable(viewport, error.to_string()),
        };
        let steered = viewport.clone();
        match CameraPointer::attach(renderer.canvas(), move |input| steered.steer(input)) {
            Ok(pointer) => drop(viewport.graphics.pointer.borrow_mut().replace(pointer)),
            Err(error) => web_sys::console::error_1(&error),
        }
        let lost = Rc::downgrade(viewport);
        renderer.on_lost(move |reason| {
            if let Some(viewport) = lost.upgrade() {
                Self::replace_lost(&viewport, reason);
            }
        });
        let backend = renderer.backend().name().to_owned();
        viewport.graphics.renderer.borrow_mut().replace(renderer);
        viewport.ui.send(Event::Graphics(GraphicsStatus::Ready { backend }));
        viewport.fill_renderer();
    }

    fn unavailable(viewport: &Rc<Viewport>, reason: String) {
        web_sys::console::error_1(&JsValue::from_str(&format!("semascan: {reason}")));
        test_hooks::write_no_backend(&viewport.document);
        viewport.ui.send(Event::Graphics(GraphicsStatus::Unavailable { reason }));
    }
}
