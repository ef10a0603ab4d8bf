//! A calibrated cell, as `semascan calibrate` writes it: the camera on the end effector, so that transforms need to lead to that alone
//! and what a robot's description says of the camera's mount is not used; and the axis of the turntable, so that its angle can come
//! from a joint.

use jiff::Timestamp;
use nalgebra::Isometry3;
use semascan_formats::regular_file;
use semascan_inspection::record::isometry;
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibratedPose, CalibrationRecord};
use std::path::Path;

/// Largest file that is read: those of thousands of captures are smaller.
const LARGEST: u64 = 16 << 20;

/// What is known of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellCalibration {
    /// The camera on the end effector, where that moves.
    pub(crate) ee_from_camera: Option<Isometry3<f64>>,
    /// The table at angle 0 in the robot's base, where it turns.
    pub(crate) base_from_tablebase: Option<Isometry3<f64>>,
}

impl CellCalibration {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// What is wrong with it, without its name.
    pub(crate) fn read(path: &Path) -> Result<Self, String> {
        let content = regular_file::read_at_most(path, LARGEST).map_err(|error| error.to_string())?;
        let record: CalibrationRecord =
            serde_json::from_slice(&content).map_err(|error| format!("is no calibration: {error}"))?;
        if record.schema != CALIBRATION_SCHEMA {
            return Err(format!("is a calibration of version {}, and {CALIBRATION_SCHEMA} is read", record.schema));
        }
        for reminder in record.reminders(Timestamp::now(), None) {
            tracing::warn!("{}: {reminder}", path.display());
        }
        Ok(Self {
            ee_from_camera: pose(record.ee_from_camera.as_ref(), "ee_from_camera")?,
            base_from_tablebase: pose(record.base_from_tablebase.as_ref(), "base_from_tablebase")?,
        })
    }
}

fn pose(calibrated: Option<&CalibratedPose>, name: &str) -> Result<Option<Isometry3<f64>>, String> {
    let Some(CalibratedPose { pose, .. }) = calibrated else { return Ok(None) };
    let q = pose.rotation;
    let length = [q.w, q.x, q.y, q.z].iter().map(|c| c * c).sum::<f64>().sqrt();
    let is_pose = (length - 1.0).abs() < 1e-6 && pose.translation.iter().all(|c| c.is_finite());
    if is_pose { Ok(Some(isometry(pose))) } else { Err(format!("{name} is no pose")) }
}
