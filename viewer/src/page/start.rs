//! The entry point of the page: joins state, panels, model, renderer and link.

use super::download::download;
use super::exports::{ExportFile, ExportFormat, MeshFormat, export, export_mesh};
use super::graphics::Graphics;
use super::mesh_of_model::MeshOfModel;
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
        Command::ExportMesh(format) => save_mesh(stage, format),
        Command::Mesh => MeshOfModel::make(stage),
        Command::CancelMesh => MeshOfModel::cancel(stage),
        Command::Compare(file) => MeshOfModel::compare(stage, file),
        Command::Forget => MeshOfModel::forget(stage),
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
    hand_over(stage, file.map(|f| vec![f]).map_err(|e| e.to_string()), format.mime(), "points");
}

fn save_mesh(stage: &Rc<Stage>, format: MeshFormat) {
    let files = match stage.mesh.mesh() {
        Some(mesh) => stage.state.with_untracked(|s| export_mesh(&mesh, s, format)).map_err(|e| e.to_string()),
        None => Err("there is no mesh yet".to_owned()),
    };
    hand_over(stage, files, format.mime(), "triangles");
}

/// Hands files to the browser's downloads, and says so.
fn hand_over(stage: &Rc<Stage>, files: Result<Vec<ExportFile>, String>, mime: &str, what: &str) {
    let saved = files.and_then(|files| {
        files.iter().try_for_each(|f| download(&stage.document, f, mime).map_err(|e| format!("{e:?}")))?;
        Ok(files)
    });
    match saved {
        Ok(files) => {
            for file in files {
                let (count, size) = (units::count(file.count as u64), units::bytes(file.bytes.len() as u64));
                let text = format!("{} saved: {count} {what}, {size}.", file.name);
                stage.send.run(Event::Notify { level: Level::Info, text });
            }
        }
        Err(why) => {
            stage.send.run(Event::Notify { level: Level::Error, text: format!("The export failed: {why}") });
        }
    }
}
