//! Shows the stops that the timeline comes to, and plays on.

use super::TimelineEvent;
use crate::display::Representation;
use crate::features::FeatureEvent;
use crate::features::mesh::MeshEvent;
use crate::features::view::{Controller, Host};
use crate::scene::ModelChange;
use crate::ui::Command;
use leptos::prelude::set_timeout;
use std::cell::Cell;
use std::rc::{Rc, Weak};
use std::time::Duration;

/// How long a stop is shown while it plays.
const PACE: Duration = Duration::from_millis(700);
/// How long the model rests before its mesh is made anew.
const REST: Duration = Duration::from_millis(400);

pub(super) struct TimelineController {
    host: Host,
    /// The stop that was asked for last.
    asked: Cell<Option<usize>>,
    /// Counts the times that the person began or ended playing, and the changes of the model: a timer of before is void.
    plays: Cell<u64>,
    changes: Cell<u64>,
    this: Weak<Self>,
}

impl TimelineController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self {
            host: host.clone(),
            asked: Cell::default(),
            plays: Cell::default(),
            changes: Cell::default(),
            this: this.clone(),
        })
    }

    fn show(&self) {
        let at = self.host.ui.read(|s| s.features.timeline.is_open().then_some(s.features.timeline.at));
        if let Some(at) = at.filter(|at| self.asked.replace(Some(*at)) != Some(*at)) {
            self.host.ui.ask(Command::ShowStop(at as u32));
        }
    }

    /// Goes on to the next stop after a while, if it still plays by then.
    fn play_on(&self) {
        let (weak, play) = (self.this.clone(), self.plays.get());
        let go_on = move || {
            if let Some(this) = weak.upgrade().filter(|this| this.plays.get() == play) {
                this.host.ui.send_feature(TimelineEvent::Advanced);
            }
        };
        set_timeout(go_on, PACE);
    }

    /// Has the mesh made anew, where one is shown, once the model is at rest.
    fn remesh(&self) {
        self.changes.set(self.changes.get() + 1);
        let (weak, change) = (self.this.clone(), self.changes.get());
        let make = move || {
            let Some(this) = weak.upgrade().filter(|this| this.changes.get() == change) else { return };
            let is_due = this.host.ui.read(|s| {
                let is_shown = s.display.representation == Representation::Mesh;
                is_shown && s.has_model() && s.features.mesh.is_wanted()
            });
            if is_due {
                this.host.ui.send_feature(MeshEvent::Requested);
            }
        };
        set_timeout(make, REST);
    }
}

impl Controller for TimelineController {
    fn handle(&self, event: &FeatureEvent) {
        let FeatureEvent::Timeline(event) = event else { return };
        match event {
            TimelineEvent::Requested => self.host.ui.ask(Command::PlayInspection),
            TimelineEvent::NotLoaded => {}
            TimelineEvent::Loaded(_) | TimelineEvent::Closed => self.asked.set(None),
            TimelineEvent::To(_) | TimelineEvent::Step(_) | TimelineEvent::Play(_) => {
                self.plays.set(self.plays.get() + 1);
            }
            TimelineEvent::Advanced => {}
        }
        self.show();
        let is_next = matches!(event, TimelineEvent::Play(_) | TimelineEvent::Advanced);
        if is_next && self.host.ui.read(|s| s.features.timeline.is_playing) {
            self.play_on();
        }
    }

    fn model_changed(&self, change: ModelChange) {
        if change != ModelChange::None && self.host.ui.read(|s| s.features.timeline.is_open()) {
            self.remesh();
        }
    }
}
