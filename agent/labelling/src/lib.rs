//! Label once in 3D, train from every view: what people corrected on the model becomes a mask in each view that saw it.
//!
//! | file | what |
//! |---|---|
//! | `captured_view.rs` | a view that labels are projected into |
//! | `corrected.rs` | the labels of the model with the log of reviews applied, and who says so |
//! | `projection.rs` | these labels in a view, tested against the view's own depth |
//! | `rim.rs` | edges of masks refined by the picture, or left open |
//! | `volume.rs` | where the part can be: what lies beside it is background |
//! | `empty.rs` | space that views saw to be empty: what lies behind it is background |
//! | `extent.rs` | how far the part reaches: what lies within, but not on the model, is open |
//! | `queue.rs` | where a label would teach most |
//!
//! A pixel of which nothing is known is [`IGNORE`], never background.

mod captured_view;
mod corrected;
mod empty;
mod extent;
#[cfg(test)]
mod fixtures;
mod projection;
mod queue;
mod rim;
mod volume;

pub use captured_view::{CapturedView, PoseUncertainty};
pub use corrected::{Contradiction, Corrected, CorrectedLabels, Labeller, Stroke, WithoutEffect, corrected_labels};
pub use empty::EmptySpace;
pub use projection::{LabelledModel, PixelCounts, Projection, Selection, ViewMasks};
pub use queue::{
    Basis, NamedRegion, NothingToTeach, QueuedRegion, TeachingQueue, check_teachable, queue_convention, teaching_queue,
};
pub use rim::RimTreatment;
pub use volume::MeasuringVolume;

/// Label of a pixel of which nothing is known: it counts neither in a loss nor in a metric.
pub const IGNORE: u16 = 255;
