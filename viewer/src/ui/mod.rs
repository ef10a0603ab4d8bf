//! What panels are made with: the state to show, the ways to answer, the icons. The panels are real DOM, a function of
//! [`AppState`], rendered by Leptos. They know the state, and say what the person wants through [`Ui::send`] and
//! [`Ui::ask`]; socket, worker and graphics device are not their business, so they stay usable when any of these is gone.

pub(crate) mod icons;
pub(crate) mod modal;
pub(crate) mod object_url;
pub(crate) mod running;

use crate::camera::CameraInput;
use crate::export::Format;
use crate::features::FeatureEvent;
use crate::scene::section_export::SectionFormat;
use crate::state::notices::{Level, Topic};
use crate::state::{AppState, Event};
use leptos::prelude::*;

/// Something a person wants done that is no change of the state.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Move the camera.
    Camera(CameraInput),
    /// Download points or mesh.
    Export(Format),
    /// End the export that is being written.
    CancelExport,
    /// Download the section.
    ExportSection(SectionFormat),
    /// Pick what lies in the middle of the view.
    PickMiddle,
    /// Give a text to the clipboard; where the browser does not let the page, save it as a file of that name.
    Copy {
        /// The text.
        text: String,
        /// Name of the file.
        file: &'static str,
    },
    /// Give the clipboard a link to what is seen.
    CopyLink,
    /// Download the picture, with what its colours mean.
    SavePicture,
    /// Look at the model in one of these files in the place of the agent's; the others are what it names.
    OpenFiles(web_sys::FileList),
    /// Play what the agent keeps of the inspection that is shown.
    PlayInspection,
    /// Show what is played as it stood at this stop.
    ShowStop(u32),
    /// Ask the agent for the views before this number.
    EarlierViews(u32),
    /// Show the page in the language of this code.
    Language(&'static str),
    /// Load the page again.
    Reload,
}

/// What a panel gets.
#[derive(Clone, Copy)]
pub struct Ui {
    state: RwSignal<AppState>,
    send: UnsyncCallback<Event>,
    ask: UnsyncCallback<Command>,
}

impl Ui {
    /// * `send`: takes what happened.
    /// * `ask`: takes what is wanted.
    pub fn new(state: RwSignal<AppState>, send: UnsyncCallback<Event>, ask: UnsyncCallback<Command>) -> Self {
        Self { state, send, ask }
    }

    /// A part of the state that panels follow; they are updated only when it really changes.
    pub fn part<T: Clone + PartialEq + Send + Sync + 'static>(
        self,
        of: impl Fn(&AppState) -> T + Send + Sync + 'static,
    ) -> Memo<T> {
        let state = self.state;
        Memo::new(move |_| state.with(&of))
    }

    /// Reads the state as it is now, without following it.
    pub fn read<T>(self, of: impl FnOnce(&AppState) -> T) -> T {
        self.state.with_untracked(of)
    }

    /// Follows the state as a whole.
    pub fn follow<T>(self, of: impl FnOnce(&AppState) -> T) -> T {
        self.state.with(of)
    }

    /// Says what happened.
    pub fn send(self, event: Event) {
        self.send.run(event);
    }

    /// Says what happened to a tool.
    pub fn send_feature(self, event: impl Into<FeatureEvent>) {
        self.send(Event::Feature(event.into()));
    }

    /// Shows a short message to the person.
    pub fn notify(self, level: Level, topic: Topic, text: impl Into<String>) {
        self.send(Event::Notify { level, topic, text: text.into() });
    }

    /// Takes away what was said of a topic: it holds no more.
    pub fn retract(self, topic: Topic) {
        self.send(Event::Retract(topic));
    }

    /// Says what is wanted.
    pub fn ask(self, command: Command) {
        self.ask.run(command);
    }
}

/// What the browser keeps for the page; `None` where it keeps nothing.
pub(crate) fn storage() -> Option<web_sys::Storage> {
    web_sys::window()?.local_storage().ok().flatten()
}

/// A place in the table frame (metres) as the attribute `data-place` of an element that stays there.
pub(crate) fn anchor_place([x, y, z]: [f32; 3]) -> String {
    format!("{x} {y} {z}")
}
