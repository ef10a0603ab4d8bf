//! Distances and angles between points that a person picks, each with its uncertainty.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to the measurements | anywhere |
//! | `state` | what is being measured, and what was | anywhere |
//! | `measurement` | [`Measurement`]: points, figures, words | anywhere |
//! | `csv` | the list as a table for other programs | anywhere |
//! | `panel` | what to measure, the list | in a browser |
//! | `overlay` | points and figures over the 3D view | in a browser |
//! | `controller` | notices that the model has changed since | in a browser |

mod csv;
mod events;
mod measurement;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use csv::csv;
pub use events::MeasureEvent;
pub use measurement::{Kind, Measurement};
pub use state::Measure;
