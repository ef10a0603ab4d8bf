//! Captures that were not used, held against the calibration: where it says that the camera sees the board, and where it was seen.
//! The board stands where it stood for the calibration. Small residuals of captures that were fitted have fooled people; these cannot.

use crate::calibrate::{Calibration, size};
use crate::capture::Capture;
use semascan_perception::register::se3::log;

/// How far a verification capture may be from the prediction: what cell engineers expect of a sound cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerificationLimits {
    /// Radians.
    pub rotation: f64,
    /// Metres.
    pub place: f64,
}

impl Default for VerificationLimits {
    fn default() -> Self {
        Self { rotation: 0.1_f64.to_radians(), place: 0.3e-3 }
    }
}

/// One verification capture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verified {
    /// Between where the board is predicted and where it was seen: radians, metres.
    pub residual: (f64, f64),
    /// Whether both are within the limits.
    pub is_within: bool,
}

/// Why captures cannot verify a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerificationError {
    /// There is none.
    #[error("there is no capture to verify with")]
    Nothing,
    /// One lacks a reading that the calibration had.
    #[error("capture {capture}: it has no {what}, and the calibration was made with such")]
    Reading {
        /// Its place, from 0 on.
        capture: usize,
        /// Of what.
        what: &'static str,
    },
}

/// Holds captures against a calibration.
///
/// # Errors
/// [`VerificationError`] if the captures do not fit the calibration's kind.
pub fn verify(
    calibration: &Calibration,
    captures: &[Capture],
    limits: VerificationLimits,
) -> Result<Vec<Verified>, VerificationError> {
    if captures.is_empty() {
        return Err(VerificationError::Nothing);
    }
    let (moves, turns) = (calibration.hand_eye.is_some(), calibration.turntable.is_some());
    let mut verified = Vec::with_capacity(captures.len());
    for (number, capture) in captures.iter().enumerate() {
        if moves && capture.base_from_ee.is_none() {
            return Err(VerificationError::Reading { capture: number, what: "robot pose" });
        }
        if turns && capture.table_angle.is_none() {
            return Err(VerificationError::Reading { capture: number, what: "table angle" });
        }
        let residual = size(&log(&calibration.refined.cell.camera_from_board(capture), &capture.camera_from_board));
        let is_within = residual.0 <= limits.rotation && residual.1 <= limits.place;
        verified.push(Verified { residual, is_within });
    }
    Ok(verified)
}
