//! The worker's side of the link: owns the WebSocket, decodes, sends events to the page.
//!
//! One [`Worker`] lives as long as the worker thread; the handlers of the scope and of the present socket and timer share
//! it. Replacing the socket or the timer drops their handlers, so nothing late can reach a newer connection.

use super::reconnect::{Action, Reconnect, WELCOME_TIMEOUT_MS, protocol_mismatch};
use super::session::Session;
use super::{LinkEvent, refusal, transfer};
use crate::words::t;
use js_sys::{Array, ArrayBuffer, Uint8Array};
use prost::Message;
use semascan_protocol::SUBPROTOCOL;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{BinaryType, CloseEvent, DedicatedWorkerGlobalScope, Event, MessageEvent, WebSocket};

/// Entry point of the worker's script: connects to `url`, stays connected and never holds more than needs `memory` bytes.
///
/// # Errors
/// Fails outside a dedicated worker.
#[wasm_bindgen]
pub fn link_worker_start(url: String, memory: f64) -> Result<(), JsValue> {
    console_error_panic_hook::set_once();
    let scope: DedicatedWorkerGlobalScope = js_sys::global().dyn_into()?;
    let (reconnect, first) = Reconnect::start();
    let session = Session::within(memory as u64);
    let worker = Worker { scope: scope.clone(), url, session, reconnect, socket: None, timer: None };
    let shared = Rc::new(RefCell::new(worker));
    let this = shared.clone();
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
        if let Some(before) = message.data().as_f64() {
            this.borrow().ask_earlier_views(before as u32);
        }
    });
    // Lives as long as the worker does.
    scope.set_onmessage(Some(on_message.into_js_value().unchecked_ref()));
    let this = shared.clone();
    // The socket itself only fails; that its address was forbidden is told to the scope.
    let on_violation = Closure::<dyn FnMut(Event)>::new(move |_: Event| {
        let reason = refusal::forbidden_by_own_server(&this.borrow().url);
        this.borrow_mut().refuse(reason);
    });
    let on_violation = on_violation.into_js_value();
    scope.add_event_listener_with_callback("securitypolicyviolation", on_violation.unchecked_ref())?;
    follow(&shared, first);
    Ok(())
}

type Shared = Rc<RefCell<Worker>>;

struct Worker {
    scope: DedicatedWorkerGlobalScope,
    url: String,
    session: Session,
    reconnect: Reconnect,
    socket: Option<Socket>,
    timer: Option<Timer>,
}

impl Worker {
    /// Sends the page an event of the worker's own.
    fn send(&self, event: &LinkEvent) {
        self.forward(event, &[]);
    }

    /// Sends the page the event that a message of the agent comes to.
    fn forward(&self, event: &LinkEvent, message: &[u8]) {
        forward(&self.scope, event, message);
    }

    fn refuse(&mut self, reason: String) {
        self.reconnect.stop();
        self.socket = None;
        self.timer = None;
        self.send(&LinkEvent::Refused { reason });
    }

    fn send_hello(&mut self) {
        let Some(socket) = &self.socket else { return };
        if let Some(reason) = protocol_mismatch(&socket.socket.protocol()) {
            return self.refuse(reason);
        }
        // A send can only fail on a socket that is not open, and then its close event follows.
        let _ = socket.socket.send_with_u8_array(&self.session.hello().encode_to_vec());
    }

    fn ask_earlier_views(&self, before: u32) {
        if let Some(socket) = self.socket.as_ref().filter(|_| self.session.is_welcomed()) {
            // A send can only fail on a socket that is not open, and then its close event follows.
            let _ = socket.socket.send_with_u8_array(&Session::earlier_views(before).encode_to_vec());
        }
    }

    fn receive(&mut self, data: &JsValue) {
        let Some(buffer) = data.dyn_ref::<ArrayBuffer>() else {
            return self.send(&LinkEvent::Malformed { reason: t!("link.text_message").to_owned() });
        };
        let message = Uint8Array::new(buffer).to_vec();
        let Some(event) = self.session.receive(&message) else {
            return;
        };
        if let Some(halvings) = self.session.take_halvings() {
            self.send(&LinkEvent::Halved { halvings });
        }
        if let LinkEvent::Refused { reason } = event {
            return self.refuse(reason);
        }
        if self.session.is_welcomed() && !self.reconnect.is_live() {
            self.reconnect.welcomed();
            self.timer = None;
        }
        self.forward(&event, &message);
    }
}

/// Does what the state machine says.
fn follow(shared: &Shared, action: Action) {
    match action {
        Action::Connect { attempt } => {
            shared.borrow().send(&LinkEvent::Connecting { attempt });
            let url = shared.borrow().url.clone();
            match Socket::open(&url, shared) {
                Ok(socket) => {
                    let this = shared.clone();
                    let timer = Timer::start(&shared.borrow().scope, WELCOME_TIMEOUT_MS, move || {
                        lose(&this, t!("link.no_answer"));
                    });
                    let mut worker = shared.borrow_mut();
                    worker.socket = Some(socket);
                    worker.timer = timer.ok();
                }
                Err(error) => {
                    web_sys::console::error_1(&error);
                    shared.borrow_mut().refuse(refusal::forbidden_by_browser(&url));
                }
            }
        }
        Action::Wait { ms } => {
            let this = shared.clone();
            let timer = Timer::start(&shared.borrow().scope, ms, move || {
                let action = this.borrow_mut().reconnect.timer_fired();
                follow(&this, action);
            });
            let mut worker = shared.borrow_mut();
            match timer {
                Ok(timer) => worker.timer = Some(timer),
                Err(error) => {
                    web_sys::console::error_1(&error);
                    worker.refuse(t!("link.no_timer").to_owned());
                }
            }
        }
        Action::Nothing => {}
    }
}

/// Sends the page an event.
///
/// * `message`: what the agent sent, where the event comes of that.
pub(super) fn forward(scope: &DedicatedWorkerGlobalScope, event: &LinkEvent, message: &[u8]) {
    let buffer = Uint8Array::from(transfer::encode(event, message).as_slice()).buffer();
    if let Err(error) = scope.post_message_with_transfer(&buffer, &Array::of1(&buffer)) {
        web_sys::console::error_2(&"semascan: the page cannot be reached".into(), &error);
    }
}

/// The connection is gone: drops the socket, tells the page, waits.
fn lose(shared: &Shared, reason: &str) {
    let action = {
        let mut worker = shared.borrow_mut();
        let action = worker.reconnect.closed(js_sys::Math::random() as f32);
        if let Action::Wait { ms } = action {
            worker.socket = None;
            worker.send(&LinkEvent::Disconnected { reason: reason.to_owned(), retry_ms: ms });
        }
        action
    };
    follow(shared, action);
}

/// A socket and its handlers; dropping it closes the socket silently.
struct Socket {
    socket: WebSocket,
    _on_open: Closure<dyn FnMut(Event)>,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_close: Closure<dyn FnMut(CloseEvent)>,
}

impl Socket {
    fn open(url: &str, shared: &Shared) -> Result<Self, JsValue> {
        let socket = WebSocket::new_with_str(url, SUBPROTOCOL)?;
        socket.set_binary_type(BinaryType::Arraybuffer);
        let this = shared.clone();
        let on_open = Closure::<dyn FnMut(Event)>::new(move |_| this.borrow_mut().send_hello());
        let this = shared.clone();
        let on_message =
            Closure::<dyn FnMut(MessageEvent)>::new(move |m: MessageEvent| this.borrow_mut().receive(&m.data()));
        let this = shared.clone();
        // A failed connection fires `error` without any detail and then `close`: one handler is enough.
        let on_close = Closure::<dyn FnMut(CloseEvent)>::new(move |event: CloseEvent| {
            let reason = close_reason(&event, &this.borrow());
            lose(&this, &reason);
        });
        socket.set_onopen(Some(on_open.as_ref().unchecked_ref()));
        socket.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        socket.set_onclose(Some(on_close.as_ref().unchecked_ref()));
        Ok(Self { socket, _on_open: on_open, _on_message: on_message, _on_close: on_close })
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        self.socket.set_onopen(None);
        self.socket.set_onmessage(None);
        self.socket.set_onclose(None);
        // Closing a socket that is already closed changes nothing.
        let _ = self.socket.close();
    }
}

fn close_reason(event: &CloseEvent, worker: &Worker) -> String {
    let location = worker.scope.location();
    match (event.reason(), event.code()) {
        (reason, _) if !reason.is_empty() => reason,
        (_, 1000 | 1001) => t!("link.ended").to_owned(),
        (_, 1006) => refusal::not_reached(&worker.url, &location.host(), &location.origin()),
        (_, code) => t!("link.ended_with", code),
    }
}

/// A timeout that is cancelled by dropping it.
struct Timer {
    scope: DedicatedWorkerGlobalScope,
    id: i32,
    _on_time: Closure<dyn FnMut()>,
}

impl Timer {
    fn start(scope: &DedicatedWorkerGlobalScope, ms: u32, on_time: impl FnMut() + 'static) -> Result<Self, JsValue> {
        let on_time = Closure::<dyn FnMut()>::new(on_time);
        let id =
            scope.set_timeout_with_callback_and_timeout_and_arguments_0(on_time.as_ref().unchecked_ref(), ms as i32)?;
        Ok(Self { scope: scope.clone(), id, _on_time: on_time })
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        self.scope.clear_timeout_with_handle(self.id);
    }
}
