//! Recordings (MCAP) that are opened without an agent: a worker with a module of its own reads one and makes a model of it, which is
//! then opened like any other file.

use super::open_file::refuse;
use super::viewport::Viewport;
use crate::mesh_worker::Request;
use crate::state::notices::{Level, Topic};
use crate::state::units;
use crate::words::t;
use crate::worker_script;
use js_sys::{Array, ArrayBuffer, Reflect, Uint8Array};
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::{ErrorEvent, MessageEvent, Worker};

/// Address of the worker's script, relative to the page.
const SCRIPT: &str = "./recording_worker.js";

/// The recording that is being read, if any.
#[derive(Default)]
pub(super) struct RecordingWorker {
    running: RefCell<Option<Running>>,
}

impl RecordingWorker {
    /// Reads the recording `name` in the place of another one, and opens what is in it.
    ///
    /// # Errors
    /// What is said to a person, if no worker can be started.
    pub(super) fn start(viewport: &Rc<Viewport>, name: &str, buffer: &ArrayBuffer) -> Result<(), String> {
        let running = Running::start(viewport, name, buffer).map_err(|_| t!("file.no_reader", name))?;
        viewport.recording_worker.running.replace(Some(running));
        Ok(())
    }

    /// Ends the reading: something else is opened.
    pub(super) fn stop(&self) {
        self.running.take();
    }

    /// The same from within what the worker called, which has to be there until it returns.
    fn answered(&self) {
        let running = self.running.take();
        spawn_local(async move { drop(running) });
    }
}

/// A running worker; dropping it ends the worker.
struct Running {
    worker: Worker,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut(ErrorEvent)>,
}

impl Running {
    fn start(viewport: &Rc<Viewport>, name: &str, buffer: &ArrayBuffer) -> Result<Self, JsValue> {
        let values: [(&str, &JsValue); 2] = [("name", &name.into()), ("bytes", buffer)];
        let worker = worker_script::start(SCRIPT, "semascan-recording", &values, &Array::of1(buffer))?;
        let (weak, file) = (Rc::downgrade(viewport), name.to_owned());
        let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
            let Some(viewport) = weak.upgrade() else { return };
            viewport.recording_worker.answered();
            if let Err(reason) = take(&viewport, &message.data()) {
                refuse(&viewport, &t!("file.recording", name = file, reason));
            }
        });
        let (weak, file) = (Rc::downgrade(viewport), name.to_owned());
        let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |error: ErrorEvent| {
            error.prevent_default();
            let Some(viewport) = weak.upgrade() else { return };
            viewport.recording_worker.answered();
            let reason = worker_script::reason(&error).unwrap_or_else(|| t!("file.no_reader", name = file));
            refuse(&viewport, &t!("file.recording", name = file, reason));
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        Ok(Self { worker, _on_message: on_message, _on_error: on_error })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}

/// Opens what the worker has made of a recording.
///
/// # Errors
/// Why there is nothing.
fn take(viewport: &Viewport, answer: &JsValue) -> Result<(), String> {
    let property = |of: &JsValue, key: &str| Reflect::get(of, &key.into()).unwrap_or(JsValue::UNDEFINED);
    let opened = property(answer, "opened");
    if opened.is_undefined() {
        return Err(property(answer, "reason").as_string().unwrap_or_default());
    }
    let name = property(&opened, "name").as_string().unwrap_or_default();
    let bytes = Uint8Array::new(&property(&opened, "bytes")).to_vec();
    for remark in Array::from(&property(&opened, "remarks")).iter().filter_map(|remark| remark.as_string()) {
        viewport.ui.notify(Level::Info, Topic::Recording, format!("{name}: {}", units::sentence(&remark)));
    }
    viewport.mesh_worker.send(&Request::Open { name, bytes: bytes.into(), beside: Vec::new() })
}
