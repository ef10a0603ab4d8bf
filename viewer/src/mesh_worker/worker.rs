//! The worker's side: takes requests, works in slices between them. Pictures of files are decoded by the browser, which tells later.

use super::decoded;
use super::job::Job;
use super::message::{Reply, Request};
use crate::opened::{OpenError, OpenedFile, OpenedModel};
use js_sys::{Array, ArrayBuffer, Date, Uint8Array};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent};

/// Work between two looks at what requests there are, milliseconds: browsers wait for four before each.
const SLICE_MS: f64 = 30.0;

/// Entry point of the mesh worker's script.
///
/// # Errors
/// Fails outside a dedicated worker.
#[wasm_bindgen]
pub fn mesh_worker_start() -> Result<(), JsValue> {
    console_error_panic_hook::set_once();
    let scope: DedicatedWorkerGlobalScope = js_sys::global().dyn_into()?;
    let worker = Rc::new(Worker {
        scope: scope.clone(),
        job: RefCell::default(),
        opened: Cell::default(),
        next: Cell::new(false),
        slice: RefCell::default(),
    });
    let slices = Rc::downgrade(&worker);
    let slice = Closure::<dyn FnMut()>::new(move || {
        if let Some(worker) = slices.upgrade() {
            worker.next.set(false);
            worker.send(&worker.work());
            worker.schedule();
        }
    });
    worker.slice.borrow_mut().replace(slice);
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
        let Ok(buffer) = message.data().dyn_into::<ArrayBuffer>() else { return };
        let replies = match Request::decode(&Uint8Array::new(&buffer).to_vec()) {
            Ok(Request::Open { name, bytes, beside }) => {
                let file = OpenedFile::read(&name, &bytes, &beside);
                return spawn_local(worker.clone().open(file));
            }
            Ok(request) => worker.job.borrow_mut().handle(request),
            Err(error) => vec![Reply::Failed(error.to_string())],
        };
        worker.send(&replies);
        worker.schedule();
    });
    // Lives as long as the worker does.
    scope.set_onmessage(Some(on_message.into_js_value().unchecked_ref()));
    Ok(())
}

struct Worker {
    scope: DedicatedWorkerGlobalScope,
    job: RefCell<Job>,
    /// Files opened so far.
    opened: Cell<u32>,
    /// The next slice is on its way.
    next: Cell<bool>,
    slice: RefCell<Option<Closure<dyn FnMut()>>>,
}

impl Worker {
    /// Shows a file once its pictures are decoded, unless another has been opened meanwhile.
    async fn open(self: Rc<Self>, file: Result<OpenedFile, OpenError>) {
        let number = self.opened.get() + 1;
        self.opened.set(number);
        let model = decoded_model(file).await;
        if self.opened.get() == number {
            let replies = self.job.borrow_mut().open(model);
            self.send(&replies);
            self.schedule();
        }
    }

    /// Works for a slice; what there is to reply then.
    fn work(&self) -> Vec<Reply> {
        let begun = Date::now();
        let mut replies = Vec::new();
        let mut job = self.job.borrow_mut();
        while job.is_busy() && Date::now() - begun < SLICE_MS {
            // Of several reports of progress the last is enough.
            replies.retain(|reply| !matches!(reply, Reply::Progress { .. }));
            replies.extend(job.work());
        }
        replies
    }

    fn send(&self, replies: &[Reply]) {
        for reply in replies {
            let buffer = Uint8Array::from(reply.encode().as_slice()).buffer();
            if let Err(error) = self.scope.post_message_with_transfer(&buffer, &Array::of1(&buffer)) {
                web_sys::console::error_2(&"semascan: the page cannot be reached".into(), &error);
            }
        }
    }

    /// Asks for another slice, after whatever requests wait.
    fn schedule(&self) {
        if self.next.get() || !self.job.borrow().is_busy() {
            return;
        }
        if let Some(slice) = self.slice.borrow().as_ref() {
            let slice = slice.as_ref().unchecked_ref();
            let asked = self.scope.set_timeout_with_callback_and_timeout_and_arguments_0(slice, 0);
            self.next.set(asked.is_ok());
        }
    }
}

async fn decoded_model(file: Result<OpenedFile, OpenError>) -> Result<OpenedModel, OpenError> {
    let file = file?;
    let mut pictures = Vec::new();
    for texture in file.textures() {
        pictures.push(decoded::picture(&texture.bytes).await.inspect_err(web_sys::console::warn_1).ok());
    }
    file.model(&pictures)
}
