//! Views that are planned: between two views the planner is asked with the model so far, what it decides is published, and the
//! source is sent there.

use crate::bus::EventBus;
use crate::event::{EventKind, SharedModel};
use crate::planning::{Decision, NextView, ViewPlanner, Viewpoint};
use crate::record::pose_record;
use semascan_model::record::PlannedView;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Instant;

/// A planner at work.
pub(super) struct Plan<'a> {
    planner: Box<dyn ViewPlanner>,
    events: &'a EventBus,
    orders: SyncSender<Viewpoint>,
    /// Views that were asked for.
    asked: u32,
}

impl<'a> Plan<'a> {
    /// `planner`, and where the source gets its orders from.
    pub(super) fn new(planner: Box<dyn ViewPlanner>, events: &'a EventBus) -> (Self, Receiver<Viewpoint>) {
        let (orders, ordered) = sync_channel(1);
        (Self { planner, events, orders, asked: 0 }, ordered)
    }

    /// Asks for the next view; `None` after the last, or where nobody takes views any more.
    pub(super) fn ask(mut self, model: Option<&SharedModel>) -> Option<Self> {
        let begun = Instant::now();
        let decision = self.planner.next(model.map(SharedModel::read).as_deref());
        let seconds = begun.elapsed().as_secs_f64();
        let NextView { viewpoint, purpose, expected, candidates } = match decision {
            Decision::Capture(next) => *next,
            Decision::Stop { why, coverage } => {
                self.events.publish(EventKind::PlanEnded { why, coverage });
                return None;
            }
        };
        let view = PlannedView {
            view: self.asked,
            purpose,
            table_from_camera: pose_record(&viewpoint.table_from_camera()),
            table_angle: viewpoint.table_angle,
            expected,
            candidates,
            seconds,
        };
        self.events.publish(EventKind::Planned { view: Box::new(view) });
        self.asked += 1;
        self.orders.send(viewpoint).is_ok().then_some(self)
    }
}
