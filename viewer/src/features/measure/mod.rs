//! Measuring on the model: points, elements that are fitted to the surface where a person clicks, and the distances, angles and
//! steps between them, each with its uncertainty.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `kind` | [`Kind`]: what can be measured; [`Picking`]: how | anywhere |
//! | `taken` | [`Taken`]: what was picked for it | anywhere |
//! | `survey` | [`Survey`]: from a click on the mesh to an element or an area | anywhere |
//! | `ghost` | an element as a wireframe | anywhere |
//! | `events` | what happens to the measurements | anywhere |
//! | `state` | what is being measured, and what was | anywhere |
//! | `measurement` | [`Measurement`]: what was picked, figures, words | anywhere |
//! | `kept` | measurements that are kept with the inspection | anywhere |
//! | `csv` | the list as a table for other programs | anywhere |
//! | `panel` | what to measure, the list | in a browser |
//! | `kept_panel` | what is kept, and its signing | in a browser |
//! | `overlay` | points and figures over the 3D view | in a browser |
//! | `controller` | has a mesh made, surveys it, notices that the model has changed since, asks for what is kept | in a browser |
//!
//! Fits and figures are those of `semascan_geometry::fit`, which `semascan tables measure` compares with truth.

mod csv;
mod events;
mod ghost;
pub mod kept;
mod kind;
mod measurement;
mod state;
mod survey;
mod taken;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod kept_panel;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use csv::csv;
pub use events::MeasureEvent;
pub use kind::{KINDS, Kind, Picking};
pub use measurement::Measurement;
pub use state::Measure;
pub use survey::Survey;
pub use taken::{Line, Taken};
