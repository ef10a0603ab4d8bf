//! A puck with six axes (3Dconnexion's SpaceMouse), which is held as if it were the model: the model follows the hand. Rolling is
//! left out, since z stays up.

use super::CameraInput;
use glam::{Vec2, Vec3};

/// Of the viewport's height, by which a puck that is pushed aside as far as it goes moves the model in a second.
const PAN: f32 = 0.6;
/// By what a puck that is pushed or pulled as far as it goes multiplies the distance in a second, as a logarithm.
const ZOOM: f32 = 1.0;
/// Of the viewport's height, which is half a turn, by which one that is tilted or twisted as far as it goes turns the model.
const ORBIT: f32 = 0.6;
/// Below this share of its way a puck counts as untouched.
const DEAD: f32 = 0.02;
/// A page that was not drawn for longer than this does not make up for it, seconds.
const LONGEST: f32 = 0.1;

/// How far a puck is moved on each of its axes, as shares of the whole way, -1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Puck {
    /// To the right, towards the person, and down.
    pub translation: Vec3,
    /// About the same axes, right-handed: tilted towards the person, rolled, and twisted clockwise as seen from above.
    pub rotation: Vec3,
}

impl Puck {
    /// What it asks of the camera after so many seconds of holding it there, in a viewport of a height in CSS pixels.
    pub fn inputs(self, seconds: f32, height: f32) -> Vec<CameraInput> {
        if !(self.translation.is_finite() && self.rotation.is_finite() && seconds > 0.0 && height.is_finite()) {
            return Vec::new();
        }
        let seconds = seconds.min(LONGEST);
        // Slow near the middle, for fine moves.
        let speed = |way: f32| if way.abs() < DEAD { 0.0 } else { way.clamp(-1.0, 1.0) * way.abs().min(1.0) };
        let (moved, turned) = (self.translation.to_array().map(speed), self.rotation.to_array().map(speed));
        let pan = Vec2::new(moved[0], moved[2]) * (PAN * height * seconds);
        let orbit = Vec2::new(-turned[2], turned[0]) * (ORBIT * height * seconds);
        let mut inputs = Vec::new();
        if pan != Vec2::ZERO {
            inputs.push(CameraInput::Pan { pixels: pan });
        }
        if moved[1] != 0.0 {
            inputs.push(CameraInput::Zoom { factor: (-moved[1] * ZOOM * seconds).exp(), at: None });
        }
        if orbit != Vec2::ZERO {
            inputs.push(CameraInput::Orbit { pixels: orbit });
        }
        inputs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::OrbitCamera;

    fn after(puck: Puck) -> (OrbitCamera, OrbitCamera) {
        let before = OrbitCamera::default();
        let mut camera = before;
        for _ in 0..20 {
            for input in puck.inputs(0.05, before.viewport().y) {
                camera.apply(input, None);
            }
        }
        (before, camera)
    }

    /// Where the camera sees a point beside the target.
    fn seen(camera: &OrbitCamera, point: Vec3) -> (Vec2, f32) {
        camera.project(point).expect("before the eye")
    }

    #[test]
    fn the_model_follows_the_hand() {
        let point = OrbitCamera::default().target();
        let pushed = |translation| after(Puck { translation, ..Puck::default() });
        let (before, right) = pushed(Vec3::X);
        assert!(seen(&right, point).0.x > seen(&before, point).0.x + 100.0);
        let (before, down) = pushed(Vec3::Z);
        assert!(seen(&down, point).0.y > seen(&before, point).0.y + 100.0);
        let (before, nearer) = pushed(Vec3::Y);
        assert!(seen(&nearer, point).1 < 0.5 * seen(&before, point).1);

        let twisted = |rotation| after(Puck { rotation, ..Puck::default() });
        // What is nearest moves to the left where the puck is twisted clockwise as seen from above, and down where it is tilted.
        let front = point - OrbitCamera::default().forward().with_z(0.0) * 0.05;
        let (before, clockwise) = twisted(Vec3::Z * 0.5);
        assert!(seen(&clockwise, front).0.x < seen(&before, front).0.x - 5.0);
        let (before, tilted) = twisted(Vec3::X * 0.5);
        assert!(seen(&tilted, front).0.y > seen(&before, front).0.y + 5.0);
        let (before, rolled) = twisted(Vec3::Y);
        assert_eq!(before, rolled);
    }

    #[test]
    fn one_that_is_let_go_or_broken_moves_nothing() {
        let puck = |translation, rotation| Puck { translation, rotation };
        assert!(puck(Vec3::splat(0.01), Vec3::splat(-0.01)).inputs(0.016, 600.0).is_empty());
        assert!(puck(Vec3::splat(f32::NAN), Vec3::ZERO).inputs(0.016, 600.0).is_empty());
        assert!(puck(Vec3::ONE, Vec3::ONE).inputs(0.0, 600.0).is_empty());
        // A pause is not made up for.
        assert_eq!(puck(Vec3::X, Vec3::ZERO).inputs(60.0, 600.0), puck(Vec3::X, Vec3::ZERO).inputs(LONGEST, 600.0));
    }
}
