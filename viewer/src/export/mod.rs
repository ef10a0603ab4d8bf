//! Exports: the model or its mesh as files, written in a worker of their own, so that the page goes on meanwhile and a person can
//! end them.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `format` | the files that there are | anywhere |
//! | `task` | what is to be written, as it crosses to the worker | anywhere |
//! | `write` | writes it | anywhere |
//! | `estimate` | how large the files will be | anywhere |
//! | `worker` | the worker's entry point (browser only) | |
//! | `client` | the page's side (browser only) | |

mod estimate;
mod format;
mod task;
mod write;

#[cfg(target_arch = "wasm32")]
mod client;
#[cfg(target_arch = "wasm32")]
mod worker;

pub use estimate::estimate;
pub use format::{Format, MeshFormat, PointFormat};
pub use task::Task;
pub use write::ExportFile;

#[cfg(target_arch = "wasm32")]
pub use client::{ExportWorker, Reply, Written};
#[cfg(target_arch = "wasm32")]
pub use worker::export_worker_start;
