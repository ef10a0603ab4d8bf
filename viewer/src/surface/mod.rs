//! The surface of the model: meshed, compared with a reference, in a worker of its own so that the page stays quick.
//!
//! | module | what | runs |
//! |---|---|---|
//! | [`job`] | what the worker does, a slice at a time | anywhere |
//! | [`message`] | what page and worker tell each other | anywhere |
//! | `reference` | a file that the surface is compared with | anywhere |
//! | `worker` | the worker's entry point (browser only) | |
//! | `page` | the page's side (browser only) | |
//!
//! The page passes on the chunks that changed since the last time; the worker's mesher computes what they touch and sends
//! the whole mesh. Between two slices of work the worker listens, so that a person can change their mind.

pub mod job;
pub mod message;
pub mod reference;

#[cfg(target_arch = "wasm32")]
mod page;
#[cfg(target_arch = "wasm32")]
mod worker;

pub use job::Job;
pub use message::{Deviation, Order, Reply};

#[cfg(target_arch = "wasm32")]
pub use page::MeshWorker;
#[cfg(target_arch = "wasm32")]
pub use worker::mesh_worker_start;
