//! Asks the agent for the findings, shows the chosen one, and sends decisions: each is kept in the browser's storage until the agent
//! has confirmed it, and sent again until then.

use super::case::{FindingsAnswer, ReviewsAnswer, VerdictAnswer};
use super::{Case, ReviewEvent, outbox};
use crate::camera::CameraInput;
use crate::features::FeatureEvent;
use crate::features::inspect::InspectEvent;
use crate::features::view::{Controller, Host};
use crate::link::api::Agent;
use crate::link::{ApiError, may_pass};
use crate::scene::pick::nearest_point;
use crate::state::notices::{Level, Topic};
use crate::ui::{Command, storage};
use crate::words::t;
use glam::{DVec3, Vec3};
use leptos::prelude::{Effect, Get, set_timeout};
use semascan_model::finding::RegionFigures;
use semascan_protocol::Phase;
use serde::de::IgnoredAny;
use std::cell::Cell;
use std::rc::{Rc, Weak};
use std::time::Duration;
use wasm_bindgen_futures::spawn_local;

/// Where it is kept who decides.
const PERSON_KEY: &str = "semascan.reviewer";
/// How long until a decision is sent again.
const RETRY: Duration = Duration::from_secs(3);
/// How long until the agent is asked again for findings that it has not written yet, and how often.
const AGAIN: Duration = Duration::from_millis(750);
const MOST_TRIES: u32 = 10;
/// Distance from which a finding is looked at, as a multiple of its radius, and at least so many metres.
const LOOK_FROM: f64 = 6.0;
const LEAST_DISTANCE: f64 = 0.08;

/// See the module.
pub(super) struct ReviewController {
    host: Host,
    is_sending: Cell<bool>,
    /// Counts what the agent is asked: an answer to an earlier question comes too late.
    asked: Cell<u64>,
    this: Weak<Self>,
}

impl ReviewController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self {
            host: host.clone(),
            is_sending: Cell::default(),
            asked: Cell::default(),
            this: this.clone(),
        })
    }

    /// Asks for the case of an inspection.
    fn ask(&self, id: String, tries: u32) {
        let Some(this) = self.this.upgrade() else { return };
        self.asked.set(self.asked.get() + 1);
        let asked = self.asked.get();
        spawn_local(async move {
            this.host.ui.send_feature(ReviewEvent::Asked);
            let answer = case(&this.host.agent, &id).await;
            if this.asked.get() != asked {
                return;
            }
            // The record with its findings is written a moment after the end.
            let is_early = match &answer {
                Ok(case) => case.findings.is_none() && case.not_looked.is_none(),
                Err(ApiError::Refused { status, .. }) => *status == 404,
                Err(ApiError::Unreachable) => true,
            };
            if is_early && tries < MOST_TRIES {
                let weak = this.this.clone();
                set_timeout(
                    move || {
                        if let Some(this) = weak.upgrade().filter(|this| this.asked.get() == asked) {
                            this.ask(id, tries + 1);
                        }
                    },
                    AGAIN,
                );
                return;
            }
            let event = match answer {
                Ok(case) => ReviewEvent::Known(Box::new(case)),
                Err(ApiError::Unreachable) => ReviewEvent::Unknown(t!("review.unreachable").into()),
                Err(ApiError::Refused { reason, .. }) => ReviewEvent::Unknown(reason),
            };
            this.host.ui.send_feature(event);
        });
    }

    /// Sends what has not arrived yet, the oldest first, one at a time.
    fn send(&self) {
        let Some(this) = self.this.upgrade() else { return };
        if self.is_sending.replace(true) {
            return;
        }
        spawn_local(async move {
            while let Some(unsent) = this.host.ui.read(|s| s.features.review.unsent.first().cloned()) {
                let id = unsent.review.id;
                let path = format!("/api/v1/inspections/{}/reviews", unsent.inspection);
                let body = serde_json::to_string(&unsent.review).unwrap_or_default();
                let event = match this.host.agent.post::<IgnoredAny>(&path, &body).await {
                    Ok(_) => ReviewEvent::Sent(id),
                    Err(ApiError::Refused { reason, status }) if !may_pass(status) => {
                        ReviewEvent::Refused { id, reason }
                    }
                    Err(_) => {
                        let weak = this.this.clone();
                        set_timeout(
                            move || {
                                if let Some(this) = weak.upgrade() {
                                    this.send();
                                }
                            },
                            RETRY,
                        );
                        break;
                    }
                };
                if let ReviewEvent::Refused { reason, .. } = &event {
                    let said = &unsent.review.reason;
                    let text = t!("review.refused", reason, said);
                    this.host.ui.notify(Level::Error, Topic::Decision, text);
                }
                this.host.ui.send_feature(event);
            }
            this.is_sending.set(false);
        });
    }

    /// Turns the view to the chosen finding and picks its place, so that its photographs are found.
    fn show(&self) {
        let ui = self.host.ui;
        let region = ui.read(|s| s.features.review.chosen().and_then(|(_, finding)| finding.region.clone()));
        let Some(region) = region else { return };
        let place = DVec3::from(region.position).as_vec3();
        if let Some(eye) = eye(&region) {
            ui.ask(Command::Camera(CameraInput::From { eye, target: place }));
        }
        let point = nearest_point(&self.host.model.borrow(), place);
        ui.send_feature(InspectEvent::Picked(point));
    }

    /// Decisions that this page, an earlier visit or another tab have left, the oldest first.
    fn restore(&self) {
        for unsent in storage().map(|storage| outbox::kept(&storage)).unwrap_or_default() {
            self.host.ui.send_feature(ReviewEvent::Decided(Box::new(unsent)));
        }
    }
}

/// All that the agent says of an inspection's findings.
async fn case(agent: &Agent, id: &str) -> Result<Case, ApiError> {
    let path = format!("/api/v1/inspections/{id}");
    let findings: FindingsAnswer = agent.get(&format!("{path}/findings")).await?;
    let verdict: VerdictAnswer = agent.get(&format!("{path}/verdict")).await?;
    let reviews: ReviewsAnswer = agent.get(&format!("{path}/reviews?limit=1")).await?;
    Ok(Case::of(id.to_owned(), findings, verdict, reviews))
}

/// Where a finding is looked at from: along its normal. `None` for one that goes around the part.
fn eye(region: &RegionFigures) -> Option<Vec3> {
    let place = DVec3::from(region.position);
    let normal = DVec3::from(region.normal).try_normalize()?;
    let points = region.outlines.iter().flatten();
    let radius = points.map(|p| DVec3::from(*p).distance(place)).fold(0.0, f64::max);
    Some((place + normal * (LOOK_FROM * radius).max(LEAST_DISTANCE)).as_vec3())
}

impl Controller for ReviewController {
    fn begin(&self) {
        if let Some(person) = storage().and_then(|storage| storage.get_item(PERSON_KEY).ok().flatten()) {
            self.host.ui.send_feature(ReviewEvent::Person(person));
        }
        self.restore();
        // What is known of the case holds until the inspection ends, another is shown, or somebody decides.
        let due = self.host.ui.part(|s| {
            let is_over = matches!(s.progress.phase, Phase::Finished | Phase::Failed) && !s.inspection.id.is_empty();
            let keeps = s.account.as_ref().is_some_and(|account| account.keeps);
            (is_over && keeps).then(|| (s.inspection.id.clone(), s.review_changes, s.connection.is_live()))
        });
        let weak = self.this.clone();
        Effect::new(move |_| {
            let (due, Some(controller)) = (due.get(), weak.upgrade()) else { return };
            let Some((id, ..)) = due else {
                // An answer that is under way is about what is no longer shown.
                return controller.asked.set(controller.asked.get() + 1);
            };
            controller.ask(id, 0);
            controller.restore();
            controller.send();
        });
    }

    fn handle(&self, event: &FeatureEvent) {
        let FeatureEvent::Review(event) = event else { return };
        match event {
            ReviewEvent::Select(Some(_)) | ReviewEvent::Step(_) => self.show(),
            ReviewEvent::Person(person) => {
                if let Some(storage) = storage() {
                    // A name that is not kept is asked for again.
                    let _ = storage.set_item(PERSON_KEY, person);
                }
            }
            ReviewEvent::Decided(unsent) => {
                if !storage().is_some_and(|storage| outbox::keep(&storage, unsent)) {
                    self.host.ui.notify(Level::Warning, Topic::Decision, t!("review.not_kept"));
                }
                self.send();
            }
            ReviewEvent::Sent(id) | ReviewEvent::Refused { id, .. } => {
                if let Some(storage) = storage() {
                    outbox::forget(&storage, *id);
                }
            }
            _ => {}
        }
    }
}
