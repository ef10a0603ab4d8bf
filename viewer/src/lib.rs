//! Semascan's viewer: watches the semantic model grow, in any browser.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `words` | the page's texts in the language that was chosen | anywhere |
//! | `worker_script` | starts the workers | in a browser |
//! | `columns` | plain values and clouds as blocks of bytes | anywhere |
//! | [`display`] | how the model is shown: data that all others speak of | anywhere |
//! | [`camera`] | the orbit camera, its pointer and its keys | in part anywhere |
//! | [`link`] | the live link: worker, socket, decoding | in part anywhere |
//! | [`render`] | the picture: what it shows, and how it is drawn | in part anywhere |
//! | [`opened`] | models from files, as events of the link | anywhere |
//! | [`mesh_worker`] | meshing and comparing, in a worker | in part anywhere |
//! | [`state`] | the state and its reducer | anywhere |
//! | [`export`] | model and mesh as files, written in a worker | in part anywhere |
//! | [`scene`] | the model as held; what of it and of the state is drawn | anywhere |
//! | [`features`] | the tools, a folder each, and the table of them | in part anywhere |
//! | `ui` | what panels are made with | in a browser |
//! | [`shell`] | the page that joins it all; `start` is the module's entry point | in part anywhere |
//!
//! A file imports files of rows above its own, or of its own row. Two modules are in two layers each: the states and
//! events of [`features`] lie below [`state`], which holds them; their panels and controllers lie above `ui`.

mod columns;
#[cfg(target_arch = "wasm32")]
mod device;
mod morton;

pub mod camera;
pub mod display;
pub mod export;
pub mod features;
pub mod link;
pub mod mesh_worker;
pub mod opened;
pub mod render;
pub mod scene;
pub mod shell;
pub mod state;
#[cfg(target_arch = "wasm32")]
pub mod ui;
pub mod words;
#[cfg(target_arch = "wasm32")]
mod worker_script;
