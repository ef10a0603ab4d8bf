//! Semascan's viewer: watches the semantic model grow, in any browser.
//!
//! | module | what | runs |
//! |---|---|---|
//! | [`app`] | the state and its reducer | anywhere |
//! | [`model`] | the points, chunk by chunk | anywhere |
//! | [`link`] | worker, socket, decoding | in part anywhere |
//! | [`render`] | the picture | in part anywhere |
//! | [`surface`] | meshing and comparing, in a worker | in part anywhere |
//! | [`tools`] | camera and pointer | in part anywhere |
//! | `columns` | plain values off a block of bytes | anywhere |
//! | `panels` | the DOM as a function of the state | in a browser |
//! | [`page`] | all of it, held together; `start` is the module's entry point | in part anywhere |

pub mod app;
mod columns;
pub mod link;
pub mod model;
pub mod page;
#[cfg(target_arch = "wasm32")]
pub mod panels;
pub mod render;
pub mod surface;
pub mod tools;
