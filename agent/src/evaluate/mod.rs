//! Metrics against truth, each with its convention.

mod compare;
mod model;
mod partition;
mod poses;
mod sampling;
pub mod tables;
mod truth;

pub use compare::{
    ALIGNMENTS, AlignError, AlignedEvaluation, Evaluation, Range, evaluate, evaluate_aligned, figures, ranges,
};
pub use model::{Model, Target};
pub use partition::{PartitionScore, compare_partitions};
pub use poses::{PoseError, PosePair, align_poses, aligned_pose_errors, pose_error};
pub use truth::{SurfaceError, TruthReport, judge, judge_aligned};
