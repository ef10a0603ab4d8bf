//! The photographs as the colours of the mesh ([`crate::display::ColorMode::Photo`]): each place of the surface shows the photograph
//! that shows it best from where the model is looked at.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to them | anywhere |
//! | `state` | which photographs colour the mesh, and what keeps them from it | anywhere |
//! | `choice` | which photographs are best for a camera | anywhere |
//! | `slots` | which photographs the graphics device has; those unused for longest make room | anywhere |
//! | `pixels` | smaller pictures of a photograph | anywhere |
//! | `surface` | the surface as the choice looks at it | anywhere |
//! | `controller` | chooses when the camera rests or has turned, and loads | in a browser |
//! | `overlay` | says what is seen | in a browser |
//!
//! Small pictures come first, those in full size afterwards, one after the other; what is shown stays until others are there.

mod events;
mod state;

// The page alone uses them.
#[cfg(any(test, target_arch = "wasm32"))]
mod choice;
#[cfg(any(test, target_arch = "wasm32"))]
mod pixels;
#[cfg(any(test, target_arch = "wasm32"))]
mod slots;
#[cfg(any(test, target_arch = "wasm32"))]
mod surface;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;

pub use events::PhotoEvent;
pub use state::{Photo, ShownPhotograph, Standing};
