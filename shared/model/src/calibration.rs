//! `calibration.json`: where the camera sits on the robot's end effector and where the turntable's axis lies, with uncertainties.

use crate::record::PoseRecord;
use serde::{Deserialize, Serialize};

/// Version of the file that is written, and the only one so far.
pub const CALIBRATION_SCHEMA: u32 = 1;

/// A calibrated cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// [`CALIBRATION_SCHEMA`].
    pub schema: u32,
    /// The camera on the end effector; absent where it does not move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ee_from_camera: Option<CalibratedPose>,
    /// The table's frame at angle 0, its z axis the table's: in the robot's base, or in the camera where that does not move. Absent
    /// where the table does not turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_from_tablebase: Option<CalibratedPose>,
    /// How far each capture is from the result, in the order of the captures.
    pub captures: Vec<CalibrationCapture>,
    /// What is weak about it, for people.
    pub warnings: Vec<String>,
}

/// A pose and how uncertain it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibratedPose {
    /// The pose, metres.
    pub pose: PoseRecord,
    /// Expanded uncertainty (k = 2) of its rotation (of a table: of the axis), degrees, in the direction in which it is largest.
    pub rotation_uncertainty_deg: f64,
    /// The same of its place (of a table: across the axis), millimetres.
    pub place_uncertainty_mm: f64,
}

/// One capture against the result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationCapture {
    /// Whether it was used; one that does not fit the others is not.
    pub is_used: bool,
    /// Between where the result has the board and where it was seen.
    pub residual_deg: f64,
    /// The same, millimetres.
    pub residual_mm: f64,
    /// The same with the result of the other captures; absent where these do not suffice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_deg: Option<f64>,
    /// The same, millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_mm: Option<f64>,
}
