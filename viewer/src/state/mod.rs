//! What the viewer knows, apart from the points themselves: [`AppState`], changed by nothing but [`AppState::reduce`].
//!
//! The state is plain data, free of the browser and of any framework: the panels are a function of it, and everything
//! that can happen (a message of the agent, a lost graphics device, a click) is an [`Event`]. That is what makes the
//! viewer's behaviour testable natively, for any order of events. How the model is shown is in [`crate::display`], what
//! the tools know in [`crate::features`].
//!
//! | module | what |
//! |---|---|
//! | `event` | what can happen |
//! | [`account`] | who the person is to the agent |
//! | [`color_key`] | what the colours mean |
//! | [`connection`] | where the link to the agent and the graphics device stand |
//! | [`export_choice`] | how the model is exported, and how far that is |
//! | [`legend`] | component classes: visibility, figures |
//! | [`notices`] | short messages to the person |
//! | [`progress`] | where the inspection stands |
//! | [`timings`] | how long each stage takes |
//! | [`units`] | lengths, areas, counts and durations as people read them |
//! | [`views`] | the captured views |

pub mod account;
pub mod color_key;
pub mod connection;
mod event;
pub mod export_choice;
pub mod legend;
pub mod notices;
pub mod progress;
#[cfg(test)]
mod tests;
pub mod timings;
pub mod units;
pub mod views;

pub use event::Event;

use crate::display::{ColorMode, Display, ShareScales};
use crate::features::Features;
use crate::link::LinkEvent;
use crate::words::t;
use account::Account;
use connection::{Connection, GraphicsStatus};
use export_choice::{ExportChoice, Exporting};
use legend::{ClassFigures, Legend};
use notices::{Level, Notices, Topic};
use progress::{RunProgress, Standing};
use semascan_model::{ModelFigures, Role};
use semascan_protocol::server_message::Body;
use semascan_protocol::{Domain, Figures, Inspection, Phase, ReviewChange, StageState, review_subject};
use std::collections::BTreeMap;
use timings::Timings;
use views::Views;

/// Everything the panels show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AppState {
    /// The link to the agent.
    pub connection: Connection,
    /// How often a lost connection was resumed by difference.
    pub resumptions: u32,
    /// Host of the agent where it is not the one that the page came from: whose model is shown.
    pub foreign_agent: Option<String>,
    /// Who the person is to the agent that the page came from; `None` until it has said so.
    pub account: Option<Account>,
    /// Addresses of the photographs in full size that came with a file, by view.
    pub photographs: BTreeMap<u32, String>,
    /// How often somebody decided something about the inspection that is shown.
    pub review_changes: u64,
    /// Whether a part of the model is left out because the page holds as much as it can.
    pub is_cut: bool,
    /// How often the points of the model are halved for the same reason.
    pub halvings: u32,
    /// Whether the browser lets the page speak with devices that a person chooses (WebHID).
    pub has_devices: bool,
    /// The graphics device.
    pub graphics: GraphicsStatus,
    /// What is being inspected; the default before the first connection.
    pub inspection: Inspection,
    /// Where the inspection stands.
    pub progress: RunProgress,
    /// How long the stages take.
    pub timings: Timings,
    /// Hash of the model as held, comparable with the agent's.
    pub held_hash: u64,
    /// The captured views.
    pub views: Views,
    /// The component classes.
    pub legend: Legend,
    /// Scales of the colours that mean shares, as the model held needs them.
    pub scales: ShareScales,
    /// The figures of the final model, as the agent measured it; `None` before its end.
    pub measured: Option<ModelFigures>,
    /// How the model is shown.
    pub display: Display,
    /// What the tools know.
    pub features: Features,
    /// How the model is exported.
    pub export: ExportChoice,
    /// How far the export is that is being written; `None` while none is.
    pub exporting: Option<Exporting>,
    /// Whether the table of shortcuts is open.
    pub help_open: bool,
    /// Whether the command palette is open.
    pub palette_open: bool,
    /// Short messages to the person.
    pub notices: Notices,
}

impl AppState {
    /// Brings the state from before `event` to after it. Total: no event, whatever it carries, is refused or panics.
    pub fn reduce(&mut self, event: &Event) {
        match event {
            Event::Link(event) => self.reduce_link(event),
            Event::Figures { classes, voxel, scales, hash } => {
                self.held_hash = *hash;
                self.scales = *scales;
                self.legend.set_counts(classes);
                if *voxel > 0.0 && self.inspection.voxel <= 0.0 {
                    self.inspection.voxel = *voxel;
                }
            }
            Event::Opened(name) => {
                self.connection = Connection::File { name: name.clone() };
                self.foreign_agent = None;
                self.photographs.clear();
            }
            Event::Recorded => self.connection = Connection::Recorded,
            Event::Photographs(addresses) => self.photographs.clone_from(addresses),
            Event::Graphics(status) => self.graphics = status.clone(),
            Event::Account(account) => self.account = Some(account.clone()),
            Event::ForeignAgent(host) => self.foreign_agent = Some(host.clone()),
            Event::ColorMode(mode) => self.display.set_color_mode(*mode),
            Event::Theme(theme) => self.display.theme = *theme,
            Event::HasDevices => self.has_devices = true,
            Event::SystemDark(dark) => self.display.system_dark = *dark,
            Event::ShowOutliers(on) => self.display.outliers = *on,
            Event::ShowBackground(on) => self.display.background = *on,
            Event::ToggleComponent(class) => self.legend.toggle(*class),
            Event::OnlyComponent(class) => self.legend.only(*class),
            Event::AllComponents => self.legend.show_all(),
            Event::Feature(event) => self.features.reduce(event, &mut self.display),
            Event::SelectView(view) => self.views.select(*view),
            Event::StepView(step) => self.views.step(*step),
            Event::ExportChoice(choice) => self.export = *choice,
            Event::Exporting(exporting) => self.exporting = *exporting,
            Event::Help(open) => self.help_open = *open,
            Event::Palette(open) => self.palette_open = *open,
            Event::Notify { level, topic, text } => self.notices.push(*level, *topic, text.clone()),
            Event::Retract(topic) => self.notices.retract(*topic),
            Event::Dismiss(id) => self.notices.dismiss(*id),
            Event::Elapsed { ms } => {
                self.connection.elapsed(*ms);
                self.notices.elapsed(*ms);
                self.features.others.elapsed(*ms);
            }
        }
    }

    fn reduce_link(&mut self, event: &LinkEvent) {
        match event {
            LinkEvent::Connecting { attempt } => self.connection.connecting(*attempt),
            LinkEvent::Connected { inspection, resumed, agent } => {
                // What a file plays greets as an agent does.
                if !self.connection.is_file() {
                    self.connection = Connection::Connected { agent: agent.clone() };
                }
                if *resumed && inspection.id == self.inspection.id && inspection.epoch == self.inspection.epoch {
                    self.resumptions = self.resumptions.saturating_add(1);
                    self.follow(inspection);
                } else {
                    self.begin(inspection);
                }
            }
            LinkEvent::Disconnected { reason, retry_ms } => {
                self.connection.lost(reason.clone(), *retry_ms);
                self.timings.idle();
            }
            LinkEvent::Refused { reason } => {
                self.connection = Connection::Refused { reason: reason.clone() };
                self.timings.idle();
            }
            LinkEvent::Broken { reason } => {
                self.connection = Connection::Broken { reason: reason.clone() };
                self.timings.idle();
            }
            LinkEvent::LeftOut { .. } => self.is_cut = true,
            LinkEvent::Halved { halvings } => self.halvings = *halvings,
            // The same inspection from a rebuilt map: what was said of its views still holds.
            LinkEvent::Cleared(inspection) if self.is_rebuilt(inspection) => {
                self.is_cut = false;
                self.follow(inspection);
            }
            LinkEvent::Cleared(inspection) => self.begin(inspection),
            LinkEvent::Message(message) => self.reduce_message(message),
            LinkEvent::Malformed { reason } => {
                let text = t!("notice.malformed", reason);
                self.notices.push(Level::Warning, Topic::Malformed, text);
            }
            // The model follows these.
            LinkEvent::Chunk(_) | LinkEvent::ChunkGone { .. } => {}
        }
    }

    fn reduce_message(&mut self, message: &Body) {
        match message {
            Body::Progress(progress) => {
                let before = self.progress.phase;
                self.progress.update(progress);
                self.measured = progress.figures.as_ref().map(Figures::figures);
                if !self.progress.may_run() {
                    self.timings.idle();
                }
                self.announce_phase(before);
            }
            // After a reconnection the agent repeats what happened; in a run that is over nothing starts.
            Body::Stage(stage) if stage.state() == StageState::Started && !self.progress.may_run() => {}
            Body::Stage(stage) => self.timings.stage(stage),
            Body::View(report) => {
                self.timings.report(report);
                self.views.report(report);
                if report.domain() == Domain::Outside {
                    let text = t!("notice.domain");
                    self.notices.push(Level::Warning, Topic::Domain, text.into());
                }
            }
            Body::Page(page) => self.views.page(page),
            Body::Review(change) => self.announce_review(change),
            Body::Pointer(pointer) => self.features.others.point(pointer),
            // Each of these is an event of the link of its own.
            Body::Welcome(_) | Body::Refused(_) | Body::Clear(_) | Body::Chunk(_) | Body::Gone(_) => {}
        }
    }

    /// Whether something counts down, so that [`Event::Elapsed`] is wanted.
    pub fn wants_clock(&self) -> bool {
        matches!(self.connection, Connection::Reconnecting { retry_ms, .. } if retry_ms > 0)
            || self.notices.fading()
            || !self.features.others.list.is_empty()
    }

    /// The one sentence that a screen reader speaks when it changes.
    pub fn status(&self) -> String {
        let link = self.connection.sentence();
        match self.connection {
            Connection::Connected { .. } => format!("{link} {}", self.progress.sentence()),
            _ => link,
        }
    }

    /// Where the inspection stands, as far as that is known: without a connection nobody knows whether it still runs.
    pub fn standing(&self) -> Standing {
        match self.progress.phase {
            _ if !self.connection.is_live() && !self.connection.is_file() && self.progress.may_change() => {
                Standing::Unknown
            }
            phase => Standing::Known(phase),
        }
    }

    /// What the legend says of a component class. Of a final model it is what the agent measured and the inspection's record
    /// says; before, what was counted here, and the area once there is a mesh of the model as it is.
    pub fn class_figures(&self, class: u16) -> ClassFigures {
        let of = |figures: &ModelFigures| figures.component(class).or(figures.absent());
        if let Some(measured) = &self.measured {
            let figures = of(measured).unwrap_or_default();
            return ClassFigures { points: figures.points, area: figures.area, confidence: figures.confidence };
        }
        let count = self.legend.rows.get(usize::from(class)).map(|row| row.count).unwrap_or_default();
        let area = self.features.mesh.figures.as_ref().and_then(of).and_then(|figures| figures.area);
        ClassFigures { points: count.points, area, confidence: count.confidence }
    }

    /// Whether a view has a picture, and a camera whose pose is known.
    pub fn has_photographs(&self) -> bool {
        let keeps = self.account.as_ref().is_some_and(|account| account.keeps);
        self.views.iter().any(|view| {
            let has_picture = keeps || !view.thumbnail_jpeg.is_empty();
            view.accepted && has_picture && view.pose.is_some() && view.intrinsics.is_some()
        })
    }

    /// What colours can mean now, in the order of the panel; deviations have a place of their own behind these.
    pub fn color_modes(&self) -> Vec<ColorMode> {
        let has_photographs = self.has_photographs() || self.display.color_mode == ColorMode::Photo;
        let mut modes = ColorMode::ALL.to_vec();
        if has_photographs {
            modes.insert(1, ColorMode::Photo);
        }
        modes
    }

    /// Whether there is a model to be seen, whatever of it is hidden.
    pub fn has_model(&self) -> bool {
        self.progress.points > 0 || self.legend.rows.iter().any(|row| row.count.held > 0)
    }

    /// Whether the finished model on screen is not the agent's: something of it was lost or not understood.
    pub fn model_differs(&self) -> bool {
        let agents = self.progress.model_hash;
        self.connection.is_live() && self.progress.phase == Phase::Finished && agents != 0 && agents != self.held_hash
    }

    /// Largest number of the scale of the colour mode "views": absolute, so that a colour means the same number of
    /// views from the first view of an inspection to the last.
    pub fn views_scale(&self) -> u32 {
        let expected = self.inspection.views_expected.max(self.progress.views_expected);
        let known =
            if expected > 0 { expected } else { self.progress.views_done.clamp(10, 65_530).next_multiple_of(10) };
        known.clamp(2, u32::from(u16::MAX))
    }

    /// Whether the agent lets the person decide about findings and correct labels.
    pub fn may_review(&self) -> bool {
        !self.connection.is_file() && self.account.as_ref().is_some_and(|account| account.role >= Role::Reviewer)
    }

    /// A new inspection, or the same one from an empty map; how the person set up the display stays.
    fn begin(&mut self, inspection: &Inspection) {
        self.notices.begin();
        self.is_cut = false;
        // Marks that are not signed are of these classes.
        if !self.is_unsaid(inspection) || self.features.review.case.inspection.is_empty() {
            self.legend.set_taxonomy(inspection);
        }
        self.legend.clear_counts();
        self.measured = None;
        self.scales = ShareScales::default();
        self.progress = RunProgress::default();
        self.timings = Timings::default();
        self.views = Views::default();
        self.features.begin(&mut self.display);
        if !self.may_be_reviewed_on(inspection) {
            let Features { review, correct, .. } = &self.features;
            if review.draft.is_some() || correct.drawn().next().is_some() {
                self.notices.push(Level::Warning, Topic::Decision, t!("review.given_up").into());
            }
            self.features.leave();
        }
        self.inspection = inspection.clone();
    }

    /// Whether `inspection` is, or may be, the one that the person reviews.
    fn may_be_reviewed_on(&self, inspection: &Inspection) -> bool {
        self.is_unsaid(inspection) || inspection.id == self.features.review.case.inspection
    }

    /// Whether an agent, which has just started, does not know yet which inspection it will show.
    fn is_unsaid(&self, inspection: &Inspection) -> bool {
        inspection.id.is_empty() && !self.connection.is_file()
    }

    /// What is known of the inspection that is shown anyway.
    fn follow(&mut self, inspection: &Inspection) {
        self.legend.set_taxonomy(inspection);
        self.inspection = inspection.clone();
    }

    /// Whether `inspection` is the one that is shown, from a map that was made anew.
    fn is_rebuilt(&self, inspection: &Inspection) -> bool {
        !inspection.id.is_empty() && inspection.id == self.inspection.id && inspection.epoch != self.inspection.epoch
    }

    /// Says what somebody decided about the inspection that is shown.
    fn announce_review(&mut self, change: &ReviewChange) {
        if change.inspection != self.inspection.id {
            return;
        }
        self.review_changes += 1;
        let subject = match change.subject.as_ref().and_then(|subject| subject.kind.as_ref()) {
            Some(review_subject::Kind::Component(name)) => t!("notice.component", name),
            Some(review_subject::Kind::Finding(_)) => t!("notice.finding").to_owned(),
            Some(review_subject::Kind::Part(_)) | None => t!("notice.part").to_owned(),
        };
        let action = action_name(&change.action);
        let mut text = format!("{}: {action}, {subject}", change.person);
        if !change.reason.is_empty() {
            text.push_str(&format!(" ({})", change.reason));
        }
        if change.conflicts_with.is_empty() {
            self.notices.push(Level::Info, Topic::Review, text);
        } else {
            text.push_str(t!("notice.contradiction"));
            self.notices.push(Level::Warning, Topic::Review, text);
        }
    }

    fn announce_phase(&mut self, before: Phase) {
        if self.progress.phase == Phase::Failed && before != Phase::Failed {
            let why = &self.progress.message;
            let text = if why.is_empty() { t!("notice.failed").to_owned() } else { t!("notice.failed_because", why) };
            self.notices.push(Level::Error, Topic::Outcome, text);
        }
    }
}

/// What somebody did, within a sentence; of a later agent as it says it.
fn action_name(action: &str) -> String {
    match action {
        "accept" => t!("action.accept").to_owned(),
        "rework" => t!("action.rework").to_owned(),
        "reject" => t!("action.reject").to_owned(),
        "comment" => t!("action.comment").to_owned(),
        "reclassify" => t!("action.reclassify").to_owned(),
        "relabel" => t!("action.relabel").to_owned(),
        "new_finding" => t!("action.new_finding").to_owned(),
        "measure" => t!("action.measure").to_owned(),
        "withdraw" => t!("action.withdraw").to_owned(),
        other => other.replace('_', " "),
    }
}
