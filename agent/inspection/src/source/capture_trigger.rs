//! Asking for a view: a person, a program or a robot says "now", and a source that streams takes the next picture that begins to
//! come after that.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Requests that may wait. More than that are no requests of people and robots.
const MOST_WAITING: usize = 64;

/// Asks a source for views. All clones of a trigger are the same one.
#[derive(Clone, Debug, Default)]
pub struct CaptureTrigger(Arc<Mutex<VecDeque<Instant>>>);

impl CaptureTrigger {
    /// Asks for a view; `false` where so many were asked for and not taken that this one is not taken note of.
    pub fn ask(&self) -> bool {
        self.ask_from(Instant::now())
    }

    /// As [`ask`](Self::ask), of one that was asked for at `asked`: a message that came then and is only read now.
    pub fn ask_from(&self, asked: Instant) -> bool {
        let mut waiting = self.lock();
        let has_room = waiting.len() < MOST_WAITING;
        if has_room {
            waiting.push_back(asked);
        }
        has_room
    }

    /// Whether a view was asked for before `arrived`, when the picture at hand came. It then answers the oldest request, which
    /// waits no longer. This is what sources ask.
    pub fn is_answered_at(&self, arrived: Instant) -> bool {
        let mut waiting = self.lock();
        let is_answered = waiting.front().is_some_and(|asked| *asked <= arrived);
        if is_answered {
            waiting.pop_front();
        }
        is_answered
    }

    /// Requests that are not answered yet.
    pub fn waiting(&self) -> usize {
        self.lock().len()
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<Instant>> {
        // Nothing panics between two related writes.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_answers_one_request_of_before_it_came() {
        let trigger = CaptureTrigger::default();
        let before = Instant::now();
        assert!(!trigger.is_answered_at(before), "nothing was asked for");
        assert!(trigger.ask() && trigger.clone().ask());
        assert!(!trigger.is_answered_at(before.checked_sub(std::time::Duration::from_secs(1)).unwrap_or(before)));
        let after = Instant::now();
        assert!(trigger.is_answered_at(after) && trigger.waiting() == 1);
        assert!(trigger.is_answered_at(after) && !trigger.is_answered_at(after));
        assert_eq!((0..100).filter(|_| trigger.ask()).count(), MOST_WAITING);
    }
}
