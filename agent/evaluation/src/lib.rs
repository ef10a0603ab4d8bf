//! Metrics against truth, each with its convention.

mod compare;
mod confusion;
mod defect_area;
mod exact;
pub mod findings;
mod inspection;
mod measured_geometry;
#[cfg(test)]
#[allow(dead_code, reason = "perception's tests use the rest")]
#[path = "../../perception/src/segment/network/fixtures/mod.rs"]
mod network_fixtures;
mod network_scores;
mod partition;
mod photometric;
mod pose_file;
mod pose_truth;
mod poses;
mod risk_coverage;
mod sampling;
mod seen_area;
pub mod tables;
mod test_views;
mod truth;

pub use compare::{
    ALIGNMENTS, AlignError, AlignedEvaluation, Evaluation, Range, evaluate, evaluate_aligned, figures, ranges,
};
pub use confusion::{Confusion, PixelScores};
pub use defect_area::{DefectArea, defect_areas};
pub use inspection::judge_inspection;
pub use measured_geometry::{MeasuredGeometry, Scale, Target};
pub use network_scores::{NetworkError, NetworkScores, Shelf, labelling, score_networks, test_source};
pub use partition::{PartitionScore, compare_partitions};
pub use photometric::{JudgedPoses, judge_poses};
pub use pose_file::{PoseFile, PoseFileError};
pub use pose_truth::{JudgedByTruth, POSE_TRUTH_CONVENTION, PoseTruth};
pub use poses::{PoseError, PosePair, align_poses, aligned_pose_errors, pose_error};
pub use risk_coverage::{RiskCoverage, RiskPoint};
pub use seen_area::{SeenFrom, SeenSample, SeenSurface};
pub use test_views::{TestDomain, TestMotor, TestViews};
pub use truth::{SurfaceError, TruthReport, judge, judge_aligned};
