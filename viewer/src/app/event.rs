//! Everything that can happen to the viewer.

use super::connection::Gpu;
use super::display::{ColorMode, Theme};
use super::legend::ClassFigures;
use super::notices::Level;
use super::surface::SurfaceEvent;
use semascan_protocol::{self as wire, Inspection, StageEvent, ViewReport};

/// One thing that happened, from the agent, the graphics device, the clock or the person.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The link tries to reach the agent; `attempt` counts from 1 and starts again after a success.
    Connecting {
        /// Number of the try.
        attempt: u32,
    },
    /// The agent welcomed the viewer.
    Connected {
        /// What is being inspected.
        inspection: Inspection,
        /// Whether the model held from before the lost connection is still good.
        resumed: bool,
        /// Name and version of the agent.
        agent: String,
    },
    /// The connection broke; the link will try again by itself.
    Disconnected {
        /// Why, for people.
        reason: String,
        /// Milliseconds until the next try.
        retry_ms: u32,
    },
    /// The agent refused the viewer; the link will not try again.
    Refused {
        /// Why, in the agent's words.
        reason: String,
    },
    /// A new inspection, or a rebuilt map of the same one: the model is empty.
    Cleared(Inspection),
    /// Where the inspection stands.
    Progress(wire::Progress),
    /// A stage of a view began, ended or failed.
    Stage(StageEvent),
    /// What became of a view.
    View(ViewReport),
    /// A message was dropped because it made no sense.
    Malformed {
        /// Why, for people.
        reason: String,
    },
    /// The model as held was counted.
    Figures {
        /// By component class, in the order of the class ids.
        classes: Vec<ClassFigures>,
        /// Voxel edge that came with the points, in metres; 0 without points. An inspection that has not captured its
        /// first view when the viewer connects does not know it yet.
        voxel: f64,
        /// Hash of the model as held.
        hash: u64,
    },
    /// The graphics device changed.
    Gpu(Gpu),
    /// The person chose what the colours mean.
    ColorMode(ColorMode),
    /// The person chose a theme.
    Theme(Theme),
    /// The system's preference for dark pages changed.
    SystemDark(bool),
    /// Show or hide points marked as outliers.
    ShowOutliers(bool),
    /// Show or hide points outside the measuring volume.
    ShowBackground(bool),
    /// Show or hide a component class.
    ToggleComponent(u16),
    /// Show this component class and no other.
    OnlyComponent(u16),
    /// Show all component classes.
    AllComponents,
    /// Something happened to the surface.
    Surface(SurfaceEvent),
    /// Select a view by its index, or none.
    SelectView(Option<u32>),
    /// Select the view that many places further, from the last one if none is selected.
    StepView(i32),
    /// Open or close the table of shortcuts.
    Help(bool),
    /// Tell the person something.
    Notify {
        /// How urgent it is.
        level: Level,
        /// What to say.
        text: String,
    },
    /// The person has read a notice.
    Dismiss(u64),
    /// Time went by.
    Elapsed {
        /// Milliseconds since the last such event.
        ms: u32,
    },
}
