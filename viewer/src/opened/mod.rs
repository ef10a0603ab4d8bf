//! Models from files: what a person drops onto the page, or its address names, is looked at without an agent.
//!
//! | module | what |
//! |---|---|
//! | `file` | [`OpenedFile`]: a file with those that it names, before its pictures are decoded |
//! | `model` | [`OpenedModel`]: points, surface and classes of a file |
//! | `picture` | what pictures on its surface show at its vertices |
//! | `spacing` | how far apart its points lie |
//! | `events` | the same as events of the link, which model and state follow |
//!
//! Own PLY files keep everything that is known of a point. Of other formats the objects, groups or nodes are the components.

mod events;
mod file;
mod model;
mod picture;
mod spacing;

pub use file::{Beside, OpenedFile};
pub use model::{OpenError, OpenedModel};
pub use picture::Picture;
