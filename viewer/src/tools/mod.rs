//! What people do with the pointer and the keyboard: the camera and its gestures.
//!
//! [`OrbitCamera`], [`Gesture`] and [`key_input`] are pure; `pointer` (browser only) feeds DOM events to them.

mod bounds;
mod camera;
mod gesture;
mod input;
mod keyboard;
#[cfg(target_arch = "wasm32")]
mod pointer;

pub use bounds::Bounds;
pub use camera::OrbitCamera;
pub use gesture::{Button, Gesture};
pub use input::{CameraInput, StandardView};
pub use keyboard::{Modifiers, key_input};
#[cfg(target_arch = "wasm32")]
pub use pointer::CameraPointer;
