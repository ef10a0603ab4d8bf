//! Keys that move the camera. Every move of the pointer has a key, so the model can be looked at without one.

use super::{CameraInput, StandardView};
use glam::Vec2;

/// The modifier keys held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modifiers {
    /// Shift.
    pub shift: bool,
    /// Control, Alt or Command: the key belongs to the browser.
    pub command: bool,
}

/// CSS pixels of drag that one press of an arrow key stands for.
const STEP: f32 = 40.0;

/// What one press of plus or minus does to the distance.
const ZOOM: f32 = 1.2;

/// What a key (DOM `KeyboardEvent.key`) asks of the camera; `None` if it is not the camera's.
///
/// Arrows orbit, with Shift they pan; `+` and `-` zoom; `f` fits; `1`..`7` look from isometric, front, back, left, right,
/// top, bottom.
pub fn key_input(key: &str, modifiers: Modifiers) -> Option<CameraInput> {
    if modifiers.command {
        return None;
    }
    let arrow = |x: f32, y: f32| {
        let pixels = Vec2::new(x, y) * STEP;
        // An arrow turns or moves the view, as scrolling does: the model goes the other way.
        if modifiers.shift { CameraInput::Pan { pixels: -pixels } } else { CameraInput::Orbit { pixels } }
    };
    Some(match key {
        "ArrowLeft" => arrow(-1.0, 0.0),
        "ArrowRight" => arrow(1.0, 0.0),
        "ArrowUp" => arrow(0.0, -1.0),
        "ArrowDown" => arrow(0.0, 1.0),
        "+" | "=" => CameraInput::Zoom { factor: 1.0 / ZOOM, at: None },
        "-" | "_" => CameraInput::Zoom { factor: ZOOM, at: None },
        "f" | "F" => CameraInput::Fit,
        "1" => CameraInput::View(StandardView::Isometric),
        "2" => CameraInput::View(StandardView::Front),
        "3" => CameraInput::View(StandardView::Back),
        "4" => CameraInput::View(StandardView::Left),
        "5" => CameraInput::View(StandardView::Right),
        "6" => CameraInput::View(StandardView::Top),
        "7" => CameraInput::View(StandardView::Bottom),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_browsers_shortcuts_stay_the_browsers() {
        let command = Modifiers { command: true, ..Modifiers::default() };
        assert_eq!(key_input("f", command), None);
        assert_eq!(key_input("+", command), None);
        assert_eq!(key_input("q", Modifiers::default()), None);
    }

    #[test]
    fn shift_turns_orbiting_into_panning() {
        let shift = Modifiers { shift: true, ..Modifiers::default() };
        assert!(matches!(key_input("ArrowLeft", Modifiers::default()), Some(CameraInput::Orbit { .. })));
        assert!(matches!(key_input("ArrowLeft", shift), Some(CameraInput::Pan { .. })));
    }

    #[test]
    fn plus_undoes_minus() {
        let factor = |key| match key_input(key, Modifiers::default()) {
            Some(CameraInput::Zoom { factor, .. }) => factor,
            other => panic!("{other:?}"),
        };
        assert!((factor("+") * factor("-") - 1.0).abs() < 1e-6);
    }
}
