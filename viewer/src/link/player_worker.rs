//! The worker's side of an inspection from a file: plays it, decodes, sends events to the page as if an agent were there.

use super::LinkEvent;
use super::player::Player;
use super::session::Session;
use super::worker::forward;
use crate::words::t;
use js_sys::Uint8Array;
use semascan_protocol::InspectionFile;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent};

struct PlayerWorker {
    scope: DedicatedWorkerGlobalScope,
    player: Player,
    session: Session,
    /// The stop that is wanted and not shown yet.
    wanted: Option<usize>,
}

/// Entry point of the worker's script: plays the inspection in `file`. Each number that the page sends then is a stop that it wants
/// to show. Never more is held than needs `memory` bytes of the page.
///
/// # Errors
/// Fails outside a dedicated worker, and for a file that is no inspection.
#[wasm_bindgen]
pub fn player_worker_start(file: Uint8Array, memory: f64) -> Result<(), JsValue> {
    console_error_panic_hook::set_once();
    let scope: DedicatedWorkerGlobalScope = js_sys::global().dyn_into()?;
    let file = InspectionFile::read(file.to_vec().into()).map_err(|error| JsValue::from_str(&error.to_string()))?;
    let (player, wrong) = Player::new(file.messages);
    if wrong > 0 {
        forward(&scope, &LinkEvent::Malformed { reason: t!("file.wrong", count = wrong) }, &[]);
    }
    let worker = PlayerWorker { scope: scope.clone(), player, session: Session::within(memory as u64), wanted: None };
    let worker = Rc::new(RefCell::new(worker));
    let shows = worker.clone();
    let show = Closure::<dyn FnMut()>::new(move || shows.borrow_mut().show()).into_js_value();
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |message: MessageEvent| {
        let Some(stop) = message.data().as_f64() else { return };
        let mut worker = worker.borrow_mut();
        // Who drags a slider asks for many stops: all that are there already are heard before one is shown.
        if worker.wanted.replace(stop as usize).is_none() {
            let later = worker.scope.set_timeout_with_callback(show.unchecked_ref());
            if let Err(error) = later {
                web_sys::console::error_1(&error);
            }
        }
    });
    // Lives as long as the worker does.
    scope.set_onmessage(Some(on_message.into_js_value().unchecked_ref()));
    Ok(())
}

impl PlayerWorker {
    fn show(&mut self) {
        let Some(stop) = self.wanted.take() else { return };
        for message in self.player.show(stop) {
            let event = self.session.receive(&message);
            if let Some(halvings) = self.session.take_halvings() {
                forward(&self.scope, &LinkEvent::Halved { halvings }, &[]);
            }
            if let Some(event) = event {
                forward(&self.scope, &event, &message);
            }
        }
    }
}
