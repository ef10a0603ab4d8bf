//! DOM pointer and wheel events of the canvas, as drags, inputs for the camera, clicks, and where a mouse rests.
//!
//! Pointer events cover mouse, touch and pen alike. The pointer is captured while it is down, so a drag may leave the
//! canvas. The wheel listener is not passive: zooming must not scroll the page.

use super::{Button, CameraInput, Gesture, PointerInput};
use glam::Vec2;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{AddEventListenerOptions, HtmlCanvasElement, MouseEvent, PointerEvent, WheelEvent};

/// Pixels that the wheel's "lines" and "pages" stand for.
const LINE: f64 = 33.0;
const PAGE: f64 = 400.0;

/// What is called for an event.
type Listener = Closure<dyn FnMut(JsValue)>;

/// Listens on a canvas until it is dropped.
pub struct CameraPointer {
    canvas: HtmlCanvasElement,
    listeners: Vec<(&'static str, Listener)>,
}

impl CameraPointer {
    /// Starts to listen. Call it again for the new canvas when the renderer has replaced it.
    ///
    /// # Errors
    /// What the browser says when a listener cannot be added.
    pub fn attach(canvas: &HtmlCanvasElement, on_input: impl FnMut(PointerInput) + 'static) -> Result<Self, JsValue> {
        let gesture = Rc::new(RefCell::new(Gesture::default()));
        let on_input = Rc::new(RefCell::new(on_input));
        canvas.style().set_property("touch-action", "none")?;
        let mut pointer = Self { canvas: canvas.clone(), listeners: Vec::new() };

        let (state, element) = (gesture.clone(), canvas.clone());
        pointer.listen("pointerdown", move |event| {
            let event: PointerEvent = event.unchecked_into();
            let button = if event.button() == 0 && !event.shift_key() { Button::Primary } else { Button::Secondary };
            // Capture fails if the pointer is already gone; the drag then simply ends at the edge.
            let _ = element.set_pointer_capture(event.pointer_id());
            state.borrow_mut().down(event.pointer_id(), button, position(&event));
        })?;
        let (state, sink) = (gesture.clone(), on_input.clone());
        pointer.listen("pointermove", move |event| {
            let event: PointerEvent = event.unchecked_into();
            if event.buttons() == 0 && event.pointer_type() == "mouse" {
                (sink.borrow_mut())(PointerInput::Hover(Some(position(&event))));
            }
            let inputs = state.borrow_mut().moved(event.pointer_id(), position(&event));
            for input in inputs {
                (sink.borrow_mut())(input);
            }
        })?;
        let (state, sink) = (gesture.clone(), on_input.clone());
        pointer.listen("pointerup", move |event| {
            let event: PointerEvent = event.unchecked_into();
            let input = state.borrow_mut().up(event.pointer_id());
            if let Some(input) = input {
                (sink.borrow_mut())(input);
            }
        })?;
        let (state, sink) = (gesture.clone(), on_input.clone());
        pointer.listen("pointercancel", move |event| {
            let event: PointerEvent = event.unchecked_into();
            // What the browser takes over was no click.
            if state.borrow_mut().up(event.pointer_id()).is_some() {
                (sink.borrow_mut())(PointerInput::Lift);
            }
        })?;
        let sink = on_input.clone();
        pointer.listen("pointerleave", move |_| (sink.borrow_mut())(PointerInput::Hover(None)))?;
        let sink = on_input.clone();
        pointer.listen("wheel", move |event| {
            let event: WheelEvent = event.unchecked_into();
            event.prevent_default();
            let pixels = match event.delta_mode() {
                WheelEvent::DOM_DELTA_LINE => event.delta_y() * LINE,
                WheelEvent::DOM_DELTA_PAGE => event.delta_y() * PAGE,
                _ => event.delta_y(),
            };
            (sink.borrow_mut())(PointerInput::Camera(Gesture::wheel(pixels as f32, position(&event))));
        })?;
        let sink = on_input;
        pointer.listen("dblclick", move |_| (sink.borrow_mut())(PointerInput::Camera(CameraInput::Fit)))?;
        // The right button pans.
        pointer.listen("contextmenu", |event| event.unchecked_into::<MouseEvent>().prevent_default())?;
        Ok(pointer)
    }

    fn listen(&mut self, name: &'static str, handler: impl FnMut(JsValue) + 'static) -> Result<(), JsValue> {
        let closure = Listener::new(handler);
        let options = AddEventListenerOptions::new();
        options.set_passive(false);
        let function = closure.as_ref().unchecked_ref();
        self.canvas.add_event_listener_with_callback_and_add_event_listener_options(name, function, &options)?;
        self.listeners.push((name, closure));
        Ok(())
    }
}

impl Drop for CameraPointer {
    fn drop(&mut self) {
        for (name, closure) in &self.listeners {
            // The canvas may be gone from the page; nothing is left to do then.
            let _ = self.canvas.remove_event_listener_with_callback(name, closure.as_ref().unchecked_ref());
        }
    }
}

fn position(event: &MouseEvent) -> Vec2 {
    Vec2::new(event.offset_x() as f32, event.offset_y() as f32)
}
