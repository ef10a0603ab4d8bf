//! The live link: a worker owns the socket and decodes, the page hears [`LinkEvent`]s.
//!
//! | module | what |
//! |---|---|
//! | `event` | what the page hears |
//! | [`session`] | messages to events; what to ask for after a lost connection |
//! | [`reconnect`] | when to try again |
//! | [`transfer`] | events as bytes between worker and page |
//! | `worker` | the worker's side: socket and timers (browser only) |
//! | `page` | the page's side: `Link` (browser only) |
//!
//! The worker is a second instance of the same wasm module in a plain module worker (`www/worker.js`): no shared memory,
//! no special headers, and decoding never holds up a frame. The module therefore must not start the page by itself
//! (`#[wasm_bindgen(start)]` would run in the worker too): the page calls its entry point, the worker calls
//! `worker_start`.

mod event;
pub mod reconnect;
pub mod session;
pub mod transfer;

#[cfg(target_arch = "wasm32")]
mod page;
#[cfg(target_arch = "wasm32")]
mod worker;

pub use event::{DecodedChunk, LinkEvent};
#[cfg(target_arch = "wasm32")]
pub use page::Link;
#[cfg(target_arch = "wasm32")]
pub use worker::worker_start;
