//! Exports: the model, the mesh or a section as files for the person, saved as if they came from a server; texts for the clipboard.

use super::viewport::Viewport;
use crate::export::{Format, Reply, Task, Written};
use crate::scene::section_export::{SectionFormat, export_section};
use crate::state::export_choice::Exporting;
use crate::state::notices::{Level, Topic};
use crate::state::{Event, units};
use crate::words::t;
use js_sys::{Array, Function, Promise, Reflect, Uint8Array};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{Blob, BlobPropertyBag, Document, HtmlAnchorElement, Url};

/// Begins to write points or mesh, as the person chose; the page goes on meanwhile.
pub(super) fn export(viewport: &Rc<Viewport>, format: Format) {
    let ui = viewport.ui;
    if viewport.export_worker.is_running() {
        return ui.notify(Level::Info, Topic::Export, t!("save.one_at_a_time"));
    }
    ui.retract(Topic::Export);
    let weak = Rc::downgrade(viewport);
    let on_reply = move |reply| {
        if let Some(viewport) = weak.upgrade() {
            receive(&viewport, format, reply);
        }
    };
    let begun = task(viewport, format).and_then(|task| viewport.export_worker.start(&task, on_reply));
    match begun {
        Ok(()) => ui.send(Event::Exporting(Some(Exporting::default()))),
        Err(reason) => ui.notify(Level::Error, Topic::Export, t!("save.failed", reason)),
    }
}

/// Ends the export: nothing of it is saved.
pub(super) fn cancel_export(viewport: &Viewport) {
    viewport.export_worker.stop();
    viewport.ui.send(Event::Exporting(None));
    viewport.ui.notify(Level::Info, Topic::Export, t!("save.cancelled"));
}

/// What is to be written.
fn task(viewport: &Viewport, format: Format) -> Result<Task, String> {
    let ui = viewport.ui;
    match format {
        Format::Points(_) => {
            let cloud = viewport.model.borrow().to_cloud();
            Ok(ui.read(|state| Task::of_points(cloud, state, format)))
        }
        Format::Mesh(_) => {
            let mesh = viewport.mesh.borrow().mesh().cloned().ok_or_else(|| t!("save.no_mesh").to_owned())?;
            Ok(ui.read(|state| Task::of_mesh(mesh, state, format)))
        }
    }
}

/// Follows the worker.
fn receive(viewport: &Viewport, format: Format, reply: Reply) {
    let ui = viewport.ui;
    if let Reply::Progress(progress) = reply {
        return ui.send(Event::Exporting(Some(progress)));
    }
    viewport.export_worker.stop();
    ui.send(Event::Exporting(None));
    let counted: fn(String) -> String = match format {
        Format::Points(_) => |count| t!("count.points", count),
        Format::Mesh(_) => |count| t!("count.triangles", count),
    };
    let files = match reply {
        Reply::Progress(_) => return,
        Reply::Written(files) => Ok(files),
        Reply::Failed(reason) => Err(reason),
        Reply::NotLoaded => written_here(viewport, format),
    };
    match files {
        Ok(files) => save(viewport, &files, format.mime(), counted),
        Err(reason) => ui.notify(Level::Error, Topic::Export, t!("save.failed", reason)),
    }
}

/// Writes on the page, which stands still meanwhile: a person can save what is shown even when the server of the worker is gone.
fn written_here(viewport: &Viewport, format: Format) -> Result<Vec<Written>, String> {
    let files = task(viewport, format)?.run(|_, _| {}).map_err(|error| error.to_string())?;
    Ok(files.into_iter().map(Written::from).collect())
}

/// Saves the section.
pub(super) fn save_section(viewport: &Viewport, format: SectionFormat) {
    viewport.ui.retract(Topic::Export);
    match viewport.ui.read(|state| export_section(state, format)) {
        Some(file) => save(viewport, &[file.into()], format.mime(), |count| t!("count.outlines", count)),
        None => {
            let text = t!("save.failed", reason = t!("save.no_section"));
            viewport.ui.notify(Level::Error, Topic::Export, text);
        }
    }
}

/// Gives a text to the clipboard, and says so; where the browser does not let the page (it does over HTTPS and on this
/// machine), the text is saved as a file.
pub(super) fn copy(viewport: &Viewport, text: String, file: &'static str) {
    let (ui, document) = (viewport.ui, viewport.document.clone());
    let writing = write_to_clipboard(&text);
    spawn_local(async move {
        ui.retract(Topic::Export);
        let copied = match writing {
            Ok(promise) => JsFuture::from(promise).await.is_ok(),
            Err(_) => false,
        };
        if copied {
            return ui.notify(Level::Info, Topic::Export, t!("save.copied"));
        }
        match download(&document, file, &Uint8Array::from(text.as_bytes()), "text/csv") {
            Ok(()) => {
                let text = t!("save.copied_to_file", name = file);
                ui.notify(Level::Info, Topic::Export, text);
            }
            Err(error) => ui.notify(Level::Error, Topic::Export, t!("save.copy_failed", reason = refused(error))),
        }
    });
}

/// Begins to write a text to the clipboard.
///
/// # Errors
/// Where the page has no clipboard: its origin is not secure.
fn write_to_clipboard(text: &str) -> Result<Promise, JsValue> {
    let window = web_sys::window().ok_or("the page has no window")?;
    let navigator = Reflect::get(&window, &"navigator".into())?;
    let clipboard = Reflect::get(&navigator, &"clipboard".into())?;
    let write: Function = Reflect::get(&clipboard, &"writeText".into())?.dyn_into()?;
    write.call1(&clipboard, &text.into())?.dyn_into()
}

/// Gives the clipboard a link to what is seen.
pub(super) fn copy_link(viewport: &Viewport) {
    let address = web_sys::window().ok_or(JsValue::NULL).and_then(|window| {
        let location = window.location();
        Ok(format!("{}{}", location.origin()?, location.pathname()?))
    });
    match address {
        Ok(page) => copy(viewport, viewport.link(&page), "semascan-link.txt"),
        Err(error) => {
            viewport.ui.notify(Level::Error, Topic::Export, t!("save.no_link", reason = refused(error)));
        }
    }
}

/// Hands files to the browser's downloads, and says so.
fn save(viewport: &Viewport, files: &[Written], mime: &str, counted: fn(String) -> String) {
    for Written { name, count, left_out, bytes } in files {
        if let Err(error) = download(&viewport.document, name, bytes, mime) {
            let text = t!("save.failed", reason = refused(error));
            return viewport.ui.notify(Level::Error, Topic::Export, text);
        }
        let (count, size) = (counted(units::count(*count)), units::bytes(bytes.length().into()));
        let left_out = match left_out {
            0 => String::new(),
            n => t!("save.left_out", what = counted(units::count(*n))),
        };
        let text = t!("save.saved", name, count, size, left_out);
        viewport.ui.notify(Level::Info, Topic::Export, text);
    }
}

/// What a person is told when the browser does not take a file; the console has the details.
fn refused(error: JsValue) -> String {
    web_sys::console::error_1(&error);
    t!("save.refused").to_owned()
}

/// Hands a file to the browser's downloads.
///
/// # Errors
/// What the browser says when it cannot.
pub(super) fn download(document: &Document, name: &str, bytes: &Uint8Array, mime: &str) -> Result<(), JsValue> {
    let parts = Array::of1(bytes);
    let options = BlobPropertyBag::new();
    options.set_type(mime);
    let blob = Blob::new_with_u8_array_sequence_and_options(&parts, &options)?;
    let address = Url::create_object_url_with_blob(&blob)?;
    let link: HtmlAnchorElement = document.create_element("a")?.unchecked_into();
    link.set_href(&address);
    link.set_download(name);
    link.click();
    // The browser has taken hold of the blob with the click; the address may go once this task is over.
    let revoke = Closure::once_into_js(move || drop(Url::revoke_object_url(&address)));
    let window = web_sys::window().ok_or("the page has no window")?;
    window.set_timeout_with_callback_and_timeout_and_arguments_0(revoke.unchecked_ref(), 10_000)?;
    Ok(())
}
