//! Measuring on the model: points, elements that are fitted to the surface where a person clicks, and the distances, angles and
//! steps between them, each with its uncertainty.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `kind` | [`Kind`]: what can be measured | anywhere |
//! | `taken` | [`Taken`]: what was picked for it | anywhere |
//! | `survey` | [`Survey`]: from a click on the mesh to an element or an area | anywhere |
//! | `ghost` | an element as a wireframe | anywhere |
//! | `events` | what happens to the measurements | anywhere |
//! | `state` | what is being measured, and what was | anywhere |
//! | `measurement` | [`Measurement`]: what was picked, figures, words | anywhere |
//! | `csv` | the list as a table for other programs | anywhere |
//! | `panel` | what to measure, the list | in a browser |
//! | `overlay` | points and figures over the 3D view | in a browser |
//! | `controller` | has a mesh made, surveys it, notices that the model has changed since | in a browser |
//!
//! Fits and figures are those of `semascan_geometry::fit`, which `semascan tables measure` compares with truth.

mod csv;
mod events;
mod ghost;
mod kind;
mod measurement;
mod state;
mod survey;
mod taken;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use csv::csv;
pub use events::MeasureEvent;
pub use kind::Kind;
pub use measurement::{Dimension, Measurement};
pub use state::Measure;
pub use survey::Survey;
pub use taken::{Line, Taken};
