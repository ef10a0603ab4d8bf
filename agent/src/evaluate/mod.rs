//! Metrics against truth, each with its convention.

mod poses;
mod truth;

pub use poses::{PoseError, pose_error};
pub use truth::{ComponentScore, SurfaceError, TruthReport, judge};
