//! The steps of a calibration in their order: what can be found, a start in closed form, maximum likelihood of all of it together,
//! then what each capture says against the result.

use crate::capture::Capture;
use crate::cell::Cell;
use crate::diversity::{LEAST_RANGE, LEAST_TURN, Warning, angle_range, large_residuals, second_turn, weak_poses};
use crate::hand_eye::{self, Motion, motions};
use crate::refine::{Refined, refine};
use crate::turntable::{self, Axis};
use nalgebra::{DMatrix, Isometry3, Matrix4, Matrix6, Point3, Vector3};
use semascan_perception::register::se3::{halves, log};

/// Fewest captures that leave a residual.
const FEWEST: usize = 3;
/// Differences of the robot's poses from which on it moved, radians and metres.
const MOVED: (f64, f64) = (1e-3, 1e-3);
/// Difference of table angles up to which the table stood still between two captures, radians.
const STILL: f64 = 1e-4;
/// Factor of an expanded uncertainty (95 %).
const EXPANDED: f64 = 2.0;

/// Why there is no calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// There are too few captures.
    #[error("{0} captures: at least {FEWEST} are needed, and 10 to 20 make a calibration")]
    TooFew(usize),
    /// A number is none.
    #[error("capture {capture}: its {what} is not finite, or not positive definite")]
    NoNumber {
        /// Its place, from 0 on.
        capture: usize,
        /// Of what.
        what: &'static str,
    },
    /// Some captures have a reading that others lack.
    #[error("some captures have {what} and others do not")]
    Mixed {
        /// The reading.
        what: &'static str,
    },
    /// Neither robot nor table moved.
    #[error("neither the robot nor the table moved between the captures: there is nothing to find")]
    NothingMoves,
    /// The table never stood still while the robot moved.
    #[error(
        "the camera's place needs captures between which the robot moved and the table stood still: there are {pairs} such pairs"
    )]
    NoStillTable {
        /// Pairs of captures with the same table angle.
        pairs: usize,
    },
    /// The robot turned about one axis only, or hardly at all.
    #[error(
        "the camera turns by {degrees:.2} degrees about a second axis: its place is open. Turn it about two axes that are not \
         parallel, by 15 degrees and more"
    )]
    OneAxis {
        /// Root mean square over pairs of captures.
        degrees: f64,
    },
    /// The table hardly turned.
    #[error("the table turns through {degrees:.2} degrees only: its axis is open")]
    SmallRange {
        /// Between the least and the greatest angle.
        degrees: f64,
    },
    /// The captures contradict each other, or leave something open.
    #[error("the captures contradict each other: no cell explains most of them")]
    Contradictory,
}

/// Where the camera sits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandEye {
    /// Camera on the end effector.
    pub ee_from_camera: Isometry3<f64>,
    /// Of a twist in the camera's frame.
    pub covariance: Matrix6<f64>,
}

impl HandEye {
    /// Expanded uncertainty (k = 2) of the rotation (radians) and of the place (metres) in the direction in which it is largest.
    pub fn expanded_uncertainty(&self) -> (f64, f64) {
        let largest = |from: usize| {
            let block = self.covariance.fixed_view::<3, 3>(from, from).into_owned();
            EXPANDED * block.symmetric_eigenvalues().max().max(0.0).sqrt()
        };
        (largest(0), largest(3))
    }
}

/// Where the axis of the table lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurntableAxis {
    /// The table's frame at angle 0: z along the axis, so that a positive angle is a right-handed turn; the origin beside the board.
    /// In the robot's base, or in the camera where that does not move.
    pub base_from_tablebase: Isometry3<f64>,
    /// Of the turn about x and y of that frame (radians) and of the shift along them (metres).
    pub covariance: Matrix4<f64>,
}

impl TurntableAxis {
    /// Expanded uncertainty (k = 2) of the direction (radians) and of the place (metres) in the direction in which it is largest.
    pub fn expanded_uncertainty(&self) -> (f64, f64) {
        let largest = |from: usize| {
            let block = self.covariance.fixed_view::<2, 2>(from, from).into_owned();
            EXPANDED * block.symmetric_eigenvalues().max().max(0.0).sqrt()
        };
        (largest(0), largest(2))
    }
}

/// How far one capture is from the result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaptureResidual {
    /// Whether it was used; one that does not fit the others is not.
    pub is_used: bool,
    /// Between where the result has the board and where it was seen: radians, metres.
    pub residual: (f64, f64),
    /// The same with the result of the other captures; `None` where these do not suffice.
    pub left_out: Option<(f64, f64)>,
}

/// A calibrated cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The camera on the end effector; `None` where it does not move.
    pub hand_eye: Option<HandEye>,
    /// The table's axis; `None` where it does not turn.
    pub turntable: Option<TurntableAxis>,
    /// The board in the base while the table stands at 0.
    pub base_from_board: Isometry3<f64>,
    /// By capture.
    pub captures: Vec<CaptureResidual>,
    /// Standard deviation of a measured board pose along each axis: radians, metres; as given, or as the residuals have it.
    pub sigma: (f64, f64),
    /// What is weak.
    pub warnings: Vec<Warning>,
    pub(crate) refined: Refined,
}

impl Calibration {
    /// The same where capture `k` is called `numbers[k]`.
    #[must_use]
    pub fn renumbered(mut self, numbers: &[usize]) -> Self {
        let number = |capture: &mut usize| *capture = numbers.get(*capture).copied().unwrap_or(*capture);
        for warning in &mut self.warnings {
            match warning {
                Warning::LeftOut { captures } => captures.iter_mut().for_each(number),
                Warning::HangsOn { capture } => number(capture),
                _ => {}
            }
        }
        self
    }
}

/// Calibrates a cell.
///
/// * `working_distance`: from camera to part, metres, if it is known.
///
/// # Errors
/// [`CalibrationError`] if the captures leave something open or contradict each other.
pub fn calibrate(captures: &[Capture], working_distance: Option<f64>) -> Result<Calibration, CalibrationError> {
    let refined = estimate(captures)?;
    let (is_moved, turns) = (refined.cell.is_moved, refined.cell.axis.is_some());
    let used: Vec<Capture> =
        captures.iter().zip(&refined.is_used).filter(|(_, used)| **used).map(|(capture, _)| *capture).collect();
    // What was left out may have been all that told.
    let used_motions = is_moved.then(|| still_motions(&used));
    if let Some(motions) = &used_motions {
        check_motions(motions)?;
    }

    let mut warnings = weak_poses(&used, used_motions.as_deref(), turns, working_distance);
    let left_out: Vec<usize> = (0..captures.len()).filter(|k| !refined.is_used[*k]).collect();
    if !left_out.is_empty() {
        warnings.push(Warning::LeftOut { captures: left_out });
    }
    let mut residuals = Vec::with_capacity(captures.len());
    for (k, capture) in captures.iter().enumerate() {
        // Where the others alone leave it open they say nothing of this one.
        let tells = !is_moved || check_motions(&still_motions(&others(captures, &refined, k))).is_ok();
        let without = refined.others[k].filter(|_| tells);
        let left_out =
            without.as_ref().map(|cell| size(&log(&cell.camera_from_board(capture), &capture.camera_from_board)));
        if refined.is_used[k] && without.is_some_and(|cell| is_elsewhere(&cell, &refined)) {
            warnings.push(Warning::HangsOn { capture: k });
        }
        residuals.push(CaptureResidual {
            is_used: refined.is_used[k],
            residual: size(&refined.residuals[k]),
            left_out,
        });
    }
    let of_used = || residuals.iter().filter(|capture| capture.is_used);
    let mean = |number: fn(&CaptureResidual) -> f64| of_used().map(number).sum::<f64>() / used.len().max(1) as f64;
    warnings.extend(large_residuals(mean(|c| c.residual.0).to_degrees(), mean(|c| c.residual.1) * 1e3));
    Ok(Calibration {
        hand_eye: is_moved.then(|| hand_eye_of(&refined)),
        turntable: axis_of(&refined),
        base_from_board: refined.cell.base_from_board,
        captures: residuals,
        sigma: refined.sigma,
        warnings,
        refined,
    })
}

/// The cell that explains the captures best.
///
/// # Errors
/// As of [`calibrate`].
pub(crate) fn estimate(captures: &[Capture]) -> Result<Refined, CalibrationError> {
    check(captures)?;
    let (is_moved, turns) = (moves(captures), angle_range(captures) > STILL.to_degrees());
    if !is_moved && !turns {
        return Err(CalibrationError::NothingMoves);
    }
    let start = start(captures, is_moved, turns)?;
    refine(&start, captures).ok_or(CalibrationError::Contradictory)
}

/// The captures that were used, but for one.
fn others(captures: &[Capture], refined: &Refined, left_out: usize) -> Vec<Capture> {
    let used = captures.iter().zip(&refined.is_used).enumerate();
    used.filter(|(k, (_, used))| *k != left_out && **used).map(|(_, (capture, _))| *capture).collect()
}

/// Whether the captures are numbers, and of one kind.
fn check(captures: &[Capture]) -> Result<(), CalibrationError> {
    if captures.len() < FEWEST {
        return Err(CalibrationError::TooFew(captures.len()));
    }
    let is_finite = |pose: &Isometry3<f64>| pose.to_homogeneous().iter().all(|c| c.is_finite());
    for (number, capture) in captures.iter().enumerate() {
        let broken = |what| Err(CalibrationError::NoNumber { capture: number, what });
        if !is_finite(&capture.camera_from_board) {
            return broken("board pose");
        }
        if capture.base_from_ee.is_some_and(|pose| !is_finite(&pose)) {
            return broken("robot pose");
        }
        if capture.table_angle.is_some_and(|angle| !angle.is_finite()) {
            return broken("table angle");
        }
        if capture.covariance.is_some_and(|c| c.iter().any(|v| !v.is_finite()) || c.cholesky().is_none()) {
            return broken("covariance");
        }
    }
    let is_mixed = |has: fn(&Capture) -> bool| captures.iter().any(has) && !captures.iter().all(has);
    if is_mixed(|capture| capture.base_from_ee.is_some()) {
        return Err(CalibrationError::Mixed { what: "a robot pose" });
    }
    if is_mixed(|capture| capture.table_angle.is_some()) {
        return Err(CalibrationError::Mixed { what: "a table angle" });
    }
    Ok(())
}

/// Whether the robot moved between captures.
fn moves(captures: &[Capture]) -> bool {
    captures.iter().any(|capture| {
        let (rotation, translation) = size(&log(&captures[0].base_from_ee(), &capture.base_from_ee()));
        rotation > MOVED.0 || translation > MOVED.1
    })
}

/// Motions between captures for which the table stood at the same angle.
fn still_motions(captures: &[Capture]) -> Vec<Motion> {
    let mut sorted: Vec<&Capture> = captures.iter().collect();
    sorted.sort_by(|a, b| a.table_angle().total_cmp(&b.table_angle()));
    sorted.chunk_by(|a, b| (a.table_angle() - b.table_angle()).abs() < STILL).flat_map(motions).collect()
}

fn check_motions(motions: &[Motion]) -> Result<(), CalibrationError> {
    if motions.len() < 2 {
        return Err(CalibrationError::NoStillTable { pairs: motions.len() });
    }
    let degrees = second_turn(motions);
    if degrees < LEAST_TURN { Err(CalibrationError::OneAxis { degrees }) } else { Ok(()) }
}

/// A cell that explains the captures nearly, in closed form.
fn start(captures: &[Capture], is_moved: bool, turns: bool) -> Result<Cell, CalibrationError> {
    let ee_from_camera = if is_moved {
        let motions = still_motions(captures);
        check_motions(&motions)?;
        hand_eye::closed_form(&motions).ok_or(CalibrationError::Contradictory)?
    } else {
        // The axis is found in the camera, the only frame that there is; or the end effector is taken for the camera.
        captures[0].base_from_ee().inverse()
    };
    let boards: Vec<(f64, Isometry3<f64>)> = captures
        .iter()
        .map(|capture| (capture.table_angle(), capture.base_from_ee() * ee_from_camera * capture.camera_from_board))
        .collect();
    let axis = if turns {
        let degrees = angle_range(captures);
        if degrees < LEAST_RANGE {
            return Err(CalibrationError::SmallRange { degrees });
        }
        let axis = turntable::closed_form(&boards).ok_or(CalibrationError::SmallRange { degrees })?;
        let sum: Vector3<f64> = boards.iter().map(|(_, board)| board.translation.vector).sum();
        Some(axis.nearest_to(&Point3::from(sum / boards.len() as f64)))
    } else {
        None
    };
    // The board is where one capture has it: the one that most of the others agree with.
    let mut best = None;
    for (angle, board) in &boards {
        let base_from_board = axis.map_or(*board, |axis| axis.turn(-angle) * board);
        let cell = Cell { ee_from_camera, axis, base_from_board, is_moved };
        let mut distances: Vec<f64> = captures
            .iter()
            .map(|capture| log(&cell.camera_from_board(capture), &capture.camera_from_board).norm())
            .collect();
        distances.sort_by(f64::total_cmp);
        let median = distances[distances.len() / 2];
        if best.is_none_or(|(least, _)| median < least) {
            best = Some((median, cell));
        }
    }
    best.map(|(_, cell)| cell).ok_or(CalibrationError::TooFew(0))
}

/// Whether a cell differs from the result by more than the result's expanded uncertainty.
fn is_elsewhere(cell: &Cell, refined: &Refined) -> bool {
    let is_farther = |moved: (f64, f64), uncertainty: (f64, f64)| moved.0 > uncertainty.0 || moved.1 > uncertainty.1;
    let camera = refined.cell.is_moved
        && is_farther(
            size(&log(&refined.cell.ee_from_camera, &cell.ee_from_camera)),
            hand_eye_of(refined).expanded_uncertainty(),
        );
    let axis = match (&cell.axis, &refined.cell.axis, axis_of(refined)) {
        (Some(here), Some(there), Some(axis)) => {
            let here = here.nearest_to(&there.point);
            let moved = (here.direction.angle(&there.direction), (here.point - there.point).norm());
            is_farther(moved, axis.expanded_uncertainty())
        }
        _ => false,
    };
    camera || axis
}

pub(crate) fn hand_eye_of(refined: &Refined) -> HandEye {
    HandEye {
        ee_from_camera: refined.cell.ee_from_camera,
        covariance: refined.covariance.fixed_view::<6, 6>(0, 0).into_owned(),
    }
}

pub(crate) fn axis_of(refined: &Refined) -> Option<TurntableAxis> {
    let axis: Axis = refined.cell.axis?;
    let at = refined.cell.camera_unknowns();
    let covariance: &DMatrix<f64> = &refined.covariance;
    Some(TurntableAxis {
        base_from_tablebase: axis.base_from_tablebase(),
        covariance: covariance.fixed_view::<4, 4>(at, at).into_owned(),
    })
}

/// Angle and length of a twist.
pub(crate) fn size(twist: &nalgebra::Vector6<f64>) -> (f64, f64) {
    let (rotation, translation) = halves(twist);
    (rotation.norm(), translation.norm())
}
