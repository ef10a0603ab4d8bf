//! The page's side of the link: starts the worker, turns what it sends into [`LinkEvent`]s.

use super::{LinkEvent, transfer};
use crate::device::{Memory, memory};
use crate::words::t;
use crate::worker_script;
use js_sys::{Array, ArrayBuffer, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker};

/// Address of the worker's script, relative to the page.
const WORKER_SCRIPT: &str = "./link_worker.js";

/// Memory that the page may need for the points of a model, bytes, by what the device has. While a model is exchanged for that of a
/// new epoch the page holds both, and it has 4 GB. A phone holds half a million points, a large computer twenty million.
fn most_bytes() -> f64 {
    match memory() {
        Memory::Small => 1e8,
        Memory::Usual => 1.2e9,
        Memory::Large => 3e9,
    }
}

/// A link to an agent, which reconnects by itself, or to an inspection in a file. It lasts until it is dropped.
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
        Self::begin("url", &url.into(), on_event)
    }

    /// Plays the inspection in `file`, a whole `.semascan` file; nothing is shown before [`Self::show`].
    ///
    /// # Errors
    /// As of [`Self::start`].
    pub fn play(file: &ArrayBuffer, on_event: impl FnMut(LinkEvent) + 'static) -> Result<Self, JsValue> {
        Self::begin("file", file, on_event)
    }

    fn begin(what: &str, value: &JsValue, on_event: impl FnMut(LinkEvent) + 'static) -> Result<Self, JsValue> {
        let memory = most_bytes().into();
        let values = [(what, value), ("memory", &memory)];
        let worker = worker_script::start(WORKER_SCRIPT, "semascan-link", &values, &Array::new())?;
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
            let is_loaded = worker_script::reason(&error).is_some();
            let reason = if is_loaded { t!("link.stopped") } else { t!("link.not_loaded") }.to_owned();
            (sink.borrow_mut())(LinkEvent::Broken { reason });
        });
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        Ok(Self { worker, _on_message: on_message, _on_error: on_error })
    }

    /// Asks the agent for the reports of views before view `before`; they come as any other.
    ///
    /// # Errors
    /// What the browser says when the worker cannot be reached.
    pub fn earlier_views(&self, before: u32) -> Result<(), JsValue> {
        self.worker.post_message(&before.into())
    }

    /// Shows the inspection in a file as it stood at a stop; what leads there comes as from an agent.
    ///
    /// # Errors
    /// What the browser says when the worker cannot be reached.
    pub fn show(&self, stop: u32) -> Result<(), JsValue> {
        self.worker.post_message(&stop.into())
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}
