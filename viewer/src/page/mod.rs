//! The page: state, model, camera, renderer and link, held together.
//!
//! | module | what |
//! |---|---|
//! | [`exports`] | the visible part of the model as the bytes of a file |
//! | [`figures`] | from the link and the model to events of the state |
//! | [`options`] | what the page's address asks for |
//! | [`pace`] | how many points a frame may have while the camera moves |
//! | [`scene`] | from the state to what a frame shall show |
//! | [`shortcuts`] | what a key does |
//! | `start` | the entry point, which joins it all (browser only) |
//! | `stage` | model, camera and renderer; a frame when one is due (browser only) |
//! | `graphics` | getting a renderer, and another one after a loss (browser only) |
//! | `mesh_of_model` | orders to the mesh worker, and what comes back (browser only) |
//! | `ticker` | animation frames on demand (browser only) |
//! | `listeners` | keyboard, size, theme, clock (browser only) |
//! | `hooks` | what the canvas tells tests (browser only) |
//! | `download` | a file for the person (browser only) |

pub mod exports;
pub mod figures;
pub mod options;
pub mod pace;
pub mod scene;
pub mod shortcuts;

#[cfg(target_arch = "wasm32")]
mod download;
#[cfg(target_arch = "wasm32")]
mod graphics;
#[cfg(target_arch = "wasm32")]
mod hooks;
#[cfg(target_arch = "wasm32")]
mod listeners;
#[cfg(target_arch = "wasm32")]
mod mesh_of_model;
#[cfg(target_arch = "wasm32")]
mod stage;
#[cfg(target_arch = "wasm32")]
mod start;
#[cfg(target_arch = "wasm32")]
mod ticker;

#[cfg(target_arch = "wasm32")]
pub use start::{Viewer, start};
