//! The tour: five steps through the page for who is here for the first time. Each shows one place and says what is done there.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to the tour | anywhere |
//! | `state` | the steps, and which is shown | anywhere |
//! | `overlay` | the card of a step | in a browser |
//! | `controller` | marks the place that is spoken of; remembers who has been here | in a browser |

mod events;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;

pub use events::TourEvent;
pub use state::{STEPS, Step, Tour};
