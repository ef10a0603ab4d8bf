//! The live link: a worker owns the socket and decodes, the page follows its [`LinkEvent`]s.
//!
//! | module | what |
//! |---|---|
//! | `event` | what happens on the link |
//! | `api_error` | why the agent's REST interface did not answer |
//! | [`session`] | messages to events; what to ask for after a lost connection |
//! | [`halving`] | which points are held where there is no memory for all |
//! | [`reconnect`] | when to try again |
//! | [`refusal`] | why a connection is not made, and what helps |
//! | [`transfer`] | events as bytes between worker and page |
//! | [`player`] | an inspection from a file in the place of an agent |
//! | `worker` | the worker's side: socket and timers (browser only) |
//! | `player_worker` | the worker's side of a file (browser only) |
//! | `api` | the agent's REST interface (browser only) |
//! | `client` | the page's side: `Link` (browser only) |
//!
//! The worker is a second instance of the same wasm module in a plain module worker (`www/link_worker.js`): no shared memory,
//! no special headers, and decoding never holds up a frame. The module therefore must not start the page by itself
//! (`#[wasm_bindgen(start)]` would run in the worker too): the page calls its entry point, the worker calls
//! `link_worker_start`.

mod api_error;
mod event;
pub mod halving;
pub mod player;
pub mod reconnect;
pub mod refusal;
pub mod session;
pub mod transfer;

#[cfg(target_arch = "wasm32")]
pub mod api;
#[cfg(target_arch = "wasm32")]
mod client;
#[cfg(target_arch = "wasm32")]
mod player_worker;
#[cfg(target_arch = "wasm32")]
mod worker;

pub use api_error::{ApiError, may_pass};
#[cfg(target_arch = "wasm32")]
pub use client::Link;
pub use event::{DecodedChunk, LinkEvent};
#[cfg(target_arch = "wasm32")]
pub use player_worker::player_worker_start;
#[cfg(target_arch = "wasm32")]
pub use worker::link_worker_start;
