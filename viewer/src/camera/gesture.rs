//! From pointers going down, moving and going up to what is asked of the 3D view.
//!
//! | pointers | what |
//! |---|---|
//! | left button, one finger | primary drag: orbits, or draws with a tool that does |
//! | right or middle button, or left with Shift | secondary drag: pans, or orbits while the primary one draws |
//! | two fingers | pan by their middle, zoom by their distance about it |
//! | wheel | zoom about the pointer |
//!
//! A primary pointer that goes up near where it went down, alone all the while, was a click and moved nothing.

use super::{CameraInput, PointerInput};
use glam::Vec2;

/// What went down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// Left mouse button, a finger or the tip of a pen.
    Primary,
    /// Any other button, or the primary one with Shift held.
    Secondary,
}

#[derive(Clone, Copy, Debug)]
struct Pointer {
    id: i32,
    at: Vec2,
    button: Button,
    /// Whether it may still turn out to be a click.
    is_click: bool,
}

/// The pointers that are down. Positions are CSS pixels from the viewport's top left corner.
#[derive(Clone, Debug, Default)]
pub struct Gesture {
    pointers: Vec<Pointer>,
}

/// Pointers past the second are ignored; fingers closer than this do not pinch (CSS pixels).
const MIN_PINCH: f32 = 8.0;

/// A pointer that stays this close to where it went down does not drag (CSS pixels): a hand is never quite still.
const CLICK_REACH: f32 = 3.0;

/// How far one wheel pixel zooms: a notch of 100 px is a factor of 1.16.
const ZOOM_PER_WHEEL_PIXEL: f32 = 0.0015;

/// The largest zoom that one wheel event may ask for, in wheel pixels.
const MAX_WHEEL: f32 = 400.0;

impl Gesture {
    /// A pointer went down.
    pub fn down(&mut self, id: i32, button: Button, at: Vec2) {
        self.up(id);
        if self.pointers.len() < 2 && at.is_finite() {
            let is_click = self.pointers.is_empty();
            self.pointers.iter_mut().for_each(|p| p.is_click = false);
            self.pointers.push(Pointer { id, at, button, is_click });
        }
    }

    /// A pointer moved; what that asks for, in order.
    pub fn moved(&mut self, id: i32, at: Vec2) -> Vec<PointerInput> {
        let Some(index) = self.pointers.iter().position(|p| p.id == id).filter(|_| at.is_finite()) else {
            return Vec::new();
        };
        let before = self.pointers[index].at;
        if self.pointers[index].is_click && at.distance(before) <= CLICK_REACH {
            return Vec::new();
        }
        self.pointers[index].is_click = false;
        let (middle, span) = self.middle_and_span();
        self.pointers[index].at = at;
        if self.pointers.len() == 1 {
            return vec![PointerInput::Drag { button: self.pointers[0].button, from: before, to: at }];
        }
        let (new_middle, new_span) = self.middle_and_span();
        let mut inputs = vec![PointerInput::Camera(CameraInput::Pan { pixels: new_middle - middle })];
        if span > MIN_PINCH && new_span > MIN_PINCH {
            let zoom = CameraInput::Zoom { factor: span / new_span, at: Some(new_middle) };
            inputs.push(PointerInput::Camera(zoom));
        }
        inputs
    }

    /// A pointer went up or was cancelled: a click where it had gone down, if it stayed there, else the end of a drag.
    pub fn up(&mut self, id: i32) -> Option<PointerInput> {
        let index = self.pointers.iter().position(|p| p.id == id)?;
        let pointer = self.pointers.remove(index);
        match (pointer.is_click, pointer.button) {
            (true, Button::Primary) => Some(PointerInput::Click(pointer.at)),
            (true, Button::Secondary) => None,
            (false, _) => Some(PointerInput::Lift),
        }
    }

    /// Whether anything is down.
    #[cfg(test)]
    pub fn is_active(&self) -> bool {
        !self.pointers.is_empty()
    }

    /// The wheel turned by so many pixels (down is positive: away) with the pointer at `at`.
    pub fn wheel(pixels: f32, at: Vec2) -> CameraInput {
        let pixels = if pixels.is_finite() { pixels.clamp(-MAX_WHEEL, MAX_WHEEL) } else { 0.0 };
        CameraInput::Zoom { factor: (pixels * ZOOM_PER_WHEEL_PIXEL).exp(), at: Some(at) }
    }

    fn middle_and_span(&self) -> (Vec2, f32) {
        match self.pointers.as_slice() {
            [a, b] => ((a.at + b.at) / 2.0, a.at.distance(b.at)),
            [a] => (a.at, 0.0),
            _ => (Vec2::ZERO, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drag(button: Button, from: Vec2, to: Vec2) -> PointerInput {
        PointerInput::Drag { button, from, to }
    }

    #[test]
    fn one_pointer_drags_with_its_button() {
        let step = Vec2::new(3.0, -2.0);
        let mut gesture = Gesture::default();
        gesture.down(1, Button::Primary, Vec2::ZERO);
        assert_eq!(gesture.moved(1, step), [drag(Button::Primary, Vec2::ZERO, step)]);
        assert_eq!(gesture.up(1), Some(PointerInput::Lift));
        assert!(gesture.moved(1, step).is_empty() && !gesture.is_active());
        gesture.down(1, Button::Secondary, Vec2::ZERO);
        assert_eq!(gesture.moved(1, step), [drag(Button::Secondary, Vec2::ZERO, step)]);
    }

    #[test]
    fn a_pointer_that_hardly_moves_clicks_and_one_that_moves_drags() {
        let (mut gesture, start) = (Gesture::default(), Vec2::new(50.0, 60.0));
        gesture.down(1, Button::Primary, start);
        assert!(gesture.moved(1, start + Vec2::new(2.0, -1.0)).is_empty(), "the camera stands still");
        assert_eq!(gesture.up(1), Some(PointerInput::Click(start)));

        gesture.down(1, Button::Primary, start);
        let far = Vec2::new(9.0, 0.0);
        let whole = [drag(Button::Primary, start, start + far)];
        assert_eq!(gesture.moved(1, start + far), whole, "nothing of the drag is lost");
        gesture.moved(1, start);
        assert_eq!(gesture.up(1), Some(PointerInput::Lift), "back where it began, and a drag all the same");

        gesture.down(1, Button::Secondary, start);
        assert_eq!(gesture.up(1), None);
        gesture.down(1, Button::Primary, start);
        gesture.down(2, Button::Primary, start + far);
        let lift = Some(PointerInput::Lift);
        assert_eq!((gesture.up(2), gesture.up(1)), (lift, lift), "two fingers");
        assert_eq!(gesture.up(7), None);
    }

    #[test]
    fn spreading_two_fingers_zooms_in_about_their_middle() {
        let mut gesture = Gesture::default();
        gesture.down(1, Button::Primary, Vec2::new(100.0, 100.0));
        gesture.down(2, Button::Primary, Vec2::new(200.0, 100.0));
        let inputs = gesture.moved(2, Vec2::new(300.0, 100.0));
        let middle = Vec2::new(200.0, 100.0);
        assert_eq!(
            inputs,
            [
                PointerInput::Camera(CameraInput::Pan { pixels: Vec2::new(50.0, 0.0) }),
                PointerInput::Camera(CameraInput::Zoom { factor: 0.5, at: Some(middle) }),
            ]
        );
    }

    #[test]
    fn lifting_one_of_two_fingers_goes_on_dragging_without_a_jump() {
        let mut gesture = Gesture::default();
        gesture.down(1, Button::Primary, Vec2::new(100.0, 100.0));
        gesture.down(2, Button::Primary, Vec2::new(200.0, 100.0));
        gesture.up(1);
        let (from, to) = (Vec2::new(200.0, 100.0), Vec2::new(201.0, 100.0));
        assert_eq!(gesture.moved(2, to), [drag(Button::Primary, from, to)]);
    }

    #[test]
    fn a_third_finger_and_wild_numbers_are_ignored() {
        let mut gesture = Gesture::default();
        for id in 0..3 {
            gesture.down(id, Button::Primary, Vec2::splat(id as f32 * 50.0));
        }
        assert!(gesture.moved(2, Vec2::ONE).is_empty());
        assert!(gesture.moved(0, Vec2::NAN).is_empty());
        for wheel in [f32::NAN, f32::INFINITY, 1e30] {
            let CameraInput::Zoom { factor, .. } = Gesture::wheel(wheel, Vec2::ZERO) else { panic!("not a zoom") };
            assert!(factor.is_finite() && factor > 0.0 && factor < 2.0);
        }
    }
}
