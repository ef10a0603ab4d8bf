//! Paints the corrections onto the picture, and asks the agent for those that people made before.

use super::patch::{segment, within};
use super::{CorrectEvent, Corrections, Teaching, Tool};
use crate::camera::CameraInput;
use crate::features::FeatureEvent;
use crate::features::measure::MeasureEvent;
use crate::features::review::ReviewEvent;
use crate::features::section::SectionEvent;
use crate::features::view::{Controller, Host};
use crate::link::ApiError;
use crate::link::api::Agent;
use crate::scene::paint::Paint;
use crate::scene::pick::nearest_point;
use crate::state::AppState;
use crate::ui::Command;
use crate::words::t;
use glam::{DVec3, Vec3};
use leptos::prelude::{Effect, Get};
use semascan_model::ClassDef;
use semascan_model::review::{Review, ReviewAction};
use serde::Deserialize;
use std::cell::Cell;
use std::rc::{Rc, Weak};
use wasm_bindgen_futures::spawn_local;

/// Entries of the log that are asked for at once.
const PAGE: u32 = 500;
/// Places that are asked for where a label would teach most.
const REGIONS: u32 = 8;
/// How far from such a place it is looked at, metres.
const LOOK_FROM: f32 = 0.1;

/// The answer of `/inspections/{inspection}/reviews`, as far as it is used.
#[derive(Deserialize)]
struct LogAnswer {
    items: Vec<LoggedReview>,
    #[serde(default)]
    next: Option<u64>,
}

#[derive(Deserialize)]
struct LoggedReview {
    sequence: u64,
    review: Review,
}

/// See the module.
pub(super) struct CorrectController {
    host: Host,
    is_asking: Cell<bool>,
    /// The log has grown while it was being asked for.
    is_due: Cell<bool>,
    this: Weak<Self>,
}

impl CorrectController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self {
            host: host.clone(),
            is_asking: Cell::default(),
            is_due: Cell::default(),
            this: this.clone(),
        })
    }

    /// Asks for what was added to the log since it was last read.
    fn ask(&self) {
        let Some(this) = self.this.upgrade() else { return };
        self.is_due.set(true);
        if self.is_asking.replace(true) {
            return;
        }
        spawn_local(async move {
            while this.is_due.replace(false) {
                let (id, mut known) = this
                    .host
                    .ui
                    .read(|s| (s.features.review.case.inspection.clone(), s.features.correct.earlier.clone()));
                if id.is_empty() {
                    break;
                }
                if known.inspection != id {
                    known = Corrections { inspection: id, ..Corrections::default() };
                }
                // Without an answer the picture lacks what others painted; the findings say that the agent is away.
                if read_on(&this.host.agent, &mut known).await.is_ok()
                    && this.host.ui.read(|s| s.features.review.case.inspection == known.inspection)
                {
                    this.host.ui.send_feature(CorrectEvent::Known(Box::new(known)));
                }
            }
            this.is_asking.set(false);
        });
    }

    /// Asks where a label would teach most.
    fn ask_teaching(&self) {
        let id = self.host.ui.read(|s| s.features.review.case.inspection.clone());
        let (ui, agent) = (self.host.ui, self.host.agent.clone());
        spawn_local(async move {
            let path = format!("/api/v1/inspections/{id}/teaching?limit={REGIONS}");
            let said = match agent.get::<Teaching>(&path).await {
                Ok(teaching) => teaching,
                Err(ApiError::Unreachable) => Teaching::none(t!("review.unreachable").into()),
                Err(ApiError::Refused { reason, .. }) => Teaching::none(reason),
            };
            if ui.read(|s| s.features.review.case.inspection == id) {
                ui.send_feature(CorrectEvent::Teaching(Box::new(said)));
            }
        });
    }

    /// Turns the view to the place that was chosen.
    fn show_taught(&self) {
        let Some(position) = self.host.ui.read(|s| s.features.correct.taught_region().map(|region| region.position))
        else {
            return;
        };
        let target = DVec3::from(position).as_vec3();
        let normal = nearest_point(&self.host.model.borrow(), target).map(|point| Vec3::from(point.normal));
        if let Some(normal) = normal.and_then(Vec3::try_normalize) {
            self.host.ui.ask(Command::Camera(CameraInput::From { eye: target + normal * LOOK_FROM, target }));
        }
    }

    /// Puts into the picture what is painted.
    fn paint(&self) {
        let (paint, is_open) = self.host.ui.read(paint);
        self.host.paint.borrow_mut().set(paint, is_open);
        (self.host.redraw)();
    }
}

/// Reads the log to its end.
async fn read_on(agent: &Agent, known: &mut Corrections) -> Result<(), ApiError> {
    loop {
        let (id, after) = (&known.inspection, known.sequence);
        let path = format!("/api/v1/inspections/{id}/reviews?after={after}&limit={PAGE}");
        let answer: LogAnswer = agent.get(&path).await?;
        for logged in answer.items {
            known.sequence = known.sequence.max(logged.sequence);
            if matches!(logged.review.action, ReviewAction::Relabel { .. } | ReviewAction::NewFinding { .. }) {
                known.actions.push(logged.review.action);
            }
        }
        if answer.next.is_none() {
            return Ok(());
        }
    }
}

/// What is painted: what people did before, what has not arrived yet, and the marks; and whether one is being drawn.
fn paint(state: &AppState) -> (Vec<Paint>, bool) {
    let (correct, review) = (&state.features.correct, &state.features.review);
    let components: Vec<ClassDef> = state.legend.rows.iter().map(|row| row.class.clone()).collect();
    let defects = &state.legend.defects;
    let class = |classes: &[ClassDef], name: &str| match name {
        "none" => Some(0),
        _ => classes.iter().find(|class| class.name == name).map(|class| class.id),
    };
    let earlier = correct.earlier.actions.iter().filter(|_| correct.shows_earlier).cloned();
    let unsent = review.unsent.iter().filter(|unsent| unsent.inspection == review.case.inspection);
    let marks = correct.marks.iter().filter_map(|mark| mark.action(&components, defects));
    let actions = earlier.chain(unsent.map(|unsent| unsent.review.action.clone())).chain(marks);
    let paint =
        actions.filter_map(|action| Paint::of(&action, |name| class(&components, name), |name| class(defects, name)));
    (paint.collect(), correct.is_drawing())
}

impl Controller for CorrectController {
    fn begin(&self) {
        let ui = self.host.ui;
        let painted = ui.part(|s| {
            let (correct, review) = (&s.features.correct, &s.features.review);
            let classes = (s.legend.rows.len(), s.legend.defects.len());
            (correct.marks.clone(), correct.earlier.clone(), correct.shows_earlier, review.unsent.clone(), classes)
        });
        let weak = self.this.clone();
        Effect::new(move |_| {
            painted.get();
            if let Some(controller) = weak.upgrade() {
                controller.paint();
            }
        });
    }

    fn handle(&self, event: &FeatureEvent) {
        let ui = self.host.ui;
        match event {
            FeatureEvent::Review(ReviewEvent::Known(_)) => self.ask(),
            FeatureEvent::Correct(CorrectEvent::Dotted(Some(point)))
                if ui.read(|s| s.features.correct.tool == Some(Tool::Segment)) =>
            {
                let naming = ui.read(|s| s.features.correct.naming());
                let taken = segment(&self.host.model.borrow(), point, naming);
                ui.send_feature(CorrectEvent::Taken(taken));
            }
            FeatureEvent::Correct(CorrectEvent::LoopClosed) => {
                let path = ui.read(|s| s.features.correct.path.clone());
                let taken = within(&self.host.model.borrow(), &self.host.camera.get(), &path);
                ui.send_feature(CorrectEvent::Taken(taken));
            }
            FeatureEvent::Correct(CorrectEvent::AskTeaching(true)) => self.ask_teaching(),
            FeatureEvent::Correct(CorrectEvent::Teach(_)) => {
                self.show_taught();
                ui.send_feature(CorrectEvent::Choose(Some(Tool::Brush)));
            }
            // One tool has the pointer.
            FeatureEvent::Correct(CorrectEvent::Choose(Some(_))) => {
                if ui.read(|s| s.features.measure.kind.is_some()) {
                    ui.send_feature(MeasureEvent::Choose(None));
                }
                if ui.read(|s| s.features.section.is_reading) {
                    ui.send_feature(SectionEvent::Read(false));
                }
            }
            FeatureEvent::Measure(MeasureEvent::Choose(Some(_))) | FeatureEvent::Section(SectionEvent::Read(true))
                if ui.read(|s| s.features.correct.tool.is_some()) =>
            {
                ui.send_feature(CorrectEvent::Choose(None));
            }
            _ => {}
        }
    }
}
