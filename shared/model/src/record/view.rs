//! What the record says of one view: its pose, how that was estimated, and how long it took.

use super::networks::ViewNetworksRecord;
use super::stage::Stage;
use serde::{Deserialize, Serialize};

/// One view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ViewRecord {
    /// Position in the capture order, from 0.
    pub index: u32,
    /// Capture time in seconds on the source's clock; absent where the source does not know it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<f64>,
    /// Whether it is part of the model.
    pub accepted: bool,
    /// Why it is not part of the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Estimated `table_from_camera`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseRecord>,
    /// `table_from_camera` from kinematics alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<PoseRecord>,
    /// Covariance of the pose over (rotation, translation), radians and metres, camera frame, row by row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 6]; 6]>,
    /// How the pose was estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub registration: Option<RegistrationRecord>,
    /// How sharp its picture is where it shows the part, 0 to 1: only to be compared with other views of the same part. Absent where
    /// there is no contrast, and in records of before it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sharpness: Option<f64>,
    /// What the networks said of it, in numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub networks: Option<ViewNetworksRecord>,
    /// Objects in it that are not what their labels say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misidentified: Vec<MisidentificationRecord>,
    /// Voxels that the view made.
    pub points_added: u64,
    /// Time of each stage.
    pub timings: Vec<StageTime>,
}

/// How a view's pose was estimated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum RegistrationRecord {
    /// From the robot's and turntable's readings alone.
    Kinematic,
    /// Aligned with the model.
    Icp {
        /// How the alignment went.
        icp: IcpRecord,
    },
    /// Alignment would have been no better than the kinematic pose, which was kept.
    KeptPrior {
        /// Why.
        reason: String,
    },
    /// Nothing was known of the first view: the frame of its camera is the table frame.
    CameraIsFrame,
    /// Nothing was known of the pose, and the view was found in the model.
    Relocalized {
        /// How it was found.
        global: GlobalRecord,
        /// How the alignment after it went.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        icp: Option<IcpRecord>,
    },
}

/// An alignment with the model by ICP. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct IcpRecord {
    /// Iterations.
    pub iterations: u32,
    /// Share of the points that lie on the model.
    pub overlap: f64,
    /// Standard deviation of the residuals.
    pub sigma: f64,
    /// Root mean truncated square distance at the kinematic pose.
    pub fit_before: f64,
    /// The same at the estimate.
    pub fit_after: f64,
    /// How well the data constrain each direction, ascending; 0 is not at all.
    pub eigenvalues: [f64; 6],
    /// Directions that the data do not constrain: twists about the object's centre, rotation times its radius first.
    pub frozen_directions: Vec<[f64; 6]>,
}

/// A registration with the model without a prior. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct GlobalRecord {
    /// Seed of everything random in it.
    pub seed: u64,
    /// Edge of the grid.
    pub voxel: f64,
    /// Share of the smaller of view and model that lies on the other.
    pub overlap: f64,
    /// The same of the next best pose.
    pub runner_up: f64,
    /// Pairs of features that agree with the motion.
    pub support: usize,
    /// Directions that the common surface hardly constrains.
    #[serde(alias = "open")]
    pub unconstrained: usize,
    /// Root mean square distance of the planes on the grid.
    pub rmse: f64,
    /// Share of what the model shows from there that the view confirms.
    pub confirmed: f64,
    /// Share of what the view can speak of that it contradicts.
    pub contradicted: f64,
}

/// An object of a view that is not what its label says (gravity-centre or overlap test of the association).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// The refinement of all poses together, after the last view. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RefinementRecord {
    /// Pairs of views that were matched.
    pub edges: usize,
    /// Iterations.
    pub rounds: u32,
    /// Root mean truncated square distance between overlapping views before.
    pub fit_before: f64,
    /// The same after.
    pub fit_after: f64,
}

/// Rigid transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PoseRecord {
    /// Unit quaternion.
    pub rotation: QuaternionRecord,
    /// Metres: x, y, z.
    pub translation: [f64; 3],
}

/// Unit quaternion; `w` is the real part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct QuaternionRecord {
    /// i.
    pub x: f64,
    /// j.
    pub y: f64,
    /// k.
    pub z: f64,
    /// Real part.
    pub w: f64,
}

/// The pose of a view, `table_from_camera`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ViewPose {
    /// Position in the capture order.
    pub view: u32,
    /// The pose.
    pub pose: PoseRecord,
    /// Its covariance over (rotation, translation), camera frame, in radians and metres.
    pub covariance: [[f64; 6]; 6],
}

/// Time of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StageTime {
    /// Stage.
    pub stage: Stage,
    /// Seconds.
    pub seconds: f64,
}
