//! What the viewer knows, apart from the points themselves: [`AppState`], changed by nothing but [`AppState::reduce`].
//!
//! The state is plain data, free of the browser and of any framework: the panels are a function of it, and everything
//! that can happen (a message of the agent, a lost graphics device, a click) is an [`Event`]. That is what makes the
//! viewer's behaviour testable natively, for any order of events.
//!
//! | module | what |
//! |---|---|
//! | [`connection`] | where the link to the agent stands |
//! | [`display`] | colour mode, theme, what is shown |
//! | [`legend`] | component classes: visibility, figures |
//! | [`notices`] | short messages to the person |
//! | [`surface`] | points or mesh, meshing, comparison |
//! | [`progress`] | where the inspection stands |
//! | [`timings`] | how long each stage takes |
//! | [`units`] | lengths, areas, counts and durations as people read them |
//! | [`views`] | the captured views |

pub mod connection;
pub mod display;
mod event;
pub mod legend;
pub mod notices;
pub mod progress;
pub mod surface;
#[cfg(test)]
mod tests;
pub mod timings;
pub mod units;
pub mod views;

pub use event::Event;

use connection::{Connection, Gpu};
use display::Display;
use legend::Legend;
use notices::{Level, Notices};
use progress::RunProgress;
use semascan_protocol::{Inspection, Phase, StageState};
use surface::{Surface, SurfaceEvent};
use timings::Timings;
use views::Views;

/// Everything the panels show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AppState {
    /// The link to the agent.
    pub connection: Connection,
    /// How often a lost connection was resumed by difference.
    pub resumptions: u32,
    /// The graphics device.
    pub gpu: Gpu,
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
    /// How the model is shown.
    pub display: Display,
    /// Points or mesh, and what the mesh is compared with.
    pub surface: Surface,
    /// Whether the table of shortcuts is open.
    pub help_open: bool,
    /// Short messages to the person.
    pub notices: Notices,
}

impl AppState {
    /// Brings the state from before `event` to after it. Total: no event, whatever it carries, is refused or panics.
    pub fn reduce(&mut self, event: Event) {
        match event {
            Event::Connecting { attempt } => self.connection.connecting(attempt),
            Event::Connected { inspection, resumed, agent } => {
                self.connection = Connection::Connected { agent };
                if resumed && inspection.id == self.inspection.id && inspection.epoch == self.inspection.epoch {
                    self.resumptions = self.resumptions.saturating_add(1);
                    self.legend.set_taxonomy(&inspection);
                    self.inspection = inspection;
                } else {
                    self.begin(inspection);
                }
            }
            Event::Disconnected { reason, retry_ms } => self.connection.lost(reason, retry_ms),
            Event::Refused { reason } => self.connection = Connection::Refused { reason },
            // The same inspection from a rebuilt map: what was said of its views still holds.
            Event::Cleared(inspection) if self.is_rebuilt(&inspection) => {
                self.legend.set_taxonomy(&inspection);
                self.inspection = inspection;
            }
            Event::Cleared(inspection) => self.begin(inspection),
            Event::Progress(progress) => {
                let before = self.progress.phase;
                self.progress.update(progress);
                if !self.progress.may_run() {
                    self.timings.idle();
                }
                self.announce_phase(before);
            }
            // A reconnected viewer is told again what happened; in a run that is over nothing starts.
            Event::Stage(stage) if stage.state() == StageState::Started && !self.progress.may_run() => {}
            Event::Stage(stage) => self.timings.stage(&stage),
            Event::View(report) => {
                self.timings.report(&report);
                self.views.report(report);
            }
            Event::Malformed { reason } => {
                let text = format!("A message of the agent was not understood: {reason}");
                self.notices.push_on("malformed", Level::Warning, text);
            }
            Event::Figures { classes, voxel, hash } => {
                self.held_hash = hash;
                self.legend.set_figures(&classes);
                if voxel > 0.0 && self.inspection.voxel <= 0.0 {
                    self.inspection.voxel = voxel;
                }
            }
            Event::Gpu(gpu) => self.gpu = gpu,
            Event::ColorMode(display::ColorMode::Deviation) if self.surface.reference.is_none() => {}
            Event::ColorMode(mode) => {
                self.display.color_mode = mode;
                // Deviations are those of the mesh.
                self.surface.shown |= mode == display::ColorMode::Deviation;
            }
            Event::Theme(theme) => self.display.theme = theme,
            Event::SystemDark(dark) => self.display.system_dark = dark,
            Event::ShowOutliers(on) => self.display.outliers = on,
            Event::ShowBackground(on) => self.display.background = on,
            Event::ToggleComponent(class) => self.legend.toggle(class),
            Event::OnlyComponent(class) => self.legend.only(class),
            Event::AllComponents => self.legend.show_all(),
            Event::Surface(event) => self.surface_event(event),
            Event::SelectView(view) => self.views.select(view),
            Event::StepView(step) => self.views.step(step),
            Event::Help(open) => self.help_open = open,
            Event::Notify { level, text } => self.notices.push(level, text),
            Event::Dismiss(id) => self.notices.dismiss(id),
            Event::Elapsed { ms } => {
                self.connection.elapsed(ms);
                self.notices.elapsed(ms);
            }
        }
    }

    /// Whether something counts down, so that [`Event::Elapsed`] is wanted.
    pub fn wants_clock(&self) -> bool {
        matches!(self.connection, Connection::Reconnecting { retry_ms, .. } if retry_ms > 0) || self.notices.fading()
    }

    /// The one sentence that a screen reader speaks when it changes.
    pub fn status(&self) -> String {
        let link = self.connection.sentence();
        match self.connection {
            Connection::Connected { .. } => format!("{link} {}", self.progress.sentence()),
            _ => link,
        }
    }

    /// Whether there is a model to be seen, whatever of it is hidden.
    pub fn has_model(&self) -> bool {
        self.progress.points > 0 || self.legend.rows.iter().any(|row| row.figures.points > 0)
    }

    /// Whether the finished model on screen is not the agent's: something of it was lost or not understood.
    pub fn model_differs(&self) -> bool {
        let agents = self.progress.model_hash;
        let live = matches!(self.connection, Connection::Connected { .. });
        live && self.progress.phase == Phase::Finished && agents != 0 && agents != self.held_hash
    }

    /// Largest number of the scale of the colour mode "views": absolute, so that a colour means the same number of
    /// views from the first view of an inspection to the last.
    pub fn views_scale(&self) -> u32 {
        let expected = self.inspection.views_expected.max(self.progress.views_expected);
        let known =
            if expected > 0 { expected } else { self.progress.views_done.clamp(10, 65_530).next_multiple_of(10) };
        known.clamp(2, u32::from(u16::MAX))
    }

    /// A new inspection, or the same one from an empty map; how the person set up the display stays.
    fn begin(&mut self, inspection: Inspection) {
        self.legend.set_taxonomy(&inspection);
        self.legend.clear_figures();
        self.progress = RunProgress::default();
        self.timings = Timings::default();
        self.views = Views::default();
        self.surface.clear();
        if self.display.color_mode == display::ColorMode::Deviation {
            self.display.color_mode = display::ColorMode::Component;
        }
        self.inspection = inspection;
    }

    /// Whether `inspection` is the one that is shown, from a map that was made anew.
    fn is_rebuilt(&self, inspection: &Inspection) -> bool {
        !inspection.id.is_empty() && inspection.id == self.inspection.id && inspection.epoch != self.inspection.epoch
    }

    fn surface_event(&mut self, event: SurfaceEvent) {
        use display::ColorMode;
        let deviates = self.display.color_mode == ColorMode::Deviation;
        match &event {
            SurfaceEvent::Reference(_) => {
                self.display.color_mode = ColorMode::Deviation;
                self.surface.shown = true;
            }
            SurfaceEvent::Forgotten | SurfaceEvent::Show(false) if deviates => {
                self.display.color_mode = ColorMode::Component;
            }
            _ => {}
        }
        self.surface.reduce(event);
    }

    fn announce_phase(&mut self, before: Phase) {
        if self.progress.phase == Phase::Failed && before != Phase::Failed {
            let why = &self.progress.message;
            let text =
                if why.is_empty() { "The inspection failed.".into() } else { format!("The inspection failed: {why}") };
            self.notices.push(Level::Error, text);
        }
    }
}
