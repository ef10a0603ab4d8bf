//! Findings and what people decide about them: the list, each finding in the view with its outline and its photographs, the criteria
//! behind the verdict, and decisions by one key each.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `case` | [`Case`]: the findings, the verdict and the decisions, as the agent says them | anywhere |
//! | `draft` | [`Draft`]: a decision before it is sent; [`Unsent`]: one that has not arrived yet | anywhere |
//! | `events` | what happens to the tool | anywhere |
//! | `state` | the case, the chosen finding, the draft, what is not sent yet | anywhere |
//! | `words` | findings and decisions in words | anywhere |
//! | `outbox` | keeps decisions in the browser's storage until they have arrived | in a browser |
//! | `name` | names for reviews | in a browser |
//! | `controller` | asks the agent, sends decisions until they have arrived | in a browser |
//! | `signature` | reason and name under what is signed | in a browser |
//! | `panel` | the list, the chosen finding, the form of a decision | in a browser |
//!
//! A decision is kept in the browser's storage until the agent has confirmed it, and has a name of its own: sending it again is
//! harmless. It says which version of its subject the person saw, so that two people who decide at once are told of it.

mod case;
mod draft;
mod events;
#[cfg(any(test, target_arch = "wasm32"))]
mod outbox;
mod state;
pub mod words;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod name;
#[cfg(target_arch = "wasm32")]
mod panel;
#[cfg(target_arch = "wasm32")]
mod signature;

pub use case::Case;
pub use draft::{Draft, Ruling, Unsent};
pub use events::ReviewEvent;
#[cfg(target_arch = "wasm32")]
pub use name::new_name;
#[cfg(target_arch = "wasm32")]
pub use signature::{Reason, Signature, Signed};
pub use state::{Review, Standing};
