//! The mesh worker: makes the mesh of the model and compares it with a reference, beside the page so that that stays
//! quick.
//!
//! | module | what | runs |
//! |---|---|---|
//! | [`job`] | what the worker does, a slice at a time | anywhere |
//! | [`message`] | the messages between page and worker | anywhere |
//! | [`placement`] | whether a reference lies where the model lies and is as large |
//! | [`mod@reference`] | a file that the mesh is compared with | anywhere |
//! | `decoded` | pictures of files, decoded (browser only) | |
//! | `worker` | the worker's entry point (browser only) | |
//! | `client` | the page's side (browser only) | |
//!
//! The page passes on the chunks that changed since the last time; the worker's mesher computes what they touch and sends
//! the whole mesh. Between two slices of work the worker takes requests, so that a person can change their mind.

pub mod job;
pub mod message;
pub mod placement;
pub mod reference;

#[cfg(target_arch = "wasm32")]
mod client;
#[cfg(target_arch = "wasm32")]
mod decoded;
#[cfg(target_arch = "wasm32")]
mod worker;

pub use job::Job;
pub use message::{DeviationFigures, ReferenceInfo, Reply, Request};

#[cfg(target_arch = "wasm32")]
pub use client::MeshWorker;
#[cfg(target_arch = "wasm32")]
pub use worker::mesh_worker_start;
