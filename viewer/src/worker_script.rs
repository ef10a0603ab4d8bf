//! Starts the workers: each is another instance of the page's module, in a module worker with a script of its own.

use crate::words::hand_over;
use js_sys::{Array, Object, Reflect};
use wasm_bindgen::JsValue;
use web_sys::{ErrorEvent, Worker, WorkerOptions, WorkerType};

/// Starts the worker of the script at `address`, relative to the page, and hands it the module and the texts.
///
/// * `values`: what the script looks for beside these, by their names.
/// * `transfer`: what of that the page gives away.
///
/// # Errors
/// What the browser says when it cannot.
pub(crate) fn start(
    address: &str,
    name: &str,
    values: &[(&str, &JsValue)],
    transfer: &Array,
) -> Result<Worker, JsValue> {
    let options = WorkerOptions::new();
    options.set_type(WorkerType::Module);
    options.set_name(name);
    let worker = Worker::new_with_options(address, &options)?;
    let start = Object::new();
    for (key, value) in values {
        Reflect::set(&start, &(*key).into(), value)?;
    }
    Reflect::set(&start, &"module".into(), &wasm_bindgen::module())?;
    hand_over(&start)?;
    worker.post_message_with_transfer(&start, transfer)?;
    Ok(worker)
}

/// Why a worker stopped; `None` for a script that does not load, of which browsers say nothing.
pub(crate) fn reason(error: &ErrorEvent) -> Option<String> {
    let message = Reflect::get(error, &"message".into()).ok().and_then(|message| message.as_string());
    message.filter(|message| !message.is_empty())
}
