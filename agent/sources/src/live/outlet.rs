//! Views between the thread that follows a stream and whoever inspects them.

use semascan_inspection::source::SourceError;
use semascan_perception::view::View;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Views that wait at most.
const MOST: usize = 32;

/// Where views wait.
#[derive(Debug, Default)]
pub(super) struct Outlet {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    views: VecDeque<Result<View, SourceError>>,
    pushed: u64,
    /// What the stream says of itself and nobody has heard yet.
    settings: Vec<(String, String)>,
    /// No more views come.
    has_ended: bool,
    /// Nobody wants more.
    is_over: bool,
}

/// What was found at an outlet.
#[derive(Debug)]
pub(super) enum Next {
    /// A view, or why it is none.
    View(Box<Result<View, SourceError>>),
    /// None within the time.
    Nothing,
    /// None will come.
    End,
}

impl Outlet {
    /// Puts a view in; `false` where there is no room.
    pub(super) fn push(&self, view: Result<View, SourceError>) -> bool {
        let mut state = self.lock();
        let has_room = state.views.len() < MOST;
        if has_room {
            state.pushed += 1;
            state.views.push_back(view);
        }
        drop(state);
        self.changed.notify_all();
        has_room
    }

    /// Views that were put in.
    pub(super) fn pushed(&self) -> u64 {
        self.lock().pushed
    }

    /// Whether no view waits.
    pub(super) fn is_empty(&self) -> bool {
        self.lock().views.is_empty()
    }

    /// Says something of the stream, as `key = value`.
    pub(super) fn tell(&self, settings: Vec<(String, String)>) {
        self.lock().settings.extend(settings);
    }

    /// What was said since this was asked last.
    pub(super) fn told(&self) -> Vec<(String, String)> {
        std::mem::take(&mut self.lock().settings)
    }

    /// No more views come.
    pub(super) fn end(&self) {
        self.lock().has_ended = true;
        self.changed.notify_all();
    }

    /// Nobody wants more.
    pub(super) fn close(&self) {
        self.lock().is_over = true;
    }

    /// Whether nobody wants more.
    pub(super) fn is_over(&self) -> bool {
        self.lock().is_over
    }

    /// The next view, which is waited for as long as `patience`.
    pub(super) fn next(&self, patience: Duration) -> Next {
        let is_waiting = |state: &mut State| state.views.is_empty() && !state.has_ended;
        let waited = self.changed.wait_timeout_while(self.lock(), patience, is_waiting);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.views.pop_front() {
            Some(view) => Next::View(Box::new(view)),
            None if state.has_ended => Next::End,
            None => Next::Nothing,
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics between two related writes.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
