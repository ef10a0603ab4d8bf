//! The page's side of the mesh worker: starts it, gives it orders, hears what it says.

use super::message::{Order, Reply};
use js_sys::{Array, ArrayBuffer, Object, Reflect, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker, WorkerOptions, WorkerType};

/// Address of the worker's script, relative to the page.
const WORKER_SCRIPT: &str = "./mesher.js";

/// A running mesh worker; dropping it ends the worker.
pub struct MeshWorker {
    worker: Worker,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut(ErrorEvent)>,
}

impl MeshWorker {
    /// Starts a worker; `on_reply` is called from the page's event loop.
    ///
    /// # Errors
    /// What the browser says when it cannot start a worker.
    pub fn start(on_reply: impl FnMut(Reply) + 'static) -> Result<Self, JsValue> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        options.set_name("semascan-mesher");
        let worker = Worker::new_with_options(WORKER_SCRIPT, &options)?;
        let sink = std::rc::Rc::new(std::cell::RefCell::new(on_reply));
        let on_reply = sink.clone();
        let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
            let bytes = message.data().dyn_into::<ArrayBuffer>().map(|b| Uint8Array::new(&b).to_vec());
            let reply = Reply::decode(&bytes.unwrap_or_default()).unwrap_or_else(|e| Reply::Failed(e.to_string()));
            (on_reply.borrow_mut())(reply);
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |error: ErrorEvent| {
            // A script that does not load comes without a message.
            let why = Reflect::get(&error, &"message".into()).ok().and_then(|m| m.as_string()).unwrap_or_default();
            let why = if why.is_empty() { "it did not load" } else { &why };
            (sink.borrow_mut())(Reply::Failed(format!("the mesh worker failed: {why}")));
        });
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        let start = Object::new();
        Reflect::set(&start, &"module".into(), &wasm_bindgen::module())?;
        worker.post_message(&start)?;
        Ok(Self { worker, _on_message: on_message, _on_error: on_error })
    }

    /// Gives an order.
    ///
    /// # Errors
    /// What the browser says when the worker cannot be reached.
    pub fn tell(&self, order: Order) -> Result<(), JsValue> {
        let buffer = Uint8Array::from(order.encode().as_slice()).buffer();
        self.worker.post_message_with_transfer(&buffer, &Array::of1(&buffer))
    }
}

impl Drop for MeshWorker {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}
