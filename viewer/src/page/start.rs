//! The entry point of the page: joins state, panels, model, renderer and link.

use super::download::download;
use super::exports::{ExportFormat, export};
use super::graphics::Graphics;
use super::options::Options;
use super::scene::{Scene, hidden_flags};
use super::stage::Stage;
use super::{hooks, listeners};
use crate::app::notices::Level;
use crate::app::{AppState, Event, units};
use crate::link::Link;
use crate::panels::{self, Command, Ui};
use leptos::prelude::*;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{Document, HtmlCanvasElement, UrlSearchParams, Window};

/// A running page. It lives as long as the page does; scripts of the page keep it for the test hook alone.
#[wasm_bindgen]
pub struct Viewer {
    link: Option<Link>,
    _owner: Owner,
}

#[wasm_bindgen]
impl Viewer {
    /// Test hook: loses the connection as a broken network would; it is then resumed by itself.
    ///
    /// # Errors
    /// If there is no link to lose.
    pub fn cut_link(&self) -> Result<(), JsValue> {
        self.link.as_ref().ok_or("the link has not started")?.drop_connection()
    }
}

/// Starts the viewer in the page that loaded the module. Called once by `www/boot.js`, never in the worker.
///
/// # Errors
/// If the page lacks a part of its skeleton.
#[wasm_bindgen]
pub fn start() -> Result<Viewer, JsValue> {
    console_error_panic_hook::set_once();
    let window = web_sys::window().ok_or("the viewer runs in a page, not in a worker")?;
    let document = window.document().ok_or("the window has no page")?;
    let owner = Owner::new();
    let link = owner.with(|| run(&window, &document))?;
    Ok(Viewer { link, _owner: owner })
}

fn run(window: &Window, document: &Document) -> Result<Option<Link>, JsValue> {
    let location = window.location();
    let query = UrlSearchParams::new_with_str(&location.search()?)?;
    let options = Options::read(location.protocol()? == "https:", &location.host()?, |name| query.get(name));

    let stage = Stage::new(RwSignal::new(AppState::default()), window, document, options.backend);
    let carries_out = stage.clone();
    let ask = UnsyncCallback::new(move |command| carry_out(&carries_out, command));
    let ui = Ui { state: stage.state, send: stage.send, ask };
    listeners::system_theme(window, ui)?;
    listeners::initial_theme(window, ui, options.theme);
    for text in options.complaints {
        ui.send.run(Event::Notify { level: Level::Warning, text });
    }
    panels::mount(document, ui)?;
    listeners::frame_of_page(window, document, ui);
    listeners::clock(ui);
    listeners::keyboard(window, &stage)?;
    follow_state(&stage);

    let place = document.query_selector(".viewport")?.ok_or("the page has no .viewport")?;
    listeners::size(window, &stage, place)?;
    let canvas = document.get_element_by_id("viewport").ok_or("the page has no #viewport")?;
    Graphics::open(&stage, canvas.dyn_into::<HtmlCanvasElement>()?);

    let hears = stage.clone();
    let link = Link::start(&options.stream, move |event| hears.hear(event));
    Ok(link
        .map_err(|error| ui.send.run(Event::Refused { reason: format!("The decoding worker cannot start: {error:?}") }))
        .ok())
}

/// The picture, the figures and the test hooks follow the state.
fn follow_state(stage: &Rc<Stage>) {
    let state = stage.state;
    let scene = Memo::new(move |_| state.with(Scene::of));
    let drawn = stage.clone();
    Effect::new(move |_| {
        // Read, not only tracked: a memo that nobody reads never learns what it depends on.
        scene.with(|_| drawn.redraw());
    });
    let hidden = Memo::new(move |_| state.with(hidden_flags));
    let counted = stage.clone();
    Effect::new(move |_| hidden.with(|_| counted.recount()));
    let told = stage.clone();
    Effect::new(move |_| state.with(|s| hooks::tell_state(&told.document, s)));
}

fn carry_out(stage: &Rc<Stage>, command: Command) {
    match command {
        Command::Camera(input) => stage.steer(input),
        Command::Export(format) => save(stage, format),
        Command::Reload => {
            if let Some(window) = web_sys::window() {
                // Fails only in a page that is being left anyway.
                let _ = window.location().reload();
            }
        }
    }
}

fn save(stage: &Rc<Stage>, format: ExportFormat) {
    let file = stage.state.with_untracked(|s| export(&stage.cloud(), s, format));
    let saved = file
        .map_err(|e| e.to_string())
        .and_then(|file| download(&stage.document, &file, format.mime()).map_err(|e| format!("{e:?}")).map(|()| file));
    let (level, text) = match saved {
        Ok(file) => {
            let (points, size) = (units::count(file.points as u64), units::bytes(file.bytes.len() as u64));
            (Level::Info, format!("{} saved: {points} points, {size}.", file.name))
        }
        Err(why) => (Level::Error, format!("The export failed: {why}")),
    };
    stage.send.run(Event::Notify { level, text });
}
