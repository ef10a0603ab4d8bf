//! Stage events as they came, the latest ones, for clients that come later or lag.
//!
//! What a view's report says is not kept beside it: only the events of views under way, and the failures.

use super::state::pack;
use axum::body::Bytes;
use semascan_protocol::server_message::Body;
use semascan_protocol::{StageEvent, StageState};
use std::collections::VecDeque;

/// Events that are kept; the oldest go first.
const KEPT: usize = 512;

#[derive(Debug)]
struct Kept {
    place: u64,
    view: u32,
    failure: bool,
    message: Bytes,
}

/// The latest events in their order.
#[derive(Debug, Default)]
pub(super) struct StageLog {
    latest: u64,
    events: VecDeque<Kept>,
}

impl StageLog {
    pub(super) fn put(&mut self, event: StageEvent) {
        if self.events.len() == KEPT {
            self.events.pop_front();
        }
        self.latest += 1;
        let (view, failure) = (event.view, event.state() == StageState::Failed);
        self.events.push_back(Kept { place: self.latest, view, failure, message: pack(Body::Stage(event)) });
    }

    /// A report says what became of view `view`.
    pub(super) fn reported(&mut self, view: u32) {
        self.events.retain(|e| e.view != view || e.failure);
    }

    /// The next event after place `place`, and its place.
    pub(super) fn after(&self, place: u64) -> Option<(u64, Bytes)> {
        let next = self.events.partition_point(|e| e.place <= place);
        self.events.get(next).map(|e| (e.place, e.message.clone()))
    }
}
