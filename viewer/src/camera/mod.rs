//! The camera, and the pointer gestures and keys that move it.
//!
//! [`OrbitCamera`], [`Gesture`] and [`key_input`] are pure; `pointer` (browser only) feeds DOM events to them.

mod bounds;
mod gesture;
mod input;
mod keyboard;
mod orbit;
#[cfg(target_arch = "wasm32")]
mod pointer;
mod puck;

pub use bounds::Bounds;
pub use gesture::{Button, Gesture};
pub use input::{CameraInput, PointerInput, StandardView};
pub use keyboard::{Modifiers, key_input};
pub use orbit::OrbitCamera;
#[cfg(target_arch = "wasm32")]
pub use pointer::CameraPointer;
pub use puck::Puck;
