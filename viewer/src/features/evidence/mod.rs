//! Photographs as evidence: the cell's own pictures of a point that a person picked, the best first, with the pixel marked; and
//! the one that is looked at laid onto the mesh. The outline of the chosen finding is drawn into those that saw it.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `sight` | [`Sight`]: which photographs show a place, and how well | anywhere |
//! | `events` | what happens to the tool | anywhere |
//! | `state` | the photographs, which is shown, whether it lies on the mesh | anywhere |
//! | `controller` | finds the photographs, and gets their pixels | in a browser |
//! | `pixels` | the pixels of a picture at an address | in a browser |
//! | `overlay` | the card that shows one | in a browser |
//!
//! Photographs in full size come from the agent's API, which has them of inspections that are kept (`--data`); of others
//! there are the small pictures of the live stream.

mod events;
mod sight;
mod state;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod pixels;

#[cfg(target_arch = "wasm32")]
pub(crate) use controller::{full_size, small};
pub use events::EvidenceEvent;
#[cfg(target_arch = "wasm32")]
pub(crate) use pixels::{image_at, pixels_of};
pub use sight::{Sight, path_of, sights};
pub use state::Evidence;
