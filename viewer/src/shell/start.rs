//! The entry point of the page: joins state, panels, model, renderer and link.

use super::options::Options;
use super::play_file::{Followed, Source};
use super::viewport::Viewport;
use super::{canvas_data, listeners, open_file, pane, panels, play_file, reference, save, snapshot};
use crate::camera::{CameraInput, Puck};
use crate::features::Features;
use crate::link::{Link, LinkEvent};
use crate::scene::frame_content::frame_content;
use crate::state::notices::{Level, Topic};
use crate::state::{AppState, Event};
use crate::ui::{Command, Ui};
use crate::words::{self, t};
use leptos::prelude::*;
use std::cell::OnceCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{Document, HtmlCanvasElement, UrlSearchParams, Window};

/// A running page: it runs as long as this is kept.
#[wasm_bindgen]
pub struct Viewer {
    viewport: Rc<Viewport>,
    _followed: Followed,
    _owner: Owner,
}

/// What `www/space_mouse.js` tells.
#[wasm_bindgen]
impl Viewer {
    /// A puck was held at these shares of its ways for so many seconds: see [`Puck`].
    pub fn move_puck(&self, translation: &[f32], rotation: &[f32], seconds: f32) {
        let [Ok(translation), Ok(rotation)] = [translation, rotation].map(<[f32; 3]>::try_from) else { return };
        let puck = Puck { translation: translation.into(), rotation: rotation.into() };
        self.viewport.follow_puck(puck, seconds);
    }

    /// Its button was pressed: the whole model is shown.
    pub fn fit(&self) {
        self.viewport.steer(CameraInput::Fit);
    }

    /// A puck is there, by its name, or is gone.
    pub fn puck_is_there(&self, name: Option<String>) {
        match name {
            Some(name) => self.viewport.ui.notify(Level::Info, Topic::SpaceMouse, t!("space_mouse.there", name = name)),
            None => self.viewport.ui.notify(Level::Warning, Topic::SpaceMouse, t!("space_mouse.gone")),
        }
    }
}

/// Starts the viewer in the page that loaded the module. Called once by `www/boot.js`, never in a worker.
///
/// # Errors
/// If the page lacks a part of its skeleton.
#[wasm_bindgen]
pub fn start() -> Result<Viewer, JsValue> {
    console_error_panic_hook::set_once();
    let window = web_sys::window().ok_or("the viewer runs in a page, not in a worker")?;
    let document = window.document().ok_or("the window has no page")?;
    let owner = Owner::new();
    let (viewport, followed) = owner.with(|| run(&window, &document))?;
    Ok(Viewer { viewport, _followed: followed, _owner: owner })
}

fn run(window: &Window, document: &Document) -> Result<(Rc<Viewport>, Followed), JsValue> {
    let location = window.location();
    let query = UrlSearchParams::new_with_str(&location.search()?)?;
    let options = Options::read(location.protocol()? == "https:", &location.host()?, |name| query.get(name));

    let followed = Followed::default();
    let (ui, there) = ui(&followed);
    let viewport = Viewport::new(ui, window, document, options.backend);
    // Set once, here.
    let _ = there.set(viewport.clone());
    listeners::system_theme(window, ui)?;
    listeners::initial_display(window, ui, options.theme);
    match options.foreign_host {
        Some(host) => ui.send(Event::ForeignAgent(host)),
        None => {
            let agent = viewport.agent.clone();
            wasm_bindgen_futures::spawn_local(async move {
                // An agent that does not say so keeps nothing as far as the page knows.
                if let Ok(account) = agent.get("/api/v1/me").await {
                    ui.send(Event::Account(account));
                }
            });
        }
    }
    let (link, complaints) = listeners::linked(window)?;
    viewport.follow_link(&link);
    for text in options.complaints.into_iter().chain(complaints) {
        ui.notify(Level::Warning, Topic::Address, text);
    }
    panels::mount(document, ui)?;
    listeners::frame_of_page(window, document, ui);
    listeners::clock(ui);
    if js_sys::Reflect::has(&window.navigator(), &"hid".into())? {
        ui.send(Event::HasDevices);
    }
    listeners::keyboard(window, &viewport)?;
    listeners::links(window, &viewport)?;
    follow_state(&viewport);
    if options.is_pane {
        pane::join(window, &viewport)?;
    }
    viewport.begin();

    let place = document.query_selector(".viewport")?.ok_or("the page has no .viewport")?;
    listeners::size(window, &viewport, place)?;
    let canvas = document.get_element_by_id("viewport").ok_or("the page has no #viewport")?;
    viewport.open(canvas.dyn_into::<HtmlCanvasElement>()?);

    open_file::follow(&viewport, &followed);
    open_file::drops(window, &viewport)?;
    if let Some(reference) = options.reference {
        reference::compare_with(&viewport, reference);
    }
    if let Some(path) = options.model {
        open_file::fetch(&viewport, &followed, path);
        return Ok((viewport, followed));
    }
    let hears = viewport.clone();
    match Link::start(&options.stream, move |event| hears.handle_link(event)) {
        Ok(link) => drop(followed.replace(Some(Source::agent(link)))),
        Err(error) => {
            web_sys::console::error_1(&error);
            let reason = t!("link.cannot_start").to_owned();
            ui.send(Event::from(LinkEvent::Broken { reason }));
        }
    }
    Ok((viewport, followed))
}

/// What is there a little later than that which uses it.
type Later<T> = Rc<OnceCell<T>>;

/// The state with the ways to it. What happened goes to the state and then to the viewport, what is wanted to the viewport:
/// both as soon as that is put where the second value says. What is asked of the agent goes to what is followed.
fn ui(followed: &Followed) -> (Ui, Later<Rc<Viewport>>) {
    let state = RwSignal::new(AppState::default());
    let viewport: Rc<OnceCell<Rc<Viewport>>> = Rc::default();
    let handles = viewport.clone();
    let send = UnsyncCallback::new(move |event: Event| {
        state.update(|s| s.reduce(&event));
        if let (Event::Feature(event), Some(viewport)) = (&event, handles.get()) {
            viewport.handle_feature(event);
        }
    });
    let executes = viewport.clone();
    let followed = followed.clone();
    let ask = UnsyncCallback::new(move |command| {
        if let Some(viewport) = executes.get() {
            execute(viewport, &followed, command);
        }
    });
    (Ui::new(state, send, ask), viewport)
}

/// The picture, the figures and what the canvas says follow the state.
fn follow_state(viewport: &Rc<Viewport>) {
    let ui = viewport.ui;
    let content = ui.part(frame_content);
    let drawn = viewport.clone();
    Effect::new(move |_| {
        // Read, not only tracked: a memo that nobody reads never learns what it depends on.
        content.with(|_| drawn.redraw());
    });
    let anchored = ui.part(|s| {
        let Features { inspect, measure, section, others, .. } = &s.features;
        let read = (section.readings.clone(), section.aim, section.first);
        let pointed: Vec<_> = others.list.iter().map(|other| other.position).collect();
        (inspect.clone(), measure.clone(), read, pointed, s.legend.visibility(), s.display.cut)
    });
    let placed = viewport.clone();
    Effect::new(move |_| anchored.with(|_| placed.place_anchors()));
    let hidden = ui.part(|s| s.display.hidden_flags());
    let counted = viewport.clone();
    Effect::new(move |_| hidden.with(|_| counted.recount()));
    let document = viewport.document.clone();
    Effect::new(move |_| ui.follow(|s| canvas_data::write_state(&document, s)));
}

fn execute(viewport: &Rc<Viewport>, followed: &Followed, command: Command) {
    match command {
        Command::EarlierViews(before) => {
            viewport.ui.retract(Topic::EarlierViews);
            let asked = followed.borrow().as_ref().map(|source| source.link.earlier_views(before));
            if let Some(Err(error)) = asked {
                web_sys::console::error_1(&error);
                let text = t!("link.not_now");
                viewport.ui.notify(Level::Warning, Topic::EarlierViews, text);
            }
        }
        Command::ShowStop(stop) => {
            if let Some(Err(error)) = followed.borrow().as_ref().map(|source| source.link.show(stop)) {
                web_sys::console::error_1(&error);
            }
        }
        Command::PlayInspection => play_file::play_inspection(viewport, followed),
        Command::OpenFiles(files) => open_file::open(viewport, followed, &files),
        Command::Camera(input) => viewport.steer(input),
        Command::PickMiddle => viewport.pick_middle(),
        Command::Copy { text, file } => save::copy(viewport, text, file),
        Command::CopyLink => save::copy_link(viewport),
        Command::SavePicture => snapshot::save_picture(viewport),
        Command::Export(format) => save::export(viewport, format),
        Command::CancelExport => save::cancel_export(viewport),
        Command::ExportSection(format) => save::save_section(viewport, format),
        Command::Language(code) => {
            if let Some(window) = web_sys::window() {
                // Fails only in a page that is being left anyway.
                let _ = words::choose(&window, code);
            }
        }
        Command::Reload => {
            if let Some(window) = web_sys::window() {
                // Fails only in a page that is being left anyway.
                let _ = window.location().reload();
            }
        }
    }
}
