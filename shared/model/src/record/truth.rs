//! What the record says of the model against truth. Each figure has its convention beside it.

use super::view::PoseRecord;
use serde::{Deserialize, Serialize};

/// The model against truth. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TruthRecord {
    /// How the figures are to be read.
    pub conventions: Vec<Convention>,
    /// Share of retained points that carry their true class.
    pub label_accuracy: f64,
    /// Share of points that are retained.
    pub label_completeness: f64,
    /// By component.
    pub components: Vec<ClassTruth>,
    /// By defect class (class 0 = sound surface).
    pub defects: Vec<ClassTruth>,
    /// 95th percentile of the distance from the model's points to the true mesh.
    pub hd95: Option<f64>,
    /// Mean of that distance.
    pub mean_error: Option<f64>,
    /// Error of each accepted view's pose, in order.
    pub poses: Vec<PoseErrorRecord>,
    /// The same model after one rigid alignment of its poses to the true ones, where those are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aligned: Option<AlignedTruth>,
    /// The same views fused with their true poses, where the poses are not exact: what the poses cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_true_poses: Option<TruthAtTruePoses>,
}

/// How a figure is to be read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Convention {
    /// The figure, or a word that figures are explained with.
    pub name: String,
    /// Its definition.
    pub text: String,
}

/// Error of one view's pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PoseErrorRecord {
    /// Position in the capture order.
    pub view: u32,
    /// Angle in radians.
    pub rotation: f64,
    /// Distance of the camera centres in metres.
    pub translation: f64,
}

/// A model after one rigid alignment of its poses to the true ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AlignedTruth {
    /// The alignment.
    pub truth_from_model: PoseRecord,
    /// Share of retained points that carry their true class.
    pub label_accuracy: f64,
    /// 95th percentile of the distance from the model's points to the true mesh.
    pub hd95: Option<f64>,
    /// Mean of that distance.
    pub mean_error: Option<f64>,
    /// Error of each accepted view's pose, in order.
    pub poses: Vec<PoseErrorRecord>,
    /// The same for the kinematic poses, after an alignment of their own.
    pub prior_poses: Vec<PoseErrorRecord>,
}

/// A model of the same views with their true poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TruthAtTruePoses {
    /// Share of retained points that carry their true class.
    pub label_accuracy: f64,
    /// 95th percentile of the distance from the model's points to the true mesh.
    pub hd95: Option<f64>,
    /// Mean of that distance.
    pub mean_error: Option<f64>,
}

/// Truth about one class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ClassTruth {
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
    /// Correct / (true or given).
    pub iou: f64,
}
