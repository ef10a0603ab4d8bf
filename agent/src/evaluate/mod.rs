//! Metrics against truth, each with its convention.

mod partition;
mod poses;
mod truth;

pub use partition::{PartitionScore, compare_partitions};
pub use poses::{PoseError, PosePair, align_poses, aligned_pose_errors, pose_error};
pub use truth::{SurfaceError, TruthReport, judge, judge_aligned};
