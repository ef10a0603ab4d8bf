//! The page's side of the mesh worker: starts it with the first request, hands its replies to whoever wants them.

use super::message::{Reply, Request};
use crate::words::t;
use crate::worker_script;
use js_sys::{Array, ArrayBuffer, Uint8Array};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker};

/// Address of the worker's script, relative to the page.
const WORKER_SCRIPT: &str = "./mesh_worker.js";

/// What is called with every reply.
type Handler = Rc<dyn Fn(&Reply)>;

/// The mesh worker as the page knows it. It is shared by the tools that work on the mesh.
#[derive(Default)]
pub struct MeshWorker {
    running: RefCell<Option<Running>>,
    handlers: Rc<RefCell<Vec<Handler>>>,
    /// Workers started so far.
    starts: Cell<u32>,
}

impl MeshWorker {
    /// Calls `handler` with every reply from now on, from the page's event loop.
    pub fn subscribe(&self, handler: impl Fn(&Reply) + 'static) {
        self.handlers.borrow_mut().push(Rc::new(handler));
    }

    /// Number of workers started so far: a new one knows nothing of what was sent to the one before.
    pub fn starts(&self) -> u32 {
        self.starts.get()
    }

    /// Starts a worker if there is none.
    ///
    /// # Errors
    /// Why it cannot be started, for people.
    pub fn start(&self) -> Result<(), String> {
        let mut running = self.running.borrow_mut();
        if running.is_none() {
            let started = Running::start(self.handlers.clone());
            *running = Some(started.map_err(|error| t!("mesh.cannot_start", error = format!("{error:?}")))?);
            self.starts.set(self.starts.get() + 1);
        }
        Ok(())
    }

    /// Sends a request, to a new worker if there is none.
    ///
    /// # Errors
    /// Why it cannot be sent, for people.
    pub fn send(&self, request: &Request) -> Result<(), String> {
        self.start()?;
        match self.running.borrow().as_ref().map(|running| running.send(request)) {
            Some(Err(error)) => Err(t!("mesh.not_reached", error = format!("{error:?}"))),
            _ => Ok(()),
        }
    }

    /// Ends the worker; the next request starts another.
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
    fn start(handlers: Rc<RefCell<Vec<Handler>>>) -> Result<Self, JsValue> {
        let worker = worker_script::start(WORKER_SCRIPT, "semascan-mesh", &[], &Array::new())?;
        let receivers = handlers.clone();
        let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
            let bytes = message.data().dyn_into::<ArrayBuffer>().map(|b| Uint8Array::new(&b).to_vec());
            let reply = Reply::decode(&bytes.unwrap_or_default()).unwrap_or_else(|e| Reply::Failed(e.to_string()));
            call(&receivers, &reply);
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |error: ErrorEvent| {
            let why = worker_script::reason(&error).unwrap_or_else(|| t!("mesh.not_loaded").to_owned());
            call(&handlers, &Reply::Failed(t!("mesh.worker_failed", why)));
        });
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        Ok(Self { worker, _on_message: on_message, _on_error: on_error })
    }

    fn send(&self, request: &Request) -> Result<(), JsValue> {
        let buffer = Uint8Array::from(request.encode().as_slice()).buffer();
        self.worker.post_message_with_transfer(&buffer, &Array::of1(&buffer))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}

/// Calls every handler; a handler may use the worker meanwhile.
fn call(handlers: &RefCell<Vec<Handler>>, reply: &Reply) {
    let handlers = handlers.borrow().clone();
    handlers.iter().for_each(|handler| handler(reply));
}
