//! The timeline: the inspection as it stood after any of its views, and played from view to view. What is played is the inspection
//! as a file, which the person opened or the agent makes of what it keeps.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to the timeline | anywhere |
//! | `state` | which stops there are, which is shown | anywhere |
//! | `panel` | the slider and its buttons | in a browser |
//! | `controller` | shows the stops, plays on | in a browser |

mod events;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use events::TimelineEvent;
pub use state::Timeline;
