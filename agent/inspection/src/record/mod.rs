//! `inspection.json`: what was inspected, how each view went, what was found, and how true it is where truth is known.

mod conversions;
mod recorder;
mod segmentation_record;

pub use recorder::{Recorded, Recorder, ViewPoses};
pub use segmentation_record::{SegmentationRecord, ViewSegmentationRecord};

use crate::summary::ClassSummary;
use serde::{Deserialize, Serialize};

/// Grows when a field changes its meaning or goes away.
pub const SCHEMA_VERSION: u32 = 1;

/// The record of one inspection. Metres, radians, seconds, square metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InspectionRecord {
    /// See [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Unique to the run.
    pub id: String,
    /// What wrote the record.
    pub software: SoftwareRecord,
    /// The part, for people.
    pub part: String,
    /// The source's URI or path.
    pub source: String,
    /// Where the labels came from: `source`, `network` or `none`.
    pub labels: String,
    /// The networks that labelled the views; absent where the labels came from elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segmentation: Option<SegmentationRecord>,
    /// Seeds and settings of the source that make the run repeatable.
    pub settings: Vec<(String, String)>,
    /// Voxel edge; `null` if no view could be used.
    pub voxel: Option<f64>,
    /// Points of the model, flagged ones included.
    pub points: u64,
    /// P0 step 5: the table frame, at table angle 0, in the robot base; absent without a robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_from_table: Option<PoseRecord>,
    /// All poses together; absent if they were not refined.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refinement: Option<RefinementRecord>,
    /// Every view, in capture order.
    pub views: Vec<ViewRecord>,
    /// Every component class.
    pub components: Vec<ClassSummary>,
    /// Every defect class.
    pub defects: Vec<ClassSummary>,
    /// Truth, where the source knows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthRecord>,
}

/// What wrote a record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SoftwareRecord {
    /// Program.
    pub name: String,
    /// Version.
    pub version: String,
}

/// One view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewRecord {
    /// Position in the capture order.
    pub index: u32,
    /// Whether it is part of the model.
    pub accepted: bool,
    /// Why not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Estimated `table_from_camera`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseRecord>,
    /// `table_from_camera` from kinematics alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PoseRecord>,
    /// Covariance of the pose over (rotation, translation), camera frame, row by row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Vec<[f64; 6]>>,
    /// How the pose was estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub registration: Option<RegistrationRecord>,
    /// What the networks said of it, in numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segmentation: Option<ViewSegmentationRecord>,
    /// Objects in it that are not what their labels say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misidentified: Vec<MisidentificationRecord>,
    /// Voxels that the view made.
    pub points_added: u64,
    /// Time of each stage.
    pub timings: Vec<StageTime>,
}

/// How a view's pose was estimated. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegistrationRecord {
    /// `kinematic`, `icp`, or `kept prior` where alignment would have been no better; where nothing was known of the pose,
    /// `camera is frame` of the first view, whose camera the table frame is, and `relocalised` of those found in the model.
    pub method: String,
    /// Why the kinematic pose was kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// How the alignment went.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub icp: Option<IcpRecord>,
    /// How it was found in the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub global: Option<GlobalRecord>,
}

/// A registration with the model from nothing. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GlobalRecord {
    /// Of everything random in it.
    pub seed: u64,
    /// Edge of the grid.
    pub voxel: f64,
    /// Share of the smaller of view and model that lies on the other.
    pub overlap: f64,
    /// The same of the next best pose.
    pub runner_up: f64,
    /// Pairs of features that follow the motion.
    pub support: usize,
    /// Directions that the common surface hardly holds.
    pub open: usize,
    /// Root mean square distance of the planes on the grid.
    pub rmse: f64,
    /// Share of what the model shows from there that the view confirms.
    pub confirmed: f64,
    /// Share of what the view can speak of that it contradicts.
    pub contradicted: f64,
}

/// An object of a view that is not what its label says (P1 section 3.3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MisidentificationRecord {
    /// Instance in the view.
    pub instance: u16,
    /// Class the view gives it.
    pub class: u16,
    /// The model's object it was compared with.
    pub against: u16,
    /// Class of that object.
    pub model_class: u16,
    /// What the test measured: the share of close points, or the overlap.
    pub share: f64,
}

/// An alignment with the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IcpRecord {
    /// Rounds.
    pub iterations: u32,
    /// Share of the points that lie on the model.
    pub overlap: f64,
    /// Standard deviation of the residuals.
    pub sigma: f64,
    /// Root mean truncated square distance at the kinematic pose.
    pub fit_before: f64,
    /// The same at the estimate.
    pub fit_after: f64,
    /// How well the data hold each direction, ascending; 0 is not at all.
    pub eigenvalues: [f64; 6],
    /// Directions that the data do not hold: twists about the object's centre, rotation times its radius first.
    pub frozen_directions: Vec<[f64; 6]>,
}

/// All poses together, after the last view. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RefinementRecord {
    /// Pairs of views that were matched.
    pub edges: usize,
    /// Rounds.
    pub rounds: u32,
    /// Root mean truncated square distance between overlapping views before.
    pub fit_before: f64,
    /// The same after.
    pub fit_after: f64,
}

/// Rigid transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseRecord {
    /// Unit quaternion, x y z w.
    pub rotation: [f64; 4],
    /// Metres.
    pub translation: [f64; 3],
}

/// Time of one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageTime {
    /// Stage.
    pub stage: String,
    /// Seconds.
    pub seconds: f64,
}

/// The model against truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TruthRecord {
    /// How the figures are to be read.
    pub conventions: Vec<(String, String)>,
    /// Share of retained points that carry their true class.
    pub label_accuracy: f64,
    /// Share of points that are retained.
    pub label_completeness: f64,
    /// By component.
    pub components: Vec<ComponentTruth>,
    /// By defect class (class 0 = sound surface).
    pub defects: Vec<ComponentTruth>,
    /// 95th percentile of the distance from the model's points to the true mesh.
    pub hd95: Option<f64>,
    /// Mean of that distance.
    pub mean_error: Option<f64>,
    /// Error of each accepted view's pose, in order: (view, radians, metres).
    pub poses: Vec<(u32, f64, f64)>,
    /// The same model after one rigid alignment of its poses to the true ones, where those are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aligned: Option<AlignedRecord>,
    /// The same views fused with their true poses, where the poses are not exact: what the poses cost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_true_poses: Option<IdealRecord>,
}

/// A model after one rigid alignment of its poses to the true ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignedRecord {
    /// The alignment.
    pub truth_from_model: PoseRecord,
    /// Share of retained points that carry their true class.
    pub label_accuracy: f64,
    /// 95th percentile of the distance from the model's points to the true mesh.
    pub hd95: Option<f64>,
    /// Mean of that distance.
    pub mean_error: Option<f64>,
    /// Error of each accepted view's pose, in order: (view, radians, metres).
    pub poses: Vec<(u32, f64, f64)>,
    /// The same for the kinematic poses, after an alignment of their own.
    pub prior_poses: Vec<(u32, f64, f64)>,
}

/// A model of the same views with their true poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdealRecord {
    /// Share of retained points that carry their true class.
    pub label_accuracy: f64,
    /// 95th percentile of the distance from the model's points to the true mesh.
    pub hd95: Option<f64>,
    /// Mean of that distance.
    pub mean_error: Option<f64>,
}

/// Truth about one class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComponentTruth {
    /// Class.
    pub class: u16,
    /// Its name.
    pub name: String,
    /// Points whose true class this is.
    pub points: u64,
    /// Correct / retained.
    pub accuracy: f64,
    /// Retained / all.
    pub completeness: f64,
    /// Intersection over union of true and given class.
    pub iou: f64,
}
