//! Everything that can happen to the viewer.

use super::account::Account;
use super::connection::GraphicsStatus;
use super::export_choice::{ExportChoice, Exporting};
use super::legend::ClassCount;
use super::notices::{Level, Topic};
use crate::display::{ColorMode, ShareScales, Theme};
use crate::features::FeatureEvent;
use crate::link::LinkEvent;
use std::collections::BTreeMap;

/// One thing that happened, from the agent, the graphics device, the clock or the person.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Something happened on the link to the agent.
    Link(Box<LinkEvent>),
    /// The model as held was counted.
    Figures {
        /// By component class, in the order of the class ids.
        classes: Vec<ClassCount>,
        /// Voxel edge that came with the points, in metres; 0 without points. An inspection that has not captured its
        /// first view when the viewer connects does not know it yet.
        voxel: f64,
        /// Scales of the colours that mean shares.
        scales: ShareScales,
        /// Hash of the model as held.
        hash: u64,
    },
    /// A file of this name is shown, or about to be, in the place of an agent's model.
    Opened(String),
    /// What the agent keeps of the inspection is shown in the place of its stream.
    Recorded,
    /// Where the photographs in full size are that came with a file: addresses by view.
    Photographs(BTreeMap<u32, String>),
    /// The graphics device changed.
    Graphics(GraphicsStatus),
    /// The agent said who the person is.
    Account(Account),
    /// The agent is not the one that the page came from: its host.
    ForeignAgent(String),
    /// The person chose what the colours mean.
    ColorMode(ColorMode),
    /// The person chose a theme.
    Theme(Theme),
    /// The browser lets pages speak with devices of people's choice.
    HasDevices,
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
    /// Something happened to a tool.
    Feature(FeatureEvent),
    /// Select a view by its index, or none.
    SelectView(Option<u32>),
    /// Select the view that many places further, from the last one if none is selected.
    StepView(i32),
    /// The person chose how the model is exported.
    ExportChoice(ExportChoice),
    /// An export is so far, or over.
    Exporting(Option<Exporting>),
    /// Open or close the table of shortcuts.
    Help(bool),
    /// Open or close the command palette.
    Palette(bool),
    /// There is something to say to the person.
    Notify {
        /// How urgent it is.
        level: Level,
        /// What it is about.
        topic: Topic,
        /// What to say.
        text: String,
    },
    /// What was said of a topic holds no more.
    Retract(Topic),
    /// The person has read a notice.
    Dismiss(u64),
    /// Time went by.
    Elapsed {
        /// Milliseconds since the last such event.
        ms: u32,
    },
}

impl From<LinkEvent> for Event {
    fn from(event: LinkEvent) -> Self {
        Self::Link(Box::new(event))
    }
}

impl From<FeatureEvent> for Event {
    fn from(event: FeatureEvent) -> Self {
        Self::Feature(event)
    }
}
