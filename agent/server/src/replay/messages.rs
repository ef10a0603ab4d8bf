//! The messages of a past inspection, as a viewer that keeps up with it is sent them.

use super::tape::{Step, Tape};
use crate::live::{Cursor, LiveModel};
use crate::live_stream::apply;
use axum::body::Bytes;
use semascan_inspection::event::EventKind;
use semascan_protocol::{FileMessage, Hello};
use std::collections::BTreeSet;

/// The messages of a whole tape.
pub(super) fn of_tape(tape: &Tape) -> Vec<FileMessage> {
    let live = LiveModel::new();
    let mut listener = Listener::new(&live);
    let mut views = BTreeSet::new();
    let began = tape.steps.first().map(|step| step.event.time);
    for Step { event, attached } in &tape.steps {
        apply(&live, event, attached.clone());
        let since = began.and_then(|began| u64::try_from(event.time.duration_since(began).as_micros()).ok());
        // The clock may have been set back.
        listener.time = listener.time.max(since.unwrap_or_default());
        // A view is in the model before it is reported.
        if let EventKind::ModelChanged { view: Some(view), .. } = event.kind {
            views.insert(view);
        } else if let EventKind::ViewFinished { record, .. } = &event.kind {
            views.insert(record.index);
        }
        listener.views = views.len() as u32;
        listener.listen();
    }
    if !tape.remark.is_empty() {
        live.say(&tape.remark);
        listener.listen();
    }
    listener.messages
}

/// The messages of a model that is only shown as it ended.
pub(super) fn of_model(live: &LiveModel) -> Vec<FileMessage> {
    let mut listener = Listener::new(live);
    listener.views = live.progress().views_done;
    listener.listen();
    listener.messages
}

/// A viewer that takes everything at once.
struct Listener<'a> {
    live: &'a LiveModel,
    cursor: Cursor,
    /// Microseconds since the beginning.
    time: u64,
    /// Views that have begun to show.
    views: u32,
    messages: Vec<FileMessage>,
}

impl<'a> Listener<'a> {
    fn new(live: &'a LiveModel) -> Self {
        let (cursor, welcome) = live.welcome(&Hello::default());
        let mut listener = Self { live, cursor, time: 0, views: 0, messages: Vec::new() };
        listener.take(welcome);
        listener
    }

    fn listen(&mut self) {
        while let Some(message) = self.live.next(&mut self.cursor) {
            self.take(message);
        }
    }

    fn take(&mut self, message: Bytes) {
        self.messages.push(FileMessage { microseconds: self.time, views: self.views, message });
    }
}
