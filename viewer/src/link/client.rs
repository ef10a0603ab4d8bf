//! The page's side of the link: starts the worker, turns what it sends into [`LinkEvent`]s.

use super::{LinkEvent, transfer};
use crate::words::{hand_over, t};
use js_sys::{ArrayBuffer, Object, Reflect, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker, WorkerOptions, WorkerType};

/// Address of the worker's script, relative to the page.
const WORKER_SCRIPT: &str = "./link_worker.js";

/// A live link; it reconnects by itself until it is closed or dropped.
pub struct Link {
    worker: Worker,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut(ErrorEvent)>,
}

impl Link {
    /// Connects to `url` (`ws://host/..` or `wss://host/..`); `on_event` is called from the page's event loop, never from
    /// inside this call.
    ///
    /// # Errors
    /// What the browser says when it cannot start a worker.
    pub fn start(url: &str, on_event: impl FnMut(LinkEvent) + 'static) -> Result<Self, JsValue> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        options.set_name("semascan-link");
        let worker = Worker::new_with_options(WORKER_SCRIPT, &options)?;

        let sink = std::rc::Rc::new(std::cell::RefCell::new(on_event));
        let on_event = sink.clone();
        let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
            let bytes =
                message.data().dyn_into::<ArrayBuffer>().map(|b| Uint8Array::new(&b).to_vec()).unwrap_or_default();
            let event =
                transfer::decode(&bytes).unwrap_or_else(|error| LinkEvent::Malformed { reason: error.to_string() });
            (on_event.borrow_mut())(event);
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |error: ErrorEvent| {
            // A script that does not load comes without a message; the browser logs what there is to say.
            let why = Reflect::get(&error, &"message".into()).ok().and_then(|m| m.as_string()).unwrap_or_default();
            let reason = if why.is_empty() { t!("link.not_loaded") } else { t!("link.stopped") }.to_owned();
            (sink.borrow_mut())(LinkEvent::Broken { reason });
        });
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));

        let start = Object::new();
        Reflect::set(&start, &"url".into(), &url.into())?;
        Reflect::set(&start, &"module".into(), &wasm_bindgen::module())?;
        hand_over(&start)?;
        worker.post_message(&start)?;
        Ok(Self { worker, _on_message: on_message, _on_error: on_error })
    }

    /// What asks the agent for more, wherever the link itself is kept.
    pub fn inquiry(&self) -> Inquiry {
        Inquiry { worker: self.worker.clone() }
    }

    /// Ends the link. No event follows.
    pub fn close(self) {}
}

/// Asks the agent for what it does not send by itself.
#[derive(Clone)]
pub struct Inquiry {
    worker: Worker,
}

impl Inquiry {
    /// Asks for the reports of views before view `before`; they come as any other.
    ///
    /// # Errors
    /// What the browser says when the worker cannot be reached.
    pub fn earlier_views(&self, before: u32) -> Result<(), JsValue> {
        self.worker.post_message(&before.into())
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}
