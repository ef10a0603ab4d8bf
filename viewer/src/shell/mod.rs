//! The shell: the page that holds state, model, camera, renderer, link and panels together.
//!
//! | module | what |
//! |---|---|
//! | [`options`] | what the page's address asks for |
//! | [`permalink`] | links that lead others to what one sees |
//! | [`moving_detail`] | how finely a frame is drawn while the camera moves |
//! | [`pick_queue`] | which picks are asked for, and in which order |
//! | [`action`] | what a key or a command asks for |
//! | [`shortcuts`] | what a key does |
//! | [`commands`] | what can be done, by name |
//! | `panels` | the panels that are not a tool's (browser only) |
//! | `start` | the entry point, which joins it all (browser only) |
//! | `open_file` | files that are looked at without an agent (browser only) |
//! | `pane` | this page as a pane of a page that shows several (browser only) |
//! | `play_file` | inspections in files, played in the place of an agent (browser only) |
//! | `viewport` | model, camera and renderer; a frame when one is due (browser only) |
//! | `graphics` | getting a renderer, and another one after a loss (browser only) |
//! | `painting` | labels that people painted, on chunks and mesh (browser only) |
//! | `anchors` | elements that stay at a point of the model (browser only) |
//! | `ticker` | animation frames on demand (browser only) |
//! | `listeners` | keyboard, size, theme, clock (browser only) |
//! | `canvas_data` | what the canvas says in its data attributes (browser only) |
//! | `reference` | the mesh of another inspection as a reference (browser only) |
//! | `save` | exports: files for the person (browser only) |
//! | `snapshot` | the picture with what its colours mean, as a file (browser only) |

pub mod action;
pub mod commands;
pub mod moving_detail;
pub mod options;
pub mod permalink;
pub mod pick_queue;
pub mod shortcuts;

#[cfg(target_arch = "wasm32")]
mod anchors;
#[cfg(target_arch = "wasm32")]
mod canvas_data;
#[cfg(target_arch = "wasm32")]
mod graphics;
#[cfg(target_arch = "wasm32")]
mod listeners;
#[cfg(target_arch = "wasm32")]
mod open_file;
#[cfg(target_arch = "wasm32")]
mod open_recording;
#[cfg(target_arch = "wasm32")]
mod painting;
#[cfg(target_arch = "wasm32")]
mod pane;
#[cfg(target_arch = "wasm32")]
mod panels;
#[cfg(target_arch = "wasm32")]
mod play_file;
#[cfg(target_arch = "wasm32")]
mod reference;
#[cfg(target_arch = "wasm32")]
mod save;
#[cfg(target_arch = "wasm32")]
mod snapshot;
#[cfg(target_arch = "wasm32")]
mod start;
#[cfg(target_arch = "wasm32")]
mod ticker;
#[cfg(target_arch = "wasm32")]
mod viewport;

#[cfg(target_arch = "wasm32")]
pub use start::{Viewer, start};
