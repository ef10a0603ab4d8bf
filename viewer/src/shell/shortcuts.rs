//! What a key does. The camera's own keys are in [`crate::camera::key_input`]; these are the page's.

use crate::camera::{CameraInput, Modifiers, key_input};
use crate::state::{AppState, Event};

/// What has the keyboard's focus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Focus {
    /// The model, or nothing in particular.
    Model,
    /// A control that has a use for arrows, space and enter itself.
    Control,
}

/// What a key asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A change of the state.
    State(Box<Event>),
    /// A move of the camera.
    Camera(CameraInput),
}

/// What `key` (DOM `KeyboardEvent.key`) asks for in this state; `None` leaves it to the browser.
pub fn action(key: &str, modifiers: Modifiers, focus: Focus, state: &AppState) -> Option<Action> {
    if modifiers.command {
        return None;
    }
    if state.help_open {
        // The dialog is modal: it closes by the key that opened it, and by Escape through the browser.
        return (key == "?").then_some(Action::State(Event::Help(false).into()));
    }
    let display = &state.display;
    let event = match key {
        "?" => Event::Help(true),
        "c" => Event::ColorMode(display.color_mode.stepped(1)),
        "C" => Event::ColorMode(display.color_mode.stepped(-1)),
        "a" | "A" => Event::AllComponents,
        "o" | "O" => Event::ShowOutliers(!display.outliers),
        "b" | "B" => Event::ShowBackground(!display.background),
        "t" | "T" => Event::Theme(display.toggled_theme()),
        "n" | "N" => Event::StepView(1),
        "p" | "P" => Event::StepView(-1),
        "Escape" if state.views.selected().is_some() => Event::SelectView(None),
        _ if focus == Focus::Control && key.starts_with("Arrow") => return None,
        _ => return key_input(key, modifiers).map(Action::Camera),
    };
    Some(Action::State(event.into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::ColorMode;

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
    fn escape_without_a_selection_and_the_browsers_own_keys_are_left_alone() {
        let state = AppState::default();
        assert_eq!(pressed("Escape", Focus::Model, &state), None);
        let command = Modifiers { command: true, ..Modifiers::default() };
        assert_eq!(action("a", command, Focus::Model, &state), None);
    }
}
