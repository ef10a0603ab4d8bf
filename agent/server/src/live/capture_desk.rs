//! Who asks for a view of the running inspection, and whether somebody can be asked.

use semascan_inspection::source::CaptureTrigger;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Requests that are remembered: one that is sent again asks for nothing more.
const MOST_KNOWN: usize = 256;

/// What became of a request for a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CaptureAnswer {
    /// It was taken in, now or before; so many wait.
    Taken {
        /// Requests that no view has answered yet, this one among them.
        waiting: usize,
    },
    /// This inspection does not run.
    NotRunning,
    /// Its source gives views when it does, and not when it is asked to.
    NotAsked,
    /// Too many wait.
    TooMany,
}

/// Takes requests for views of the running inspection.
#[derive(Debug, Default)]
pub(super) struct CaptureDesk(Mutex<Option<Running>>);

#[derive(Debug)]
struct Running {
    inspection: String,
    trigger: Option<CaptureTrigger>,
    /// Identifiers of the latest requests.
    known: VecDeque<String>,
}

impl CaptureDesk {
    /// An inspection runs, which `trigger` asks for views where it can be asked.
    pub(super) fn open(&self, inspection: String, trigger: Option<CaptureTrigger>) {
        *self.lock() = Some(Running { inspection, trigger, known: VecDeque::new() });
    }

    /// None runs any more.
    pub(super) fn close(&self) {
        *self.lock() = None;
    }

    /// Asks for a view of `inspection`; `id` was made by who asks.
    pub(super) fn ask(&self, inspection: &str, id: &str) -> CaptureAnswer {
        let mut running = self.lock();
        let Some(running) = running.as_mut().filter(|running| running.inspection == inspection) else {
            return CaptureAnswer::NotRunning;
        };
        let Some(trigger) = &running.trigger else { return CaptureAnswer::NotAsked };
        if !running.known.iter().any(|known| known == id) {
            if !trigger.ask() {
                return CaptureAnswer::TooMany;
            }
            if running.known.len() == MOST_KNOWN {
                running.known.pop_front();
            }
            running.known.push_back(id.to_owned());
        }
        CaptureAnswer::Taken { waiting: trigger.waiting() }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Running>> {
        // Nothing panics between two related writes.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn a_request_that_is_sent_twice_asks_once_and_who_cannot_be_asked_says_so() {
        let (desk, trigger) = (CaptureDesk::default(), CaptureTrigger::default());
        assert_eq!(desk.ask("a", "1"), CaptureAnswer::NotRunning);
        desk.open("a".into(), None);
        assert_eq!(desk.ask("a", "1"), CaptureAnswer::NotAsked);
        desk.open("a".into(), Some(trigger.clone()));
        assert_eq!(desk.ask("b", "1"), CaptureAnswer::NotRunning);
        assert_eq!(desk.ask("a", "1"), CaptureAnswer::Taken { waiting: 1 });
        assert_eq!(desk.ask("a", "1"), CaptureAnswer::Taken { waiting: 1 });
        assert!(trigger.is_answered_at(Instant::now()));
        assert_eq!(desk.ask("a", "1"), CaptureAnswer::Taken { waiting: 0 }, "it was answered");
        let answers = (0..100).map(|number| desk.ask("a", &format!("n{number}")));
        assert!(answers.last().is_some_and(|last| last == CaptureAnswer::TooMany));
        desk.close();
        assert_eq!(desk.ask("a", "2"), CaptureAnswer::NotRunning);
    }
}
