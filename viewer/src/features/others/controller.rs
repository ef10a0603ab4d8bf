//! Tells the agent where this person points: what was picked, or where the mouse rests. A page that is alone asks now and then whether it
//! still is.

use super::OthersEvent;
use crate::features::FeatureEvent;
use crate::features::inspect::InspectEvent;
use crate::features::review::new_name;
use crate::features::view::{Controller, Host};
use leptos::prelude::set_timeout;
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::rc::{Rc, Weak};
use std::time::Duration;
use wasm_bindgen_futures::spawn_local;

/// Least time between two places that are told, and how long a page that is alone says nothing, milliseconds.
const PAUSE: f64 = 250.0;
const ALONE: f64 = 10_000.0;
/// Letters of a person's name that others are told.
const PERSON: usize = 100;

#[derive(Serialize)]
struct Pointing {
    viewer: String,
    person: String,
    position: [f32; 3],
}

#[derive(Deserialize)]
struct PointingTold {
    others: u32,
}

/// See the module.
pub(super) struct OthersController {
    host: Host,
    /// When a place was told last (`Date.now`), and whether nobody else was there.
    told_at: Cell<f64>,
    is_alone: Cell<bool>,
    /// The place that is told when the pause is over; `None` while none waits.
    next: Cell<Option<[f32; 3]>>,
    this: Weak<Self>,
}

impl OthersController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self {
            host: host.clone(),
            told_at: Cell::new(f64::NEG_INFINITY),
            is_alone: Cell::default(),
            next: Cell::default(),
            this: this.clone(),
        })
    }

    /// The person points at a place.
    fn point(&self, position: [f32; 3]) {
        // Who is seen to point is not alone.
        if self.host.ui.read(|s| !s.features.others.list.is_empty()) {
            self.is_alone.set(false);
        }
        let past = js_sys::Date::now() - self.told_at.get();
        if self.is_alone.get() && (0.0..ALONE).contains(&past) {
            return;
        }
        if self.next.replace(Some(position)).is_some() {
            return;
        }
        let weak = self.this.clone();
        let tell = move || {
            if let Some(this) = weak.upgrade() {
                this.tell();
            }
        };
        set_timeout(tell, Duration::from_millis((PAUSE - past).clamp(0.0, PAUSE) as u64));
    }

    fn tell(&self) {
        let (Some(position), Some(this)) = (self.next.take(), self.this.upgrade()) else { return };
        let pointing = self.host.ui.read(|s| {
            let person = s.features.review.person.trim().chars().take(PERSON).collect();
            let is_live = s.connection.is_live() && !s.inspection.id.is_empty();
            is_live.then(|| {
                (s.inspection.id.clone(), Pointing { viewer: s.features.others.own.clone(), person, position })
            })
        });
        let Some((id, pointing)) = pointing else { return };
        self.told_at.set(js_sys::Date::now());
        spawn_local(async move {
            let body = serde_json::to_string(&pointing).unwrap_or_default();
            let told = this.host.agent.post::<PointingTold>(&format!("/api/v1/inspections/{id}/pointers"), &body).await;
            // Of an agent that cannot tell them there is nobody.
            this.is_alone.set(told.map_or(true, |told| told.others == 0));
        });
    }
}

impl Controller for OthersController {
    fn begin(&self) {
        self.host.ui.send_feature(OthersEvent::Named(new_name().to_string()));
    }

    fn handle(&self, event: &FeatureEvent) {
        if let FeatureEvent::Inspect(InspectEvent::Picked(Some(point)) | InspectEvent::Hovered(Some(point))) = event {
            self.point(point.position);
        }
    }
}
