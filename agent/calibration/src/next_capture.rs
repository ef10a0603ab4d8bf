//! Which further capture would help most: of candidates around the board, the one after which the covariance is predicted to be
//! smallest. A capture adds information whatever will be seen in it (`J' W J`), so that can be said before it is taken.
//!
//! Uncertainties of different things are compared by what a cell needs of each: 0.03 degrees and 0.1 mm of the camera, 0.01 degrees
//! and 0.05 mm of the axis. Whether the robot reaches a pose is not known here: several are named, each for the case that those
//! before it have been taken.

use crate::calibrate::{Calibration, HandEye, TurntableAxis, axis_of, hand_eye_of};
use crate::capture::Capture;
use crate::refine::{Refined, information_of};
use nalgebra::{
    DMatrix, Isometry3, Matrix2x3, Matrix2x6, Matrix3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3,
};
use semascan_perception::view::Intrinsics;
use std::f64::consts::{PI, TAU};

/// What a cell needs, radians and metres: of the camera, and of the axis.
const NEEDED: [(f64, f64); 2] = [(0.03 * PI / 180.0, 0.1e-3), (0.01 * PI / 180.0, 0.05e-3)];
/// Candidates: tilts and rolls of the camera, degrees; directions around the board; angles of the table.
const TILTS: [f64; 4] = [0.0, 15.0, 30.0, 45.0];
const ROLLS: [f64; 3] = [-45.0, 0.0, 45.0];
const DIRECTIONS: usize = 8;
const ANGLES: usize = 12;
/// Share of the picture along its edges in which no corner should be.
const MARGIN: f64 = 0.03;

/// What is known of how a board is seen: without it, a pose is as exact as those of the other captures are on average.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardSight {
    /// Its corners, metres.
    pub corners: Vec<[f64; 2]>,
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Standard deviation of a corner along each axis, pixels.
    pub sigma: f64,
}

/// A capture that would help.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextCapture {
    /// Where the end effector would be; `None` where the camera does not move.
    pub base_from_ee: Option<Isometry3<f64>>,
    /// The angle of the table, radians; `None` where it does not turn.
    pub table_angle: Option<f64>,
    /// How the camera would see the board.
    pub camera_from_board: Isometry3<f64>,
    /// Angle between line of sight and the board's normal, radians.
    pub tilt: f64,
    /// The camera's predicted expanded uncertainty with it and those before it: radians, metres; `None` where it is not estimated, or
    /// cannot be predicted.
    pub hand_eye: Option<(f64, f64)>,
    /// The same of the axis.
    pub turntable: Option<(f64, f64)>,
}

/// The captures that would help most, the best first, each for the case that those before it have been taken.
///
/// * `captures`: those of the calibration.
pub fn next_captures(
    calibration: &Calibration,
    captures: &[Capture],
    sight: Option<&BoardSight>,
    count: usize,
) -> Vec<NextCapture> {
    let refined = &calibration.refined;
    let used: Vec<&Capture> =
        captures.iter().zip(&refined.is_used).filter(|(_, used)| **used).map(|(capture, _)| capture).collect();
    let candidates: Vec<(Capture, DMatrix<f64>)> = candidates(refined, &used, sight)
        .into_iter()
        .filter_map(|capture| {
            let covariance = match sight {
                Some(sight) => seen_covariance(&capture.camera_from_board, sight)?,
                None => mean_covariance(refined),
            };
            // As much more than by its noise as the captures so far differ.
            let weight = (covariance * refined.excess).try_inverse()?;
            Some((capture, information_of(&refined.cell, &capture, &weight)))
        })
        .collect();
    // Poses alone have their covariance from how few captures differ, which need not span all that is estimated: what each capture says
    // then tells which one would help, and not how much.
    let by_covariance = refined.covariance.clone().cholesky().map(|c| c.inverse());
    let is_predicted = by_covariance.is_some();
    let by_captures = || -> Option<DMatrix<f64>> {
        let weight = (mean_covariance(refined) * refined.excess).try_inverse()?;
        used.iter().map(|capture| information_of(&refined.cell, capture, &weight)).reduce(|sum, one| sum + one)
    };
    let Some(mut information) = by_covariance.or_else(by_captures) else { return Vec::new() };
    let mut chosen = Vec::new();
    for _ in 0..count {
        let mut best: Option<(f64, DMatrix<f64>, &Capture)> = None;
        for (capture, added) in &candidates {
            let with = &information + added;
            let Some(after) = with.clone().cholesky().map(|c| c.inverse()) else { continue };
            let need = need(&with_covariance(refined, after));
            if best.as_ref().is_none_or(|(least, ..)| need < *least) {
                best = Some((need, with, capture));
            }
        }
        let Some((_, with, capture)) = best else { break };
        let Some(after) = with.clone().cholesky().map(|c| c.inverse()) else { break };
        let predicted = with_covariance(refined, after);
        let (hand_eye, turntable) = results(&predicted);
        chosen.push(NextCapture {
            base_from_ee: capture.base_from_ee,
            table_angle: capture.table_angle,
            camera_from_board: capture.camera_from_board,
            tilt: tilt(&capture.camera_from_board, sight),
            hand_eye: hand_eye.filter(|_| is_predicted).map(|found| found.expanded_uncertainty()),
            turntable: turntable.filter(|_| is_predicted).map(|found| found.expanded_uncertainty()),
        });
        information = with;
    }
    chosen
}

fn with_covariance(refined: &Refined, covariance: DMatrix<f64>) -> Refined {
    Refined { covariance, ..refined.clone() }
}

fn results(refined: &Refined) -> (Option<HandEye>, Option<TurntableAxis>) {
    (refined.cell.is_moved.then(|| hand_eye_of(refined)), axis_of(refined))
}

/// The uncertainties, each by what is needed of it.
fn need(refined: &Refined) -> f64 {
    let (hand_eye, axis) = results(refined);
    let uncertainties =
        [hand_eye.map(|found| found.expanded_uncertainty()), axis.map(|found| found.expanded_uncertainty())];
    let needs = uncertainties.iter().zip(NEEDED);
    needs.map(|(found, needed)| found.map_or(0.0, |(w, t)| (w / needed.0).powi(2) + (t / needed.1).powi(2))).sum()
}

/// Captures that could be taken: the camera around the board, at distances from which it was seen, and the table all around.
fn candidates(refined: &Refined, used: &[&Capture], sight: Option<&BoardSight>) -> Vec<Capture> {
    let cell = &refined.cell;
    let angles: Vec<Option<f64>> = match (cell.axis, used.first().and_then(|capture| capture.table_angle)) {
        (Some(_), _) => (0..ANGLES).map(|k| Some(TAU * k as f64 / ANGLES as f64)).collect(),
        (None, angle) => vec![angle],
    };
    if !cell.is_moved {
        let base_from_ee = used.first().and_then(|capture| capture.base_from_ee);
        return angles
            .iter()
            .map(|angle| {
                let blank = blank(base_from_ee, *angle);
                Capture { camera_from_board: cell.camera_from_board(&blank), ..blank }
            })
            .filter(|capture| sight.is_none_or(|sight| is_seen(&capture.camera_from_board, sight)))
            .collect();
    }
    let middle = middle(sight);
    let eyes: Vec<Vector3<f64>> =
        used.iter().map(|capture| capture.camera_from_board.inverse() * Point3::origin() - middle).collect();
    // The side of the board that is printed, and how the camera was rolled.
    let front = Vector3::z() * eyes.iter().map(|eye| eye.z).sum::<f64>().signum();
    let right =
        used.iter().map(|capture| capture.camera_from_board.rotation.inverse() * Vector3::x()).sum::<Vector3<f64>>();
    let mut distances: Vec<f64> = eyes.iter().map(Vector3::norm).collect();
    distances.sort_by(f64::total_cmp);
    distances.dedup_by(|a, b| (*a - *b).abs() < 0.02);
    let distances = [0, distances.len() / 2, distances.len().saturating_sub(1)].map(|k| distances.get(k).copied());
    let mut distances: Vec<f64> = distances.into_iter().flatten().collect();
    distances.dedup();

    let mut candidates = Vec::new();
    for tilt in TILTS {
        for direction in 0..if tilt == 0.0 { 1 } else { DIRECTIONS } {
            for (roll, distance) in ROLLS.iter().flat_map(|roll| distances.iter().map(move |distance| (roll, distance)))
            {
                let azimuth = TAU * direction as f64 / DIRECTIONS as f64;
                let lean = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt.to_radians().sin();
                let away = lean + front * tilt.to_radians().cos();
                let Some(board_from_camera) = looking(middle + away * *distance, &middle, &right, roll.to_radians())
                else {
                    continue;
                };
                let camera_from_board = board_from_camera.inverse();
                if sight.is_some_and(|sight| !is_seen(&camera_from_board, sight)) {
                    continue;
                }
                for angle in &angles {
                    // The board as it stands then: where a camera at the end effector's origin would see it.
                    let base_from_board = cell.camera_from_board(&blank(Some(cell.ee_from_camera.inverse()), *angle));
                    let base_from_ee = base_from_board * board_from_camera * cell.ee_from_camera.inverse();
                    candidates.push(Capture { camera_from_board, ..blank(Some(base_from_ee), *angle) });
                }
            }
        }
    }
    candidates
}

fn blank(base_from_ee: Option<Isometry3<f64>>, table_angle: Option<f64>) -> Capture {
    Capture { base_from_ee, table_angle, camera_from_board: Isometry3::identity(), covariance: None }
}

/// The middle of the board, metres; of one whose corners are not known, its origin.
fn middle(sight: Option<&BoardSight>) -> Point3<f64> {
    let Some(sight) = sight else { return Point3::origin() };
    let count = sight.corners.len().max(1) as f64;
    let sum = sight.corners.iter().fold([0.0; 2], |sum, corner| [sum[0] + corner[0], sum[1] + corner[1]]);
    Point3::new(sum[0] / count, sum[1] / count, 0.0)
}

/// A camera at `eye` that looks at `to`, its x axis as near `right` as can be and then rolled.
fn looking(eye: Point3<f64>, to: &Point3<f64>, right: &Vector3<f64>, roll: f64) -> Option<Isometry3<f64>> {
    let z = (to - eye).try_normalize(1e-9)?;
    let x = (right - z * z.dot(right)).try_normalize(1e-9)?;
    let rotation = UnitQuaternion::from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z]));
    let rotation = rotation * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    Some(Isometry3::from_parts(Translation3::from(eye), rotation))
}

fn tilt(camera_from_board: &Isometry3<f64>, sight: Option<&BoardSight>) -> f64 {
    let there = camera_from_board * middle(sight);
    let cosine = there.coords.normalize().dot(&(camera_from_board.rotation * Vector3::z())).abs();
    cosine.min(1.0).acos()
}

/// Whether all of the board is in the picture.
fn is_seen(camera_from_board: &Isometry3<f64>, sight: &BoardSight) -> bool {
    let k = &sight.intrinsics;
    let is_within = |at: f64, size: u32| (MARGIN..1.0 - MARGIN).contains(&((at + 0.5) / f64::from(size)));
    sight.corners.iter().all(|[x, y]| {
        k.project(&(camera_from_board * Point3::new(*x, *y, 0.0)))
            .is_some_and(|(u, v)| is_within(u, k.width) && is_within(v, k.height))
    })
}

/// Covariance of a board's pose by its corners; `None` where they leave it open.
fn seen_covariance(camera_from_board: &Isometry3<f64>, sight: &BoardSight) -> Option<Matrix6<f64>> {
    let (k, rotation) = (&sight.intrinsics, camera_from_board.rotation.to_rotation_matrix());
    let mut information = Matrix6::zeros();
    for [x, y] in &sight.corners {
        let corner = Point3::new(*x, *y, 0.0);
        let p = camera_from_board * corner;
        if p.z <= 0.0 {
            return None;
        }
        let by_point =
            Matrix2x3::new(k.fx / p.z, 0.0, -k.fx * p.x / (p.z * p.z), 0.0, k.fy / p.z, -k.fy * p.y / (p.z * p.z))
                * rotation.matrix();
        let mut jacobian = Matrix2x6::zeros();
        jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&(by_point * -corner.coords.cross_matrix()));
        jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(&by_point);
        information += jacobian.transpose() * jacobian / (sight.sigma * sight.sigma);
    }
    Some(information.cholesky()?.inverse())
}

fn mean_covariance(refined: &Refined) -> Matrix6<f64> {
    let (rotation, place) = refined.sigma;
    Matrix6::from_diagonal(&[rotation, rotation, rotation, place, place, place].map(|s| s * s).into())
}
