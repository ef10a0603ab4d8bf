//! This page as a pane of a page that shows several (`www/compare.html`): all look from the same place and show the same colours and
//! cuts. Each pane tells the page around it what it shows, as the fragment of a link, and follows what that page tells it.

use super::permalink::Permalink;
use super::viewport::Viewport;
use js_sys::{Object, Reflect};
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{MessageEvent, UrlSearchParams, Window};

/// Joins the panes of the page around this one; nothing where there is none.
///
/// # Errors
/// What the browser says.
pub(super) fn join(window: &Window, viewport: &Rc<Viewport>) -> Result<(), JsValue> {
    let Some(around) = window.parent()?.filter(|around| around != window) else { return Ok(()) };
    let origin = window.location().origin()?;
    // What the page around knows of this one.
    let known = Rc::new(RefCell::new(String::new()));

    let (told, weak, to) = (known.clone(), Rc::downgrade(viewport), origin.clone());
    viewport.after_drawing(move || {
        let Some(viewport) = weak.upgrade() else { return };
        let shown = shown(&viewport);
        if *told.borrow() != shown {
            let message = Object::new();
            let said = [("view", JsValue::from(&shown)), ("steered", viewport.is_steered().into())];
            // Fails for frozen objects only.
            said.iter().for_each(|(name, value)| drop(Reflect::set(&message, &JsValue::from_str(name), value)));
            if let Err(error) = around.post_message(&message, &to) {
                web_sys::console::error_1(&error);
            }
            told.replace(shown);
        }
    });

    let viewport = viewport.clone();
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
        if message.origin() != origin {
            return;
        }
        let view = Reflect::get(&message.data(), &"view".into()).ok().and_then(|view| view.as_string());
        if let Some(view) = view.filter(|view| *view != shown(&viewport)) {
            follow(&viewport, &view);
            known.replace(shown(&viewport));
        }
    });
    window.add_event_listener_with_callback("message", on_message.as_ref().unchecked_ref())?;
    // It lives as long as the page.
    on_message.forget();
    Ok(())
}

/// What is seen, as the fragment of a link. A finding is of one inspection alone.
fn shown(viewport: &Viewport) -> String {
    Permalink { finding: None, ..viewport.permalink() }.address("", None)
}

fn follow(viewport: &Viewport, view: &str) {
    let Ok(parameters) = UrlSearchParams::new_with_str(view.trim_start_matches('#')) else { return };
    // Another pane wrote it.
    let link = Permalink::read(|name| parameters.get(name), &mut Vec::new());
    viewport.follow_link(&Permalink { finding: None, ..link });
}
