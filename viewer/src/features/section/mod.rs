//! A look inside: a section plane and a box cut the model open; where the plane meets the surface, the outlines are drawn,
//! filled where they are closed, measured and saved as drawings.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `direction` | [`Direction`]: what the plane lies across | anywhere |
//! | `events` | what happens to plane and box | anywhere |
//! | `state` | plane, box, outlines, readings | anywhere |
//! | `shown` | [`Shown`]: the section as it is drawn and measured | anywhere |
//! | `reading` | [`Reading`]: thicknesses and distances read in it, and what the pointer is at | anywhere |
//! | `words` | what panel and screen reader say | anywhere |
//! | `panel`, `plane_panel`, `limits_panel` | the controls, the figures | in a browser |
//! | `overlay` | the figures of the readings over the 3D view | in a browser |
//! | `controller` | has a mesh made, cuts it when plane, mesh or legend change | in a browser |
//!
//! The tool knows three others: the unit is that of the measurements, the picked point that of the card, the mesh is that of the
//! surface.

mod direction;
mod events;
mod reading;
mod shown;
mod state;
pub mod words;

#[cfg(target_arch = "wasm32")]
mod controller;
#[cfg(target_arch = "wasm32")]
mod limits_panel;
#[cfg(target_arch = "wasm32")]
mod overlay;
#[cfg(target_arch = "wasm32")]
mod panel;
#[cfg(target_arch = "wasm32")]
mod plane_panel;

pub use direction::Direction;
pub use events::SectionEvent;
pub use reading::{Aim, Ray, Reading, ReadingKind};
pub use shown::{Shown, Style};
pub use state::Section;
pub use words::plane_name;
