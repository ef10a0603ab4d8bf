//! Whether the poses of robot and table can tell what is sought, and what is weak about them.
//!
//! Residuals alone have fooled people: few captures, or many from nearly one direction, fit well and say little.

use crate::capture::Capture;
use crate::hand_eye::Motion;
use nalgebra::Matrix3;

/// Captures that a calibration should have.
const ENOUGH: usize = 10;
/// Turn about the second axis (root mean square over pairs of captures) below which the camera's place is open, and below which it
/// is weak, degrees.
pub(crate) const LEAST_TURN: f64 = 2.0;
const WEAK_TURN: f64 = 15.0;
/// Range of the table's angles below which its axis is open, and below which it is weak, degrees.
pub(crate) const LEAST_RANGE: f64 = 3.0;
const WEAK_RANGE: f64 = 60.0;
/// Residuals above which a cell is not as accurate as such cells are, degrees and millimetres.
const USUAL: (f64, f64) = (0.1, 0.3);

/// What is weak about a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Warning {
    /// There are few captures.
    #[error("only {used} captures: take {ENOUGH} to 20")]
    FewCaptures {
        /// Those that were used.
        used: usize,
    },
    /// Captures do not fit the others.
    #[error("captures {captures:?} do not fit the others and were left out: was the board moved, or mistaken?")]
    LeftOut {
        /// Their places, from 0 on.
        captures: Vec<usize>,
    },
    /// The camera hardly turns about a second axis.
    #[error(
        "the camera turns by {degrees:.1} degrees about a second axis: tilt it by {WEAK_TURN} degrees and more, to either side"
    )]
    LittleTurn {
        /// Root mean square over pairs of captures.
        degrees: f64,
    },
    /// The table turns through a small range.
    #[error("the table turns through {degrees:.0} degrees: a range of {WEAK_RANGE} and more tells its axis")]
    LittleRange {
        /// Between the least and the greatest angle.
        degrees: f64,
    },
    /// The residuals are larger than those of a sound cell.
    #[error("the captures differ from the result by {rotation_deg:.3} degrees and {translation_mm:.3} mm on average: a sound cell has {} and {}", USUAL.0, USUAL.1)]
    LargeResiduals {
        /// Mean over captures, degrees.
        rotation_deg: f64,
        /// Mean over captures, millimetres.
        translation_mm: f64,
    },
    /// The result hangs on one capture.
    #[error("the result hangs on capture {capture}: without it, it moves farther than its uncertainty")]
    HangsOn {
        /// Its place, from 0 on.
        capture: usize,
    },
    /// The board was never as near or as far as parts are inspected.
    #[error("parts are inspected at {working_m:.3} m, the board was seen at {nearest_m:.3} to {farthest_m:.3} m only")]
    WorkingDistance {
        /// Where parts are inspected, metres.
        working_m: f64,
        /// The board at its nearest.
        nearest_m: f64,
        /// The board at its farthest.
        farthest_m: f64,
    },
}

/// Turn about the second axis, root mean square over `motions`, degrees. Turns about one axis alone leave the camera's place along
/// that axis open.
pub(crate) fn second_turn(motions: &[Motion]) -> f64 {
    let turns = motions.iter().map(|motion| motion.ee.rotation.scaled_axis());
    let spread = turns.map(|turn| turn * turn.transpose()).sum::<Matrix3<f64>>() / motions.len().max(1) as f64;
    let mut eigenvalues: Vec<f64> = spread.symmetric_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(f64::total_cmp);
    eigenvalues.get(1).map_or(0.0, |second| second.max(0.0).sqrt().to_degrees())
}

/// Range of the table's angles, degrees.
pub(crate) fn angle_range(captures: &[Capture]) -> f64 {
    let angles = || captures.iter().map(Capture::table_angle);
    let range = angles().fold(f64::NEG_INFINITY, f64::max) - angles().fold(f64::INFINITY, f64::min);
    range.to_degrees().clamp(0.0, 360.0)
}

/// What is weak about the poses of the captures that were used.
pub(crate) fn weak_poses(
    used: &[Capture],
    motions: Option<&[Motion]>,
    turns: bool,
    working_distance: Option<f64>,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if used.len() < ENOUGH {
        warnings.push(Warning::FewCaptures { used: used.len() });
    }
    if let Some(degrees) = motions.map(second_turn).filter(|degrees| *degrees < WEAK_TURN) {
        warnings.push(Warning::LittleTurn { degrees });
    }
    if let Some(degrees) = turns.then(|| angle_range(used)).filter(|degrees| *degrees < WEAK_RANGE) {
        warnings.push(Warning::LittleRange { degrees });
    }
    let distances = || used.iter().map(|capture| capture.camera_from_board.translation.vector.norm());
    let (nearest_m, farthest_m) = (distances().fold(f64::INFINITY, f64::min), distances().fold(0.0, f64::max));
    if let Some(working_m) = working_distance.filter(|working| !(nearest_m..=farthest_m).contains(working)) {
        warnings.push(Warning::WorkingDistance { working_m, nearest_m, farthest_m });
    }
    warnings
}

/// The warning of residuals, mean degrees and millimetres, that are too large.
pub(crate) fn large_residuals(rotation_deg: f64, translation_mm: f64) -> Option<Warning> {
    let is_large = rotation_deg > USUAL.0 || translation_mm > USUAL.1;
    is_large.then_some(Warning::LargeResiduals { rotation_deg, translation_mm })
}
