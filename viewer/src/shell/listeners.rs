//! What the page listens to besides the link and the pointer: keyboard, size, the system's theme, the clock; and what
//! the page's frame shows of the state: theme and title. Everything lives as long as the page.

use super::graphics::Size;
use super::permalink::Permalink;
use super::shortcuts::{Focus, action};
use super::viewport::Viewport;
use crate::camera::Modifiers;
use crate::display::{ColorMode, Theme};
use crate::features::measure::{Measure, MeasureEvent};
use crate::state::notices::{Level, Topic};
use crate::state::{AppState, Event};
use crate::ui::Ui;
use leptos::prelude::*;
use semascan_model::LengthUnit;
use std::rc::Rc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use web_sys::{
    Document, Element, HtmlElement, HtmlInputElement, KeyboardEvent, MediaQueryListEvent, ResizeObserver,
    UrlSearchParams, Window,
};

/// Where the chosen theme is kept; `www/theme.js` reads it before the first paint.
const THEME_KEY: &str = "semascan.theme";
/// Where the chosen meaning of colours is kept.
const COLOR_KEY: &str = "semascan.color-mode";
/// And the unit of lengths.
const UNIT_KEY: &str = "semascan.length-unit";
/// Step of the clock while something counts down, milliseconds.
const CLOCK_MS: u32 = 250;
/// Finer pictures cost more than they show.
const MOST_RATIO: f64 = 2.0;

/// Keys do what [`action`] says.
pub(super) fn keyboard(window: &Window, viewport: &Rc<Viewport>) -> Result<(), JsValue> {
    let viewport = viewport.clone();
    let on_key = Closure::<dyn FnMut(KeyboardEvent)>::new(move |event: KeyboardEvent| {
        let command = event.ctrl_key() || event.alt_key() || event.meta_key();
        let modifiers = Modifiers { shift: event.shift_key(), command };
        let focus = focus(&viewport.document);
        let found = viewport.ui.read(|s| action(&event.key(), modifiers, focus, s));
        if let Some(found) = found {
            event.prevent_default();
            found.perform(viewport.ui);
        }
    });
    window.add_event_listener_with_callback("keydown", on_key.as_ref().unchecked_ref())?;
    on_key.forget();
    Ok(())
}

/// Whether a person writes into an element.
fn is_text(element: &Element) -> bool {
    let is_field = element.dyn_ref::<HtmlInputElement>().is_some_and(|input| {
        matches!(input.type_().as_str(), "text" | "search" | "number" | "email" | "url" | "tel" | "password")
    });
    is_field || element.tag_name() == "TEXTAREA"
}

fn focus(document: &Document) -> Focus {
    match document.active_element() {
        Some(element) if is_text(&element) => Focus::Text,
        Some(element) if !matches!(element.tag_name().as_str(), "BODY" | "CANVAS") => Focus::Control,
        _ => Focus::Model,
    }
}

/// The picture follows the size of its place on the page.
pub(super) fn size(window: &Window, viewport: &Rc<Viewport>, place: Element) -> Result<(), JsValue> {
    let (window, viewport, element) = (window.clone(), viewport.clone(), place.clone());
    let measure = move || {
        let ratio = window.device_pixel_ratio().min(MOST_RATIO) as f32;
        let covered = covered_height(&element).unwrap_or(0.0);
        viewport.resize(Size {
            width: element.client_width() as f32,
            height: element.client_height() as f32,
            ratio,
            covered,
        });
    };
    measure();
    let on_size = Closure::<dyn FnMut(JsValue)>::new(move |_| measure());
    ResizeObserver::new(on_size.as_ref().unchecked_ref())?.observe(&place);
    on_size.forget();
    Ok(())
}

/// Height of what lies over the upper edge of the 3D view, CSS pixels of the view; `None` where nothing does.
fn covered_height(place: &Element) -> Option<f32> {
    let overlay = place.query_selector("#overlay").ok()??;
    let bar = overlay.query_selector(".overlay-top").ok()??.dyn_into::<HtmlElement>().ok()?;
    // On large pages the overlay has pixels of its own.
    let enlarged = place.client_height() as f32 / overlay.client_height().max(1) as f32;
    Some((bar.offset_top() + bar.offset_height()) as f32 * enlarged)
}

/// The system's preference for dark pages, now and when it changes.
pub(super) fn system_theme(window: &Window, ui: Ui) -> Result<(), JsValue> {
    let Some(query) = window.match_media("(prefers-color-scheme: dark)")? else {
        return Ok(());
    };
    ui.send(Event::SystemDark(query.matches()));
    let on_change = Closure::<dyn FnMut(MediaQueryListEvent)>::new(move |e: MediaQueryListEvent| {
        ui.send(Event::SystemDark(e.matches()));
    });
    query.add_event_listener_with_callback("change", on_change.as_ref().unchecked_ref())?;
    on_change.forget();
    Ok(())
}

/// Sets theme, meaning of colours and unit of lengths before anything is shown: the theme from the address, else as they were
/// chosen the last time. Deviations need a reference, which is not kept.
pub(super) fn initial_display(window: &Window, ui: Ui, asked: Option<Theme>) {
    let stored = |key: &str| storage(window)?.get_item(key).ok().flatten();
    let theme = asked.or_else(|| Theme::from_key(&stored(THEME_KEY)?));
    ui.send(Event::Theme(theme.unwrap_or_default()));
    if let Some(mode) = stored(COLOR_KEY).and_then(|key| ColorMode::from_key(&key)) {
        ui.send(Event::ColorMode(mode));
    }
    let unit = stored(UNIT_KEY).and_then(|name| LengthUnit::parse(&name));
    if let Some(unit) = unit.filter(|unit| Measure::UNITS.contains(unit)) {
        ui.send_feature(MeasureEvent::Unit(unit));
    }
}

/// The page's theme and title follow the state. What the person chooses is kept for the next visit.
pub(super) fn frame_of_page(window: &Window, document: &Document, ui: Ui) {
    let theme = ui.part(|s| s.display.theme);
    let page = document.clone();
    Effect::new(move |_| {
        if let Some(root) = page.document_element() {
            // Fails only for names that are no identifiers.
            let _ = root.set_attribute("data-theme", theme.get().key());
        }
    });
    keep_choice(window, THEME_KEY, ui.part(|s| s.display.theme.key()));
    keep_choice(window, COLOR_KEY, ui.part(|s| s.display.color_mode.key()));
    keep_choice(window, UNIT_KEY, ui.part(|s| s.features.measure.unit.name()));
    let title = ui.part(|s| {
        let part = Some(s.inspection.part.clone()).filter(|part| !part.is_empty());
        part.into_iter().chain(s.foreign_agent.clone()).chain(["Semascan".to_owned()]).collect::<Vec<_>>().join(" · ")
    });
    let page = document.clone();
    Effect::new(move |_| page.set_title(&title.get()));
}

/// Keeps what a person chooses for the next visit, from the first change on.
fn keep_choice(window: &Window, key: &'static str, choice: Memo<&'static str>) {
    let kept = storage(window);
    Effect::new(move |before: Option<&'static str>| {
        let choice = choice.get();
        if let (Some(storage), Some(before)) = (&kept, before)
            && before != choice
        {
            // Storage may be full or forbidden; the choice then holds for this visit.
            let _ = storage.set_item(key, choice);
        }
        choice
    });
}

/// A link into the page that is open already changes nothing but the fragment of its address.
pub(super) fn links(window: &Window, viewport: &Rc<Viewport>) -> Result<(), JsValue> {
    let (page, viewport) = (window.clone(), viewport.clone());
    let on_change = Closure::<dyn FnMut()>::new(move || match linked(&page) {
        Ok((link, complaints)) => {
            viewport.follow_link(&link);
            for text in complaints {
                viewport.ui.notify(Level::Warning, Topic::Address, text);
            }
        }
        Err(error) => web_sys::console::error_1(&error),
    });
    window.add_event_listener_with_callback("hashchange", on_change.as_ref().unchecked_ref())?;
    on_change.forget();
    Ok(())
}

/// Where the fragment of the page's address leads to, and what of it is not understood.
pub(super) fn linked(window: &Window) -> Result<(Permalink, Vec<String>), JsValue> {
    let fragment = window.location().hash()?;
    let parameters = UrlSearchParams::new_with_str(fragment.trim_start_matches('#'))?;
    let mut complaints = Vec::new();
    let link = Permalink::read(|name| parameters.get(name), &mut complaints);
    Ok((link, complaints))
}

/// The clock runs while something counts down.
pub(super) fn clock(ui: Ui) {
    let wanted = ui.part(AppState::wants_clock);
    Effect::new(move |running: Option<Option<IntervalHandle>>| {
        if let Some(Some(handle)) = running {
            handle.clear();
        }
        if !wanted.get() {
            return None;
        }
        let every = Duration::from_millis(CLOCK_MS.into());
        set_interval_with_handle(move || ui.send(Event::Elapsed { ms: CLOCK_MS }), every).ok()
    });
}

fn storage(window: &Window) -> Option<web_sys::Storage> {
    window.local_storage().ok().flatten()
}
