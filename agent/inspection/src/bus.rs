//! From one inspection to all who follow it: every subscriber gets every event, in order.
//!
//! Each subscriber has a queue of [`QUEUE`] events. One that falls that far behind holds the inspection up until it has
//! caught up: no event is ever lost, memory stays bounded (the queue, and the few views whose pictures its events carry),
//! and the price of a slow subscriber is a slower inspection. One that is dropped costs nothing any more.

use crate::event::{EventKind, InspectionEvent};
use crate::journal::{Journal, Trouble};
use crate::stop::StopSwitch;
use jiff::Timestamp;
use semascan_model::InspectionId;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Events that a subscriber may be behind.
pub const QUEUE: usize = 32;

/// How long after a failure it is tried again to keep an event.
const PAUSE: Duration = Duration::from_millis(200);

/// Numbers events and hands them to the subscribers.
pub(crate) struct EventBus {
    inspection: InspectionId,
    state: Mutex<State>,
    /// Once it is set, nothing that cannot be kept is waited for any longer.
    stop: StopSwitch,
}

#[derive(Default)]
struct State {
    next: u64,
    subscribers: Vec<SyncSender<Arc<InspectionEvent>>>,
    journal: Option<Journal>,
    told: Option<Trouble>,
}

impl EventBus {
    pub(crate) fn new(inspection: InspectionId) -> Self {
        Self { inspection, state: Mutex::default(), stop: StopSwitch::default() }
    }

    /// What ends the inspection early.
    pub(crate) fn stop_switch(&self) -> &StopSwitch {
        &self.stop
    }

    /// From now on views are acknowledged when `journal` has them on the disk; `told` learns of what keeps it from that,
    /// and of nothing (an empty text) when that is over.
    pub(crate) fn keep(&self, journal: Journal, told: Trouble) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.next = journal.next();
        state.journal = Some(journal);
        state.told = Some(told);
    }

    pub(crate) fn subscribe(&self) -> Events {
        let (sender, receiver) = sync_channel(QUEUE);
        self.state.lock().unwrap_or_else(PoisonError::into_inner).subscribers.push(sender);
        Events(receiver)
    }

    /// Publishes an event; waits for subscribers whose queues are full, and for the disk where the inspection is kept. A view
    /// that cannot be kept by the time the inspection is stopped is acknowledged to nobody.
    pub(crate) fn publish(&self, kind: EventKind) {
        // Stages run on threads of their own: the lock keeps number, time and order of delivery alike for everybody.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let event = InspectionEvent { inspection: self.inspection, sequence: state.next, time: Timestamp::now(), kind };
        state.next += 1;
        if !self.is_kept(&mut state, &event) {
            return;
        }
        let event = Arc::new(event);
        state.subscribers.retain(|subscriber| subscriber.send(Arc::clone(&event)).is_ok());
    }

    /// Makes the event durable where the inspection is kept. `false` says that a view could not be.
    fn is_kept(&self, state: &mut State, event: &InspectionEvent) -> bool {
        let State { journal: Some(journal), told, .. } = state else { return true };
        if !journal.take(event) {
            return true;
        }
        let tell = |text: &str| told.iter().for_each(|told| told(text));
        let mut failures = 0;
        loop {
            match journal.commit() {
                Ok(()) => {
                    if failures > 0 {
                        tell("");
                    }
                    return true;
                }
                Err(error) => {
                    failures += 1;
                    if failures == 1 {
                        tell(&format!("what is inspected cannot be kept: {error}; the inspection waits"));
                    }
                    if self.stop.is_set() {
                        // The end is told in any case; the catalogue goes on saying `running`.
                        return !matches!(event.kind, EventKind::ViewFinished { .. });
                    }
                    std::thread::sleep(PAUSE);
                }
            }
        }
    }
}

/// The events of one inspection from its beginning to its end.
#[derive(Debug)]
pub struct Events(Receiver<Arc<InspectionEvent>>);

impl Iterator for Events {
    type Item = Arc<InspectionEvent>;

    /// Waits for the next event; `None` after the last.
    fn next(&mut self) -> Option<Self::Item> {
        self.0.recv().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::StageStatus;
    use semascan_model::record::{Outcome, Stage};

    fn bus() -> EventBus {
        EventBus::new(InspectionId::new(1, &[0; 10]))
    }

    fn started(view: u32) -> EventKind {
        EventKind::Stage { view, stage: Stage::Acquire, status: StageStatus::Started }
    }

    #[test]
    fn everybody_gets_everything_in_order_and_then_the_end() {
        let bus = bus();
        let subscribers = [bus.subscribe(), bus.subscribe()];
        std::thread::scope(|scope| {
            let all = subscribers.map(|s| scope.spawn(move || s.map(|e| e.sequence).collect::<Vec<_>>()));
            std::thread::scope(|publishers| {
                (0..4).for_each(|view| {
                    drop(publishers.spawn({
                        let bus = &bus;
                        move || (0..50).for_each(|_| bus.publish(started(view)))
                    }))
                });
            });
            bus.publish(EventKind::Ended { outcome: Outcome::Finished });
            drop(bus);
            for numbers in all {
                assert_eq!(numbers.join().expect("no panic"), (0..201).collect::<Vec<_>>());
            }
        });
    }

    #[test]
    fn a_slow_subscriber_holds_up_and_one_that_left_does_not() {
        let bus = bus();
        let (slow, gone) = (bus.subscribe(), bus.subscribe());
        drop(gone);
        std::thread::scope(|scope| {
            let publisher = scope.spawn(|| (0..QUEUE as u32 + 1).for_each(|view| bus.publish(started(view))));
            std::thread::sleep(Duration::from_millis(100));
            assert!(!publisher.is_finished(), "the queue is full");
            assert_eq!(slow.0.recv().map(|e| e.sequence), Ok(0));
            publisher.join().expect("goes on");
        });
    }
}
