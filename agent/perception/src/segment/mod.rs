//! Pixels -> class probabilities and uncertainty.
//!
//! A [`Segmenter`] is the seam that networks plug into; [`RecordedSegmenter`] passes on labels that came with the view
//! (recorded masks, simulated truth), [`network::NetworkSegmenter`] asks trained networks. [`preparation`] frees pictures
//! of noise and background first, [`GeometricSegmenter`] fits another's masks to the geometry, [`Degraded`] spoils
//! them as networks do.

mod class_field;
mod degrade;
pub mod geometric;
pub mod network;
pub mod preparation;
mod recorded;
mod segmentation;
mod sigma_limits;

pub use class_field::{ClassField, UNKNOWN_PART};
pub use degrade::{Degradation, Degraded};
pub use geometric::GeometricSegmenter;
pub use recorded::{RecordedSegmenter, Unlabelled};
pub use segmentation::{SegmentError, Segmentation, Segmenter};
pub use sigma_limits::{COMPONENT_SIGMA_LIMIT, DEFECT_SIGMA_LIMIT};
