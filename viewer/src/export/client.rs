//! The page's side of the export worker: one for each export, ended with it.

use super::task::Task;
use super::write::ExportFile;
use crate::state::export_choice::{Exporting, Step};
use crate::words::t;
use crate::worker_script;
use js_sys::{Array, Uint8Array};
use std::cell::RefCell;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker};

/// Address of the worker's script, relative to the page.
const WORKER_SCRIPT: &str = "./export_worker.js";

/// A file as the worker wrote it; its bytes never come into the page's module.
pub struct Written {
    /// Name of the file.
    pub name: String,
    /// Number of points or triangles in it.
    pub count: u64,
    /// Number of those that it does not hold, because they are hidden.
    pub left_out: u64,
    /// Its content.
    pub bytes: Uint8Array,
}

impl From<ExportFile> for Written {
    fn from(ExportFile { name, bytes, count, left_out }: ExportFile) -> Self {
        let bytes = Uint8Array::from(bytes.as_slice());
        Self { name, count: count as u64, left_out: left_out as u64, bytes }
    }
}

/// What the worker says.
pub enum Reply {
    /// So far it is.
    Progress(Exporting),
    /// All files are written.
    Written(Vec<Written>),
    /// There will be none.
    Failed(String),
    /// The worker did not load: its server is gone, for instance.
    NotLoaded,
}

/// The export that is being written, if any.
#[derive(Default)]
pub struct ExportWorker {
    running: RefCell<Option<Running>>,
}

impl ExportWorker {
    /// Whether an export is being written.
    pub fn is_running(&self) -> bool {
        self.running.borrow().is_some()
    }

    /// Begins to write; `on_reply` is called from the page's event loop. It ends the worker after the last reply.
    ///
    /// # Errors
    /// Why it cannot be started, for people.
    pub fn start(&self, task: &Task, on_reply: impl Fn(Reply) + Clone + 'static) -> Result<(), String> {
        let started = Running::start(task, on_reply);
        let started = started.map_err(|error| t!("save.cannot_start", error = format!("{error:?}")))?;
        *self.running.borrow_mut() = Some(started);
        Ok(())
    }

    /// Ends the export, whatever is done of it.
    pub fn stop(&self) {
        self.running.borrow_mut().take();
    }
}

/// A running worker; dropping it ends the worker.
struct Running {
    worker: Worker,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut(ErrorEvent)>,
}

impl Running {
    fn start(task: &Task, on_reply: impl Fn(Reply) + Clone + 'static) -> Result<Self, JsValue> {
        let task = Uint8Array::from(task.encode().as_slice()).buffer();
        let worker = worker_script::start(WORKER_SCRIPT, "semascan-export", &[("task", &task)], &Array::of1(&task))?;
        let reply = on_reply.clone();
        let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
            reply(read(&message.data()));
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |error: ErrorEvent| {
            on_reply(match worker_script::reason(&error) {
                Some(why) => Reply::Failed(t!("save.worker_failed", why)),
                None => Reply::NotLoaded,
            });
        });
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

/// What a message of the worker says.
fn read(message: &JsValue) -> Reply {
    if let Some(number) = message.as_f64() {
        let step = Step::ALL.get(number as usize).copied().unwrap_or_default();
        return Reply::Progress(Exporting { step, share: number.fract() as f32 });
    }
    if let Some(reason) = message.as_string() {
        return Reply::Failed(reason);
    }
    Reply::Written(Array::from(message).iter().map(|file| written(&Array::from(&file))).collect())
}

fn written(file: &Array) -> Written {
    let number = |index| file.get(index).as_f64().unwrap_or_default() as u64;
    Written {
        name: file.get(0).as_string().unwrap_or_default(),
        count: number(1),
        left_out: number(2),
        bytes: Uint8Array::new(&file.get(3)),
    }
}
