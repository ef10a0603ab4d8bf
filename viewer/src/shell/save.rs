//! Exports: what is visible of the model or the mesh as files for the person, saved as if they came from a server; texts for
//! the clipboard.

use super::viewport::Viewport;
use crate::scene::export::{ExportFile, MeshFormat, PointFormat, export_mesh, export_points};
use crate::scene::section_export::{SectionFormat, export_section};
use crate::state::notices::{Level, Topic};
use crate::state::units;
use crate::words::t;
use js_sys::{Function, Promise, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{Blob, BlobPropertyBag, Document, HtmlAnchorElement, Url};

/// Saves the visible points.
pub(super) fn save_points(viewport: &Viewport, format: PointFormat) {
    let cloud = viewport.model.borrow().to_cloud();
    let file = viewport.ui.read(|state| export_points(&cloud, state, format));
    save(viewport, file.map(|file| vec![file]).map_err(|e| e.to_string()), format.mime(), |count| {
        t!("count.points", count)
    });
}

/// Saves the visible components of the mesh.
pub(super) fn save_mesh(viewport: &Viewport, format: MeshFormat) {
    let files = match viewport.mesh.borrow().mesh() {
        Some(mesh) => viewport.ui.read(|state| export_mesh(mesh, state, format)).map_err(|e| e.to_string()),
        None => Err(t!("save.no_mesh").to_owned()),
    };
    save(viewport, files, format.mime(), |count| t!("count.triangles", count));
}

/// Saves the section.
pub(super) fn save_section(viewport: &Viewport, format: SectionFormat) {
    let file = viewport.ui.read(|state| export_section(state, format));
    let files = file.map(|file| vec![file]).ok_or(t!("save.no_section").to_owned());
    save(viewport, files, format.mime(), |count| t!("count.outlines", count));
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
        let (count, name) = (text.lines().count(), file.to_owned());
        let file = ExportFile { name, bytes: text.into_bytes(), count, left_out: 0 };
        match download(&document, &file, "text/csv") {
            Ok(()) => {
                let text = t!("save.copied_to_file", name = file.name);
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
fn save(viewport: &Viewport, files: Result<Vec<ExportFile>, String>, mime: &str, counted: fn(String) -> String) {
    let saved = files.and_then(|files| {
        files.iter().try_for_each(|f| download(&viewport.document, f, mime).map_err(refused))?;
        Ok(files)
    });
    viewport.ui.retract(Topic::Export);
    match saved {
        Ok(files) => {
            for file in files {
                let (count, size) = (counted(units::count(file.count as u64)), units::bytes(file.bytes.len() as u64));
                let left_out = match file.left_out {
                    0 => String::new(),
                    n => t!("save.left_out", what = counted(units::count(n as u64))),
                };
                let text = t!("save.saved", name = file.name, count, size, left_out);
                viewport.ui.notify(Level::Info, Topic::Export, text);
            }
        }
        Err(reason) => viewport.ui.notify(Level::Error, Topic::Export, t!("save.failed", reason)),
    }
}

/// What a person is told when the browser does not take a file; the console has the details.
fn refused(error: JsValue) -> String {
    web_sys::console::error_1(&error);
    t!("save.refused").to_owned()
}

/// Hands `file` to the browser's downloads.
///
/// # Errors
/// What the browser says when it cannot.
pub(super) fn download(document: &Document, file: &ExportFile, mime: &str) -> Result<(), JsValue> {
    let parts = js_sys::Array::of1(&js_sys::Uint8Array::from(file.bytes.as_slice()).into());
    let options = BlobPropertyBag::new();
    options.set_type(mime);
    let blob = Blob::new_with_u8_array_sequence_and_options(&parts, &options)?;
    let address = Url::create_object_url_with_blob(&blob)?;
    let link: HtmlAnchorElement = document.create_element("a")?.unchecked_into();
    link.set_href(&address);
    link.set_download(&file.name);
    link.click();
    // The browser has taken hold of the blob with the click; the address may go once this task is over.
    let revoke = Closure::once_into_js(move || drop(Url::revoke_object_url(&address)));
    let window = web_sys::window().ok_or("the page has no window")?;
    window.set_timeout_with_callback_and_timeout_and_arguments_0(revoke.unchecked_ref(), 10_000)?;
    Ok(())
}
