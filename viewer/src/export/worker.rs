//! The worker's side: writes one export, and is ended by the page.

use super::task::Task;
use super::write::ExportFile;
use crate::state::export_choice::Step;
use js_sys::{Array, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::DedicatedWorkerGlobalScope;

/// Entry point of the worker's script: writes what the bytes of a [`Task`] say. Numbers that it posts say how far it is, a text why
/// there will be no files, and a list what the files are.
///
/// # Errors
/// Fails outside a dedicated worker, and for bytes that are no task.
#[wasm_bindgen]
pub fn export_worker_start(task: Uint8Array) -> Result<(), JsValue> {
    console_error_panic_hook::set_once();
    let task = Task::decode(&task.to_vec()).ok_or("the export is broken")?;
    match task.run(report) {
        Ok(files) => {
            let (written, buffers) = (Array::new(), Array::new());
            for ExportFile { name, bytes, count, left_out } in files {
                let buffer = Uint8Array::from(bytes.as_slice()).buffer();
                buffers.push(&buffer);
                written.push(&Array::of4(&name.into(), &count.into(), &left_out.into(), &buffer));
            }
            scope()?.post_message_with_transfer(&written, &buffers)
        }
        Err(error) => scope()?.post_message(&error.to_string().into()),
    }
}

/// Tells the page how far the export is: the number of the step, and the share of it that is done behind the point.
fn report(step: Step, share: f32) {
    let number = Step::ALL.iter().position(|other| *other == step).unwrap_or(0) as f64;
    let posted = scope().and_then(|scope| scope.post_message(&(number + 0.99 * f64::from(share)).into()));
    if let Err(error) = posted {
        web_sys::console::error_2(&"semascan: the page cannot be reached".into(), &error);
    }
}

fn scope() -> Result<DedicatedWorkerGlobalScope, JsValue> {
    Ok(js_sys::global().dyn_into()?)
}
