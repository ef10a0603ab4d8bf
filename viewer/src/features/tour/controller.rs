//! Marks the place that a step speaks of, and remembers who has been here.

use super::TourEvent;
use crate::features::FeatureEvent;
use crate::features::view::{Controller, Host};
use crate::ui::storage;
use leptos::prelude::{Effect, Get};
use std::rc::Rc;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement};

/// Where it is kept that the tour was offered and taken, or not wanted.
const TOUR_KEY: &str = "semascan.tour";
/// Attribute of the place that is spoken of; the style sheet marks it.
const MARK: &str = "data-toured";

pub(super) struct TourController {
    host: Host,
}

impl TourController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new(Self { host: host.clone() })
    }
}

impl Controller for TourController {
    fn begin(&self) {
        let ui = self.host.ui;
        // Where the browser keeps nothing it would be offered for ever.
        let is_new = storage().is_some_and(|storage| matches!(storage.get_item(TOUR_KEY), Ok(None)));
        if is_new {
            ui.send_feature(TourEvent::Offered);
        }
        let shown = ui.part(|s| s.features.tour.shown());
        Effect::new(move |before: Option<bool>| {
            let step = shown.get();
            mark(step.map(|step| step.place));
            // The keyboard is where the tour is, from its first step on.
            if step.is_some() && before != Some(true) {
                leptos::prelude::request_animation_frame(focus);
            }
            step.is_some()
        });
    }

    fn handle(&self, event: &FeatureEvent) {
        if let (FeatureEvent::Tour(TourEvent::Begin | TourEvent::End), Some(storage)) = (event, storage()) {
            // Who is not remembered is offered it again.
            let _ = storage.set_item(TOUR_KEY, "seen");
        }
    }
}

/// Marks the place that is spoken of, and no other.
fn mark(place: Option<&str>) {
    let Some(document) = web_sys::window().and_then(|window| window.document()) else { return };
    if let Ok(Some(marked)) = document.query_selector(&format!("[{MARK}]")) {
        let _ = marked.remove_attribute(MARK);
    }
    // The first of the places that there is.
    let found = place
        .into_iter()
        .flat_map(|place| place.split(", "))
        .find_map(|one| document.query_selector(one).ok().flatten());
    if let Some(element) = found {
        let _ = element.set_attribute(MARK, "");
        Element::scroll_into_view_with_bool(&element, false);
    }
}

fn focus() {
    let document = web_sys::window().and_then(|window| window.document());
    let button = document.and_then(|document| document.query_selector("[data-testid=tour-next]").ok().flatten());
    if let Some(button) = button.and_then(|button| button.dyn_into::<HtmlElement>().ok()) {
        // Fails for what cannot have the focus.
        let _ = button.focus();
    }
}
