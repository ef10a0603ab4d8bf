//! How far the mesh is from a reference: a mesh, or a cloud, in the table frame, that a person loads from a file.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to the comparison | anywhere |
//! | `state` | reference, figures, tolerance | anywhere |
//! | `panel` | the reference, the figures | in a browser |
//! | `overlay` | the scale of the colours | in a browser |
//! | `controller` | requests to the mesh worker, and what comes back | in a browser |

mod events;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use events::DeviationEvent;
pub use state::Deviation;
