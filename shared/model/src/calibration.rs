//! `calibration.json`: where the camera sits on the robot's end effector and where the turntable's axis lies, with uncertainties.

use crate::record::PoseRecord;
use jiff::{SignedDuration, Timestamp};
use serde::{Deserialize, Serialize};

/// Version of the file that is written, and the only one so far.
pub const CALIBRATION_SCHEMA: u32 = 1;

/// A calibrated cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// [`CALIBRATION_SCHEMA`].
    pub schema: u32,
    /// When it was made; absent in files of before this was noted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made: Option<Timestamp>,
    /// Days after which people are reminded to calibrate anew; absent where nobody said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_days: Option<u32>,
    /// Temperature of the cell then, degrees Celsius; absent where it was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Kelvins by which the temperature may differ from that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_range_k: Option<f64>,
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

impl CalibrationRecord {
    /// What people should hear who use it `now`, in a cell of this temperature (degrees Celsius) where it is known.
    pub fn reminders(&self, now: Timestamp, temperature: Option<f64>) -> Vec<String> {
        let mut reminders = Vec::new();
        if let (Some(made), Some(days)) = (self.made, self.valid_days) {
            let age = now.duration_since(made);
            if age > SignedDuration::from_hours(24 * i64::from(days)) {
                let age = age.as_hours() / 24;
                reminders.push(format!("the calibration is {age} days old and was to be made anew after {days}"));
            } else if age < SignedDuration::from_hours(-24) {
                reminders.push(format!("the calibration was made on {made}, which is to come: is the clock right?"));
            }
        }
        if let (Some(then), Some(range), Some(now)) = (self.temperature_c, self.temperature_range_k, temperature)
            && (now - then).abs() > range
        {
            reminders.push(format!(
                "the cell was calibrated at {then:.1} degrees Celsius and has {now:.1}: more than {range:.1} K apart"
            ));
        }
        reminders
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_reminded_of_age_and_temperature() {
        let made: Timestamp = "2026-01-01T00:00:00Z".parse().expect("a time");
        let record = CalibrationRecord {
            schema: CALIBRATION_SCHEMA,
            made: Some(made),
            valid_days: Some(90),
            temperature_c: Some(21.0),
            temperature_range_k: Some(3.0),
            ee_from_camera: None,
            base_from_tablebase: None,
            captures: Vec::new(),
            warnings: Vec::new(),
        };
        let after = |days: i64| made + SignedDuration::from_hours(24 * days);
        assert_eq!(record.reminders(after(89), Some(23.9)), Vec::<String>::new());
        assert_eq!(record.reminders(after(89), None), Vec::<String>::new());
        assert!(record.reminders(after(100), None)[0].contains("100 days old"));
        assert!(record.reminders(after(-2), None)[0].contains("clock"));
        assert!(record.reminders(after(1), Some(17.0))[0].contains("21.0 degrees Celsius and has 17.0"));
        // A file of before this was noted says nothing of either.
        let old: CalibrationRecord =
            serde_json::from_str(r#"{"schema":1,"captures":[],"warnings":[]}"#).expect("a record");
        assert_eq!(old.reminders(after(1000), Some(50.0)), Vec::<String>::new());
    }
}
