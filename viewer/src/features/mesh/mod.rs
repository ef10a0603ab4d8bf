//! The model's surface as a mesh: made by the mesh worker when a person asks for it, drawn in place of the points.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `events` | what happens to the mesh | anywhere |
//! | `part_counts` | how much of it belongs to each component | anywhere |
//! | `state` | how the meshing stands | anywhere |
//! | `panel` | points or mesh, progress | in a browser |
//! | `controller` | requests to the mesh worker, and what comes back | in a browser |

mod events;
mod part_counts;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod panel;

pub use events::MeshEvent;
#[cfg(target_arch = "wasm32")]
pub(crate) use panel::show_as;
pub use part_counts::{PartCount, part_counts};
pub use state::{Mesh, Meshing};
