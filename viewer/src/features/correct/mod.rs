//! Corrections: what the networks called wrongly is painted with a brush, or taken at once (a segment, what is seen within a loop);
//! what nobody found is drawn around.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `naming` | [`Naming`]: the class that a mark gives | anywhere |
//! | `patch` | surface that is taken at once | anywhere |
//! | `mark` | [`Mark`]: a stroke or an outline on the surface, and the review that it becomes | anywhere |
//! | `events` | what happens to the tool | anywhere |
//! | `state` | the tool in hand, marks that are not sent, and what people painted before | anywhere |
//! | `teaching` | where a label would teach most, and what of that is done | anywhere |
//! | `controller` | paints the picture, asks the agent for earlier corrections | in a browser |
//! | `overlay` | the loop while it is drawn | in a browser |
//! | `teaching_list` | the list of these places | in a browser |
//! | `panel` | tool, class, width, undo, signing | in a browser |
//!
//! A mark changes nothing of the model as it was measured: it becomes a review, which stands in the log beside it, labels every
//! view in data sets, and is shown over the model wherever that is looked at.

mod events;
mod mark;
mod naming;
pub mod patch;
mod state;
mod teaching;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;
#[cfg(target_arch = "wasm32")]
mod teaching_list;

pub use events::CorrectEvent;
pub use mark::{Mark, Tool};
pub use naming::Naming;
pub use patch::{NoPatch, Patch};
pub use state::{Correct, Corrections};
pub use teaching::{Teaching, TeachingRegion};
