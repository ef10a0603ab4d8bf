//! Recordings (MCAP) that are opened without an agent: a worker with a module of its own reads one and makes a model of it, which is
//! then opened like any other file.

use super::open_file::refuse;
use super::viewport::Viewport;
use crate::mesh_worker::Request;
use crate::state::notices::{Level, Topic};
use crate::state::units;
use crate::words::t;
use crate::worker_script;
use js_sys::{Array, ArrayBuffer, Object, Reflect, Uint8Array};
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker, WorkerOptions, WorkerType};

const SCRIPT: &str = "./recording_worker.js";

/// What keeps a worker and its listeners alive until it has answered.
type Reading = Rc<RefCell<Option<(Worker, Closure<dyn FnMut(MessageEvent)>, Closure<dyn FnMut(ErrorEvent)>)>>>;

/// Reads the recording `name` and opens what is in it.
///
/// # Errors
/// What is said to a person, if no worker can be started.
pub(super) fn open(viewport: &Rc<Viewport>, name: &str, buffer: &ArrayBuffer) -> Result<(), String> {
    let cannot = |_| t!("file.no_reader", name);
    let reading = Reading::default();
    let options = WorkerOptions::new();
    options.set_type(WorkerType::Module);
    options.set_name("semascan recording");
    let worker = Worker::new_with_options(SCRIPT, &options).map_err(cannot)?;

    let (answered, of_answer) = (viewport.clone(), reading.clone());
    let file = name.to_owned();
    let on_answer = Closure::new(move |event: MessageEvent| {
        end(&of_answer);
        if let Err(reason) = take(&answered, &event.data()) {
            refuse(&answered, &t!("file.recording", name = file, reason));
        }
    });
    let (failed, of_error) = (viewport.clone(), reading.clone());
    let file = name.to_owned();
    let on_error = Closure::new(move |error: ErrorEvent| {
        error.prevent_default();
        end(&of_error);
        let reason = worker_script::reason(&error).unwrap_or_else(|| t!("file.no_reader", name = file));
        refuse(&failed, &t!("file.recording", name = file, reason));
    });
    worker.set_onmessage(Some(on_answer.as_ref().unchecked_ref()));
    worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
    let task = Object::new();
    Reflect::set(&task, &"name".into(), &name.into()).map_err(cannot)?;
    Reflect::set(&task, &"bytes".into(), buffer).map_err(cannot)?;
    worker.post_message_with_transfer(&task, &Array::of1(buffer)).map_err(cannot)?;
    *reading.borrow_mut() = Some((worker, on_answer, on_error));
    Ok(())
}

/// The worker has said all that it says. Its listeners are dropped once they have returned.
fn end(reading: &Reading) {
    if let Some((worker, on_answer, on_error)) = reading.borrow_mut().take() {
        worker.terminate();
        wasm_bindgen_futures::spawn_local(async move { drop((on_answer, on_error)) });
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
