//! Animation frames on demand: one is asked for only when something changed, so a still page costs nothing.

use std::cell::Cell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::Window;

/// Asks the browser for animation frames.
pub(super) struct Ticker {
    window: Window,
    pending: Rc<Cell<bool>>,
    callback: Closure<dyn FnMut(f64)>,
}

impl Ticker {
    /// `on_frame` gets the frame's time in milliseconds.
    pub(super) fn new(window: Window, mut on_frame: impl FnMut(f64) + 'static) -> Self {
        let pending = Rc::new(Cell::new(false));
        let flag = pending.clone();
        let callback = Closure::new(move |now: f64| {
            // First, so that a frame may ask for the next one.
            flag.set(false);
            on_frame(now);
        });
        Self { window, pending, callback }
    }

    /// Asks for one frame, unless one is under way already.
    pub(super) fn request(&self) {
        if !self.pending.replace(true) {
            let asked = self.window.request_animation_frame(self.callback.as_ref().unchecked_ref());
            self.pending.set(asked.is_ok());
        }
    }
}
