//! What lies at a point that a person picks: a card says all that the model knows of it, and a pinned label stays at it.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `picked_point` | [`PickedPoint`]: a place on the surface, and what is known of it | anywhere |
//! | `events` | what happens to the tool | anywhere |
//! | `state` | the point of the card, what the mouse rests on, the labels | anywhere |
//! | `words` | a point in words and figures | anywhere |
//! | `overlay` | the card, and the labels at their points | in a browser |
//! | `panel` | the list of the labels | in a browser |
//! | `controller` | notices that the model has changed since | in a browser |
//!
//! The 3D view picks (`shell/viewport.rs`) and says here what was found.

mod events;
mod picked_point;
mod state;
pub mod words;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use events::InspectEvent;
pub use picked_point::PickedPoint;
pub use state::{Inspect, PinnedLabel};
