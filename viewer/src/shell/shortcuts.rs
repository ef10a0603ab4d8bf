//! What a key does. The camera's own keys are in [`crate::camera::key_input`]; these are the page's.

use super::action::Action;
use crate::camera::{Modifiers, key_input};
use crate::features::FeatureEvent;
use crate::features::correct::{CorrectEvent, Tool};
use crate::features::evidence::EvidenceEvent;
use crate::features::inspect::InspectEvent;
use crate::features::measure::{Kind, MeasureEvent};
use crate::features::review::{ReviewEvent, Ruling};
use crate::features::section::SectionEvent;
use crate::features::timeline::TimelineEvent;
use crate::state::{AppState, Event};

/// What has the keyboard's focus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Focus {
    /// A field that a person writes into.
    Text,
    /// The model, or nothing in particular.
    Model,
    /// A control that has a use for arrows, space and enter itself.
    Control,
}

/// What `key` (DOM `KeyboardEvent.key`) asks for in this state; `None` leaves it to the browser.
pub fn action(key: &str, modifiers: Modifiers, focus: Focus, state: &AppState) -> Option<Action> {
    if modifiers.command {
        // The key that many programs have for it.
        let is_wanted = key.eq_ignore_ascii_case("k") && !state.help_open;
        return is_wanted.then(|| Event::Palette(!state.palette_open).into());
    }
    if state.palette_open {
        // The dialog is modal, and has keys of its own.
        return None;
    }
    if focus == Focus::Text {
        // Letters are the field's.
        let is_drafting = key == "Escape" && state.features.review.draft.is_some();
        return is_drafting.then(|| feature(ReviewEvent::Discard).into());
    }
    if state.help_open {
        // The dialog is modal: it closes by the key that opened it, and by Escape through the browser.
        return (key == "?").then(|| Event::Help(false).into());
    }
    let display = &state.display;
    let event = match key {
        "?" => Event::Help(true),
        "c" => Event::ColorMode(display.color_mode.stepped(1, &state.color_modes())),
        "C" => Event::ColorMode(display.color_mode.stepped(-1, &state.color_modes())),
        "a" | "A" => Event::AllComponents,
        "o" | "O" => Event::ShowOutliers(!display.outliers),
        "b" | "B" => Event::ShowBackground(!display.background),
        "t" | "T" => Event::Theme(display.toggled_theme()),
        "n" | "N" => Event::StepView(1),
        "p" | "P" => Event::StepView(-1),
        "l" | "L" => feature(InspectEvent::Pin),
        "m" | "M" => feature(measuring(Kind::Distance, state)),
        "g" | "G" => feature(measuring(Kind::Angle, state)),
        "s" | "S" => feature(SectionEvent::Show(!state.features.section.is_on && state.has_model())),
        "v" | "V" | "d" | "D" | "u" | "U" | "w" | "W" if state.features.section.is_on => {
            feature(sectioning(key, modifiers, state))
        }
        "q" | "Q" => feature(correcting(if modifiers.shift { Tool::Outline } else { Tool::Brush }, state)?),
        "z" | "Z" => feature(if modifiers.shift { CorrectEvent::Redo } else { CorrectEvent::Undo }),
        "[" | "]" if state.features.correct.tool.is_some() => {
            feature(CorrectEvent::Step(if key == "[" { -1 } else { 1 }))
        }
        "[" | "]" if state.features.timeline.is_open() => feature(TimelineEvent::Step(if key == "[" { -1 } else { 1 })),
        "e" | "E" if !state.features.evidence.sights.is_empty() => {
            feature(EvidenceEvent::Open(!state.features.evidence.is_open))
        }
        "j" | "J" => feature(ReviewEvent::Step(1)),
        "k" | "K" => feature(ReviewEvent::Step(-1)),
        "y" | "Y" | "r" | "R" | "x" | "X" | "i" | "I" => feature(ReviewEvent::Draft(ruling(key)?)),
        "." if state.features.evidence.shown().is_some() => feature(EvidenceEvent::Step(1)),
        "," if state.features.evidence.shown().is_some() => feature(EvidenceEvent::Step(-1)),
        "h" | "H" if modifiers.shift => return Some(Action::SavePicture),
        "h" | "H" => return Some(Action::CopyLink),
        "Enter" if focus == Focus::Model => return Some(Action::PickMiddle),
        "Delete" if focus == Focus::Model => return deletion(modifiers, state),
        "Escape" => return escape(state),
        _ if focus == Focus::Control && key.starts_with("Arrow") => return None,
        _ => return key_input(key, modifiers).map(Action::Camera),
    };
    Some(event.into())
}

/// The decision that a key stands for.
fn ruling(key: &str) -> Option<Ruling> {
    Ruling::ALL.into_iter().find(|ruling| ruling.shortcut().eq_ignore_ascii_case(key))
}

fn feature(event: impl Into<FeatureEvent>) -> Event {
    Event::Feature(event.into())
}

/// Begins to measure, or ends it where this is being measured.
fn measuring(kind: Kind, state: &AppState) -> MeasureEvent {
    let is_chosen = state.features.measure.kind == Some(kind);
    MeasureEvent::Choose((!is_chosen && state.has_model()).then_some(kind))
}

/// Takes a tool of corrections in hand, or lays it down; `None` where nobody may correct.
fn correcting(tool: Tool, state: &AppState) -> Option<CorrectEvent> {
    let is_chosen = state.features.correct.tool == Some(tool);
    let may = state.may_review() && state.features.review.is_open();
    (may || is_chosen).then_some(CorrectEvent::Choose((!is_chosen).then_some(tool)))
}

/// How far a key moves the section plane, metres; with Shift a tenth of it.
const STEP: f64 = 1e-3;

/// What a key asks of the section plane.
fn sectioning(key: &str, modifiers: Modifiers, state: &AppState) -> SectionEvent {
    let step = if modifiers.shift { 0.1 * STEP } else { STEP };
    match key {
        "v" | "V" => SectionEvent::Flip,
        "w" | "W" => SectionEvent::Read(!state.features.section.is_reading),
        "d" | "D" => SectionEvent::Deepen(step),
        _ => SectionEvent::Deepen(-step),
    }
}

/// Escape takes back one thing at a time, what is uppermost first.
fn escape(state: &AppState) -> Option<Action> {
    let features = &state.features;
    let event = if features.review.draft.is_some() {
        feature(ReviewEvent::Discard)
    } else if features.measure.kind.is_some() {
        feature(MeasureEvent::Back)
    } else if features.correct.is_drawing() {
        feature(CorrectEvent::Undo)
    } else if features.correct.tool.is_some() {
        feature(CorrectEvent::Choose(None))
    } else if features.section.is_reading {
        feature(SectionEvent::Back)
    } else if features.evidence.shown().is_some() {
        feature(EvidenceEvent::Open(false))
    } else if features.inspect.picked.is_some() || features.inspect.missed {
        feature(InspectEvent::Close)
    } else if state.views.selected().is_some() {
        Event::SelectView(None)
    } else if features.review.selected.is_some() {
        feature(ReviewEvent::Select(None))
    } else {
        return None;
    };
    Some(event.into())
}

/// Delete takes the newest measurement away while one measures, else the newest label; with Shift all of them.
fn deletion(modifiers: Modifiers, state: &AppState) -> Option<Action> {
    let features = &state.features;
    let event = match (features.measure.kind.is_some(), modifiers.shift) {
        (true, false) => feature(MeasureEvent::RemoveLast),
        (true, true) => feature(MeasureEvent::RemoveAll),
        (false, _) if features.inspect.labels.is_empty() => return None,
        (false, false) => feature(InspectEvent::RemoveLast),
        (false, true) => feature(InspectEvent::RemoveAll),
    };
    Some(event.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraInput;
    use crate::display::ColorMode;
    use crate::features::inspect::PickedPoint;
    use semascan_model::SemanticPoint;

    fn pressed(key: &str, focus: Focus, state: &AppState) -> Option<Action> {
        action(key, Modifiers::default(), focus, state)
    }

    #[test]
    fn arrows_belong_to_the_control_that_has_the_focus() {
        let state = AppState::default();
        assert_eq!(pressed("ArrowLeft", Focus::Control, &state), None);
        assert!(matches!(pressed("ArrowLeft", Focus::Model, &state), Some(Action::Camera(_))));
        assert_eq!(pressed("f", Focus::Control, &state), Some(Action::Camera(CameraInput::Fit)));
    }

    #[test]
    fn an_open_help_swallows_all_but_its_own_key() {
        let mut state = AppState::default();
        state.reduce(&Event::Help(true));
        assert_eq!(pressed("c", Focus::Model, &state), None);
        assert_eq!(pressed("?", Focus::Model, &state), Some(Action::State(Event::Help(false).into())));
    }

    #[test]
    fn the_palette_opens_from_anywhere_and_keeps_the_keys_to_itself() {
        let command = Modifiers { command: true, ..Modifiers::default() };
        let mut state = AppState::default();
        assert_eq!(action("k", command, Focus::Text, &state), Some(Event::Palette(true).into()));
        state.reduce(&Event::Palette(true));
        assert_eq!(pressed("f", Focus::Model, &state), None);
        assert_eq!(action("K", command, Focus::Text, &state), Some(Event::Palette(false).into()));
        state.reduce(&Event::Palette(false));
        state.reduce(&Event::Help(true));
        assert_eq!(action("k", command, Focus::Model, &state), None, "two dialogs at once");
    }

    #[test]
    fn the_color_modes_go_round() {
        let mut state = AppState::default();
        let start = state.display.color_mode;
        for _ in ColorMode::ALL {
            match pressed("c", Focus::Model, &state) {
                Some(Action::State(event)) => state.reduce(&event),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(state.display.color_mode, start);
        let back = Some(Action::State(Event::ColorMode(ColorMode::Appearance).into()));
        assert_eq!(pressed("C", Focus::Model, &state), back);
    }

    #[test]
    fn the_middle_is_picked_from_the_model_and_not_from_a_control() {
        let state = AppState::default();
        assert_eq!(pressed("Enter", Focus::Model, &state), Some(Action::PickMiddle));
        assert_eq!(pressed("Enter", Focus::Control, &state), None, "it is the control's");
        assert_eq!(pressed("Delete", Focus::Control, &state), None);
    }

    #[test]
    fn escape_and_delete_take_back_one_thing_at_a_time() {
        let point = PickedPoint::of(&SemanticPoint::UNKNOWN, 1e-3, false);
        let mut state = AppState::default();
        let press = |state: &mut AppState, key: &str, shift: bool| {
            let modifiers = Modifiers { shift, ..Modifiers::default() };
            match action(key, modifiers, Focus::Model, state) {
                Some(Action::State(event)) => state.reduce(&event),
                other => panic!("{key}: {other:?}"),
            }
        };
        state.reduce(&feature(InspectEvent::Picked(Some(point))));
        press(&mut state, "l", false);
        assert_eq!(state.features.inspect.labels.len(), 1);
        state.reduce(&feature(MeasureEvent::Choose(Some(Kind::Distance))));
        state.reduce(&feature(MeasureEvent::Picked(Some(point))));
        press(&mut state, "Escape", false);
        assert_eq!((state.features.measure.taken.len(), state.features.measure.kind), (0, Some(Kind::Distance)));
        press(&mut state, "Escape", false);
        assert!(state.features.measure.kind.is_none() && state.features.inspect.picked.is_some());
        press(&mut state, "Escape", false);
        assert!(state.features.inspect.picked.is_none() && state.features.inspect.labels.len() == 1);
        press(&mut state, "Delete", false);
        assert!(state.features.inspect.labels.is_empty());
        assert_eq!(pressed("Delete", Focus::Model, &state), None);
        press(&mut state, "m", false);
        assert_eq!(state.features.measure.kind, None, "without a model there is nothing to measure");
    }

    #[test]
    fn the_section_plane_has_keys_while_there_is_one() {
        let does = |event: SectionEvent| Some(Action::State(feature(event).into()));
        let mut state = AppState::default();
        assert_eq!(pressed("d", Focus::Model, &state), None);
        assert_eq!(
            pressed("s", Focus::Model, &state),
            does(SectionEvent::Show(false)),
            "without a model there is none"
        );
        state.reduce(&feature(SectionEvent::Show(true)));
        assert_eq!(pressed("d", Focus::Control, &state), does(SectionEvent::Deepen(STEP)));
        let shift = Modifiers { shift: true, ..Modifiers::default() };
        assert_eq!(action("U", shift, Focus::Model, &state), does(SectionEvent::Deepen(-0.1 * STEP)));
        assert_eq!(pressed("Escape", Focus::Model, &state), None);
        state.reduce(&feature(SectionEvent::Read(true)));
        assert_eq!(pressed("Escape", Focus::Model, &state), does(SectionEvent::Back));
        assert_eq!(pressed("s", Focus::Model, &state), does(SectionEvent::Show(false)));
    }

    #[test]
    fn escape_without_a_selection_and_the_browsers_own_keys_are_left_alone() {
        let state = AppState::default();
        assert_eq!(pressed("Escape", Focus::Model, &state), None);
        let command = Modifiers { command: true, ..Modifiers::default() };
        assert_eq!(action("a", command, Focus::Model, &state), None);
    }
}
