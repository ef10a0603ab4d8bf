//! Metrics against truth, each with its convention.

mod poses;
mod truth;

pub use poses::{PoseError, PosePair, align_poses, aligned_pose_errors, pose_error};
pub use truth::{SurfaceError, TruthReport, judge, judge_aligned};
