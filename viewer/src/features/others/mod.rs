//! Others who look at the same inspection: where they point is shown over the 3D view, and they are told where this person does.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to the tool | anywhere |
//! | `state` | who points where, and for how long | anywhere |
//! | `controller` | tells the agent where this person points | in a browser |
//! | `overlay` | the marks | in a browser |
//!
//! A page says where its pointer rests, or what was picked, and nothing while it moves; the agent passes it on and keeps nothing.

mod events;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;

pub use events::OthersEvent;
pub use state::{Other, Others};
