//! Files that are looked at without an agent: what a person chooses or drops onto the page, or its address names. Models are read in
//! the mesh worker, recordings and inspections by workers of their own; from then on the page follows the agent no more.

use super::open_recording::RecordingWorker;
use super::play_file::{Followed, is_inspection, show_file};
use super::viewport::Viewport;
use crate::display::{ColorMode, Representation};
use crate::features::mesh::MeshEvent;
use crate::features::timeline::TimelineEvent;
use crate::link::LinkEvent;
use crate::mesh_worker::{Reply, Request};
use crate::opened::{Beside, OpenedModel};
use crate::state::notices::{Level, Topic};
use crate::state::{Event, units};
use crate::ui::Command;
use crate::words::t;
use js_sys::{ArrayBuffer, Uint8Array};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{DragEvent, File, FileList, HtmlElement, Response, Window};

/// Largest file, bytes: a page has 4 GB, and the file is there beside what it holds.
const LARGEST: f64 = 1e9;
/// Attribute of the page's body while a file is dragged over it; the style sheet shows where it may be dropped.
const DRAGGED: &str = "data-dropping";

/// Shows what the mesh worker reads.
pub(super) fn follow(viewport: &Rc<Viewport>, followed: &Followed) {
    let (weak, followed) = (Rc::downgrade(viewport), followed.clone());
    viewport.mesh_worker.subscribe(move |reply| {
        let Some(viewport) = weak.upgrade() else { return };
        match reply {
            Reply::Opened(model) => {
                followed.borrow_mut().take();
                show(&viewport, model);
            }
            Reply::NotOpened(reason) => refuse(&viewport, reason),
            _ => {}
        }
    });
}

/// Reads a file of the person's, with those that it names.
pub(super) fn open(viewport: &Rc<Viewport>, followed: &Followed, files: &FileList) {
    let (viewport, followed) = (viewport.clone(), followed.clone());
    let mut files: Vec<File> = (0..files.length()).filter_map(|index| files.get(index)).collect();
    if files.is_empty() {
        return;
    }
    // Of a model and what it names; of others, what was named first.
    let main = files.iter().position(|file| !is_named_by_models(&file.name())).unwrap_or(0);
    let file = files.remove(main);
    let (ui, name) = (viewport.ui, file.name());
    ui.retract(Topic::File);
    ui.retract(Topic::Recording);
    viewport.recording_worker.stop();
    if files.iter().map(|beside| beside.size()).sum::<f64>() + file.size() > LARGEST {
        let text = t!("file.too_large", name);
        ui.notify(Level::Error, Topic::File, text);
        return;
    }
    ui.notify(Level::Info, Topic::File, t!("file.reading", name));
    spawn_local(async move {
        match contents(&file, &files).await {
            Ok((buffer, beside)) => take(&viewport, &followed, name, &buffer, beside),
            Err(error) => {
                web_sys::console::error_1(&error);
                refuse(&viewport, &t!("file.unreadable", name));
            }
        }
    });
}

/// Whether a file of that name is one that models name.
fn is_named_by_models(name: &str) -> bool {
    has_ending(name, &["mtl", "bin", "png", "jpg", "jpeg", "webp"])
}

fn has_ending(name: &str, endings: &[&str]) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| endings.iter().any(|own| ending.eq_ignore_ascii_case(own)))
}

/// What is in a file, and in those beside it.
///
/// # Errors
/// What the browser says of one that it cannot read.
async fn contents(file: &File, beside: &[File]) -> Result<(ArrayBuffer, Vec<Beside>), JsValue> {
    let mut contents = Vec::new();
    for file in beside {
        let buffer = JsFuture::from(file.array_buffer()).await?;
        contents.push((file.name(), Uint8Array::new(&buffer).to_vec().into()));
    }
    Ok((JsFuture::from(file.array_buffer()).await?.unchecked_into(), contents))
}

/// Shows what is in a file.
///
/// * `beside`: the files that were opened with it.
fn take(viewport: &Rc<Viewport>, followed: &Followed, name: String, buffer: &ArrayBuffer, beside: Vec<Beside>) {
    let taken = if is_inspection(&name) {
        show_file(viewport, followed, &name, buffer)
    } else if has_ending(&name, &["mcap"]) {
        RecordingWorker::start(viewport, &name, buffer)
    } else {
        let bytes = Uint8Array::new(buffer).to_vec().into();
        viewport.mesh_worker.send(&Request::Open { name, bytes, beside })
    };
    if let Err(reason) = taken {
        refuse(viewport, &reason);
    }
}

/// Fetches and reads the file at `path`, relative to the page, in the place of an agent.
pub(super) fn fetch(viewport: &Rc<Viewport>, followed: &Followed, path: String) {
    let name = path.rsplit('/').next().unwrap_or(&path).to_owned();
    viewport.ui.send(Event::Opened(name.clone()));
    let (viewport, followed) = (viewport.clone(), followed.clone());
    spawn_local(async move {
        match fetched(&path).await {
            Ok(buffer) => take(&viewport, &followed, name, &buffer, Vec::new()),
            Err(error) => refuse(&viewport, &t!("file.not_loaded", path, reason = error.reason())),
        }
    });
}

/// Why a file cannot be had.
#[derive(Clone, Copy, Debug)]
pub(super) enum FetchError {
    /// The server refused with this status.
    Refused(u16),
    /// Nothing came.
    Unreachable,
}

impl FetchError {
    /// The same for people.
    pub(super) fn reason(self) -> String {
        match self {
            Self::Refused(status) => t!("file.server_said", status),
            Self::Unreachable => t!("file.no_server").into(),
        }
    }
}

/// The content of what is at `path`.
///
/// # Errors
/// [`FetchError`].
pub(super) async fn fetched(path: &str) -> Result<ArrayBuffer, FetchError> {
    let said = |error: JsValue| {
        web_sys::console::error_1(&error);
        FetchError::Unreachable
    };
    let window = web_sys::window().ok_or(FetchError::Unreachable)?;
    let response = JsFuture::from(window.fetch_with_str(path)).await.map_err(said)?;
    let response: Response = response.dyn_into().map_err(said)?;
    if !response.ok() {
        return Err(FetchError::Refused(response.status()));
    }
    let buffer = JsFuture::from(response.array_buffer().map_err(said)?).await.map_err(said)?;
    Ok(buffer.unchecked_into())
}

fn show(viewport: &Viewport, model: &OpenedModel) {
    let ui = viewport.ui;
    ui.retract(Topic::File);
    ui.send(Event::Opened(model.name.clone()));
    ui.send_feature(TimelineEvent::Closed);
    for event in model.events() {
        viewport.handle_link(event);
    }
    if !model.mesh.triangles.is_empty() {
        ui.send_feature(MeshEvent::Show(Representation::Mesh));
    }
    // Where no classes are told apart, their colours are one grey.
    let has_classes = model.mesh.vertices.labels.iter().any(|label| *label != 0);
    if !has_classes && ui.read(|state| state.display.color_mode) == ColorMode::Component {
        ui.send(Event::ColorMode(ColorMode::Appearance));
    }
    for remark in &model.remarks {
        ui.notify(Level::Info, Topic::File, format!("{}: {}", model.name, units::sentence(remark)));
    }
}

/// A file that cannot be shown: what is shown stays, if anything is.
pub(super) fn refuse(viewport: &Viewport, reason: &str) {
    let ui = viewport.ui;
    if ui.read(|s| s.connection.is_file() && !s.has_model()) {
        ui.send(Event::from(LinkEvent::Broken { reason: reason.to_owned() }));
    } else {
        ui.notify(Level::Error, Topic::File, t!("file.not_opened", reason));
    }
}

/// Files can be dropped anywhere on the page.
pub(super) fn drops(window: &Window, viewport: &Rc<Viewport>) -> Result<(), JsValue> {
    let body: HtmlElement = viewport.document.body().ok_or("the page has no body")?;
    let holds_files =
        |event: &DragEvent| event.data_transfer().is_some_and(|data| data.types().includes(&"Files".into(), 0));
    let shown = body.clone();
    let on_over = Closure::<dyn FnMut(DragEvent)>::new(move |event: DragEvent| {
        if holds_files(&event) {
            event.prevent_default();
            // Fails for names that are none.
            let _ = shown.set_attribute(DRAGGED, "");
        }
    });
    let shown = body.clone();
    let on_leave = Closure::<dyn FnMut(DragEvent)>::new(move |event: DragEvent| {
        if event.related_target().is_none() {
            let _ = shown.remove_attribute(DRAGGED);
        }
    });
    let ui = viewport.ui;
    let on_drop = Closure::<dyn FnMut(DragEvent)>::new(move |event: DragEvent| {
        let _ = body.remove_attribute(DRAGGED);
        let files = event.data_transfer().and_then(|data| data.files());
        if let Some(files) = files.filter(|files| files.length() > 0) {
            event.prevent_default();
            ui.ask(Command::OpenFiles(files));
        }
    });
    window.add_event_listener_with_callback("dragover", on_over.as_ref().unchecked_ref())?;
    window.add_event_listener_with_callback("dragleave", on_leave.as_ref().unchecked_ref())?;
    window.add_event_listener_with_callback("drop", on_drop.as_ref().unchecked_ref())?;
    // They live as long as the page.
    on_over.forget();
    on_leave.forget();
    on_drop.forget();
    Ok(())
}
