//! Getting a renderer, feeding it, and getting another one when its device is lost. The panels do not depend on any of
//! it: without a renderer the page says why, and goes on.

use super::canvas_data;
use crate::camera::{CameraPointer, PointerInput};
use crate::render::seen::Seen;
use crate::render::{BackendChoice, DrawRequest, RenderError, Renderer};
use crate::scene::photograph::Pixels;
use crate::scene::{HeldLayers, HeldModel, ModelChange};
use crate::state::Event;
use crate::state::connection::GraphicsStatus;
use crate::ui::Ui;
use glam::Vec2;
use semascan_model::{SemanticCloud, SemanticMesh};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::{Document, HtmlCanvasElement};

/// Lost devices that are replaced in the life of a page; a device that keeps going away will not stay the next time.
const MOST_LOSSES: u32 = 3;

/// Size of the viewport in CSS pixels, and device pixels in one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Size {
    pub(super) width: f32,
    pub(super) height: f32,
    pub(super) ratio: f32,
    /// Height of what lies over the upper edge.
    pub(super) covered: f32,
}

/// The renderer, if there is one, and the pointer on its canvas.
pub(super) struct Graphics {
    ui: Ui,
    document: Document,
    choice: BackendChoice,
    on_input: Box<dyn Fn(PointerInput)>,
    on_ready: Box<dyn Fn()>,
    renderer: RefCell<Option<Renderer>>,
    pointer: RefCell<Option<CameraPointer>>,
    losses: Cell<u32>,
}

impl Graphics {
    /// * `on_input`: takes what the pointer does.
    /// * `on_ready`: called when there is a renderer, which has nothing to draw yet.
    pub(super) fn new(
        ui: Ui,
        document: &Document,
        choice: BackendChoice,
        on_input: impl Fn(PointerInput) + 'static,
        on_ready: impl Fn() + 'static,
    ) -> Rc<Self> {
        Rc::new(Self {
            ui,
            document: document.clone(),
            choice,
            on_input: Box::new(on_input),
            on_ready: Box::new(on_ready),
            renderer: RefCell::default(),
            pointer: RefCell::default(),
            losses: Cell::default(),
        })
    }

    /// Starts to draw on the page's canvas.
    pub(super) fn open(self: &Rc<Self>, canvas: HtmlCanvasElement) {
        let this = self.clone();
        spawn_local(async move {
            let opened = Renderer::new(canvas, this.choice).await;
            this.take(opened);
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
            ModelChange::Exchanged => fill(renderer, model),
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
            fill(renderer, model);
        }
    }

    /// Takes what a chunk of the model shows.
    pub(super) fn show_chunk(&self, id: [i32; 3], cloud: &SemanticCloud) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.set_chunk(id, cloud);
        }
    }

    /// Takes the mesh, with a deviation for each vertex if it was compared.
    pub(super) fn show_mesh(&self, mesh: Option<(&SemanticMesh, &[f32])>) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.set_mesh(mesh);
        }
    }

    /// Takes the pixels of a photograph, or takes it away.
    pub(super) fn show_photograph(&self, pixels: Option<&Pixels>) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.set_photograph(pixels);
        }
    }

    /// Takes what is new of the photographs that colour the mesh.
    pub(super) fn show_layers(&self, layers: &mut HeldLayers) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.set_layer_size(layers.size());
            layers.take().iter().for_each(|upload| renderer.put_layer(upload));
        }
    }

    /// Whether a frame would have to wait for earlier ones.
    pub(super) fn is_busy(&self) -> bool {
        self.renderer.borrow().as_ref().is_some_and(Renderer::is_busy)
    }

    /// Asks what the last frame shows at `at` (CSS pixels from the viewport's top left corner).
    pub(super) fn pick(&self, at: Vec2) {
        if let Some(renderer) = self.renderer.borrow_mut().as_mut() {
            renderer.pick(at);
        }
    }

    /// The answer, once it is there.
    pub(super) fn picked(&self) -> Option<Seen> {
        self.renderer.borrow_mut().as_mut()?.picked()
    }

    /// Whether an answer is on its way.
    pub(super) fn is_picking(&self) -> bool {
        self.renderer.borrow().as_ref().is_some_and(Renderer::is_picking)
    }

    /// The canvas, while there is a renderer.
    pub(super) fn canvas(&self) -> Option<HtmlCanvasElement> {
        self.renderer.borrow().as_ref().map(|renderer| renderer.canvas().clone())
    }

    /// Size of the canvas on the page, CSS pixels: narrow pages show it lower than its place is.
    pub(super) fn canvas_size(&self) -> Option<Vec2> {
        let renderer = self.renderer.borrow();
        let canvas = renderer.as_ref()?.canvas();
        let size = Vec2::new(canvas.client_width() as f32, canvas.client_height() as f32);
        (size.min_element() >= 1.0).then_some(size)
    }

    /// Draws a frame, or the first step of it (see [`Renderer::draw`]); a renderer whose device turns out to be lost is replaced.
    /// Without one there is nothing to do.
    pub(super) fn draw(self: &Rc<Self>, request: &DrawRequest, size: Size, most: Option<usize>) {
        let drawn = self.renderer.borrow_mut().as_mut().map(|renderer| {
            renderer.resize(size.width, size.height, size.ratio);
            renderer.draw(request, most)
        });
        if let Some(Err(error)) = drawn {
            self.replace_lost(&error.to_string());
        }
    }

    /// Goes on with a frame that is drawn step by step.
    pub(super) fn go_on(self: &Rc<Self>, most: Option<usize>) {
        let drawn = self.renderer.borrow_mut().as_mut().map(|renderer| renderer.go_on(most));
        if let Some(Err(error)) = drawn {
            self.replace_lost(&error.to_string());
        }
    }

    /// Whether a frame is being drawn step by step.
    pub(super) fn is_unfinished(&self) -> bool {
        self.renderer.borrow().as_ref().is_some_and(Renderer::is_unfinished)
    }

    /// The device is gone: its renderer is replaced, as long as that makes sense.
    fn replace_lost(self: &Rc<Self>, reason: &str) {
        let Some(renderer) = self.renderer.borrow_mut().take() else {
            return;
        };
        self.pointer.borrow_mut().take();
        self.losses.set(self.losses.get() + 1);
        if self.losses.get() > MOST_LOSSES {
            return self.unavailable(&RenderError::Lost(reason.to_owned()));
        }
        web_sys::console::warn_1(&format!("semascan: graphics device lost: {reason}; opening another").into());
        self.ui.send(Event::Graphics(GraphicsStatus::Starting));
        let this = self.clone();
        spawn_local(async move {
            let opened = renderer.rebuild(this.choice).await;
            this.take(opened);
        });
    }

    fn take(self: &Rc<Self>, opened: Result<Renderer, RenderError>) {
        let renderer = match opened {
            Ok(renderer) => renderer,
            Err(error) => return self.unavailable(&error),
        };
        let this = self.clone();
        match CameraPointer::attach(renderer.canvas(), move |input| (this.on_input)(input)) {
            Ok(pointer) => drop(self.pointer.borrow_mut().replace(pointer)),
            Err(error) => web_sys::console::error_1(&error),
        }
        let this = Rc::downgrade(self);
        renderer.on_lost(move |reason| {
            if let Some(graphics) = this.upgrade() {
                graphics.replace_lost(&reason);
            }
        });
        let backend = renderer.backend().name().to_owned();
        self.renderer.borrow_mut().replace(renderer);
        self.ui.send(Event::Graphics(GraphicsStatus::Ready { backend }));
        (self.on_ready)();
    }

    /// Says what a person can do; what the interfaces said goes to the console.
    fn unavailable(&self, error: &RenderError) {
        web_sys::console::error_1(&JsValue::from_str(&format!("semascan: {error}")));
        let reason = error.advice().to_owned();
        canvas_data::write_no_backend(&self.document);
        self.ui.send(Event::Graphics(GraphicsStatus::Unavailable { reason }));
    }
}

fn fill(renderer: &mut Renderer, model: &HeldModel) {
    renderer.clear();
    for (id, chunk) in model.chunks() {
        renderer.set_chunk(id, &chunk.cloud);
    }
}
