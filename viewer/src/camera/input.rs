//! What may be asked of the camera: the one vocabulary of pointer, keyboard and panels; and what a pointer does besides.

use super::Button;
use glam::{Vec2, Vec3};

/// A direction to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From the front (-y), a little from the right and above.
    Isometric,
    /// From -y towards +y.
    Front,
    /// From +y towards -y.
    Back,
    /// From -x towards +x.
    Left,
    /// From +x towards -x.
    Right,
    /// From above.
    Top,
    /// From below.
    Bottom,
}

/// What people ask of the camera; pointer, keyboard and panels all speak this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraInput {
    /// Turn about the target by a drag of so many CSS pixels.
    Orbit {
        /// CSS pixels to the right and down.
        pixels: Vec2,
    },
    /// Move with a drag of so many CSS pixels: the point at the target's depth stays under the pointer.
    Pan {
        /// CSS pixels to the right and down.
        pixels: Vec2,
    },
    /// Come closer (`factor` < 1) or go away (> 1); the point under `at` stays where it is.
    Zoom {
        /// What the distance is multiplied with.
        factor: f32,
        /// Where in the viewport, CSS pixels from its top left corner; `None` for the middle.
        at: Option<Vec2>,
    },
    /// Show everything.
    Fit,
    /// Look from a standard direction and show everything.
    View(StandardView),
    /// Look at a place from another one.
    From {
        /// Where from, metres, table frame.
        eye: Vec3,
        /// What at, metres, table frame.
        target: Vec3,
    },
}

/// What the pointer does on the 3D view. Places are CSS pixels from the viewport's top left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointerInput {
    /// It moves the camera.
    Camera(CameraInput),
    /// It alone was dragged from one place to another with a button down.
    Drag {
        /// The button.
        button: Button,
        /// From here.
        from: Vec2,
        /// To here.
        to: Vec2,
    },
    /// A drag is over.
    Lift,
    /// It clicked there.
    Click(Vec2),
    /// A mouse is there with no button down; `None` once it has left.
    Hover(Option<Vec2>),
}
