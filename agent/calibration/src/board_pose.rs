//! The pose of a flat board from its corners in a picture: homography, then least
//! squares of the reprojection, without corners that were mistaken for others, and with the covariance of what was found.
//!
//! Seen from afar a board and its mirror image about the line of sight look nearly alike. Both are tried; how clearly one of them
//! fits better is said.

use crate::homography::homography;
use nalgebra::{
    Isometry3, Matrix2x3, Matrix2x6, Matrix3, Matrix6, Point2, Point3, Translation3, UnitQuaternion, Vector3, Vector6,
};
use semascan_perception::register::rigid::nearest_rotation;
use semascan_perception::register::se3::{exp, log};
use semascan_perception::view::Intrinsics;

/// Fewest corners: with less, nothing says how exact the pose is.
const FEWEST: usize = 6;
/// Standard deviations from which on a corner was mistaken, and pixels up to which it never was.
const MISTAKEN: (f64, f64) = (6.0, 0.5);
/// Least standard deviation of a corner, pixels: what detectors reach on real pictures.
const LEAST_SIGMA: f64 = 0.01;
/// Difference of two poses up to which they are the same, radians and metres.
const SAME: f64 = 1e-6;
/// Steps of the least squares.
const STEPS: usize = 20;

/// Where a board is.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardPose {
    /// The board in the camera.
    pub camera_from_board: Isometry3<f64>,
    /// Of a twist in the board's frame.
    pub covariance: Matrix6<f64>,
    /// Standard deviation of a corner along each axis, pixels.
    pub sigma: f64,
    /// The corners that were used; others are mistaken.
    pub used: Vec<usize>,
    /// Error of the pose over that of its mirror image: near 1, either of them may be the right one.
    pub ambiguity: f64,
}

/// Why there is no pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardPoseError {
    /// There is not one pixel for each corner.
    #[error("{points} corners and {pixels} pixels")]
    Unpaired {
        /// Corners of the board.
        points: usize,
        /// Places in the picture.
        pixels: usize,
    },
    /// There are too few corners that agree.
    #[error("{0} corners that agree: at least {FEWEST} are needed")]
    TooFew(usize),
    /// A coordinate is none.
    #[error("a coordinate is not finite")]
    NotFinite,
    /// The corners lie on a line, or show no board.
    #[error("the corners lie on a line, or show no board")]
    Degenerate,
}

/// The pose of a board.
///
/// * `corners`: on the board, metres; its plane is z = 0.
/// * `pixels`: where they are in the picture, by a camera without distortion; (0, 0) is the middle of the first pixel.
///
/// # Errors
/// [`BoardPoseError`].
pub fn board_pose(
    corners: &[[f64; 2]],
    pixels: &[[f64; 2]],
    intrinsics: &Intrinsics,
) -> Result<BoardPose, BoardPoseError> {
    if corners.len() != pixels.len() {
        return Err(BoardPoseError::Unpaired { points: corners.len(), pixels: pixels.len() });
    }
    if corners.iter().chain(pixels).flatten().any(|c| !c.is_finite()) {
        return Err(BoardPoseError::NotFinite);
    }
    let mut seen: Vec<Seen> = corners
        .iter()
        .zip(pixels)
        .enumerate()
        .map(|(number, (corner, pixel))| Seen {
            number,
            corner: Point3::new(corner[0], corner[1], 0.0),
            pixel: Point2::from(*pixel),
        })
        .collect();
    loop {
        if seen.len() < FEWEST {
            return Err(BoardPoseError::TooFew(seen.len()));
        }
        let start = from_homography(&seen, intrinsics).ok_or(BoardPoseError::Degenerate)?;
        let first = least_squares(start, &seen, intrinsics).ok_or(BoardPoseError::Degenerate)?;
        let second = mirrored(&first.pose, &seen).and_then(|pose| least_squares(pose, &seen, intrinsics));
        // Seen frontally there is one minimum only, which both lead to.
        let second = second.filter(|second| log(&first.pose, &second.pose).norm() > SAME);
        let (fit, ambiguity) = match second {
            Some(second) if second.cost < first.cost => (second, (second.cost / first.cost).sqrt()),
            Some(second) => (first, (first.cost / second.cost.max(f64::MIN_POSITIVE)).sqrt()),
            None => (first, 0.0),
        };
        if let Some(without) = without_mistaken(&fit, &seen, intrinsics) {
            seen = without;
            continue;
        }
        let sigma = (fit.cost / (2 * seen.len() - 6) as f64).sqrt().max(LEAST_SIGMA);
        let covariance = fit.information.try_inverse().ok_or(BoardPoseError::Degenerate)? * (sigma * sigma);
        let used = seen.iter().map(|s| s.number).collect();
        return Ok(BoardPose { camera_from_board: fit.pose, covariance, sigma, used, ambiguity });
    }
}

/// A corner and where it is seen.
#[derive(Clone, Copy)]
struct Seen {
    /// Its place among all.
    number: usize,
    corner: Point3<f64>,
    pixel: Point2<f64>,
}

/// A pose that fits.
#[derive(Clone, Copy)]
struct Fit {
    pose: Isometry3<f64>,
    /// Of a twist in the board's frame, for a standard deviation of one pixel.
    information: Matrix6<f64>,
    /// Sum of squared distances, pixels.
    cost: f64,
}

/// The pose by the homography from the board to the picture.
fn from_homography(seen: &[Seen], intrinsics: &Intrinsics) -> Option<Isometry3<f64>> {
    let on_board: Vec<Point2<f64>> = seen.iter().map(|s| s.corner.xy()).collect();
    let on_plane: Vec<Point2<f64>> = seen
        .iter()
        .map(|s| Point2::new((s.pixel.x - intrinsics.cx) / intrinsics.fx, (s.pixel.y - intrinsics.cy) / intrinsics.fy))
        .collect();
    let homography = homography(&on_board, &on_plane)?;
    let (x, y, t) = (homography.column(0), homography.column(1), homography.column(2));
    let scale = 2.0 / (x.norm() + y.norm());
    // The board is before the camera.
    let scale = if t.z < 0.0 { -scale } else { scale };
    let (x, y, t): (Vector3<f64>, Vector3<f64>, Vector3<f64>) = (x * scale, y * scale, t * scale);
    let rotation = nearest_rotation(&Matrix3::from_columns(&[x, y, x.cross(&y)]))?;
    t.iter()
        .all(|c| c.is_finite())
        .then(|| Isometry3::from_parts(Translation3::from(t), UnitQuaternion::from_rotation_matrix(&rotation)))
}

/// The pose of the board's mirror image about the line of sight to its middle.
fn mirrored(pose: &Isometry3<f64>, seen: &[Seen]) -> Option<Isometry3<f64>> {
    let middle = Point3::from(seen.iter().map(|s| s.corner.coords).sum::<Vector3<f64>>() / seen.len() as f64);
    let there = pose * middle;
    let sight = there.coords.try_normalize(1e-9)?;
    let normal = pose.rotation * Vector3::z();
    let other = 2.0 * normal.dot(&sight) * sight - normal;
    let rotation = UnitQuaternion::rotation_between(&normal, &other)? * pose.rotation;
    Some(Isometry3::from_parts(Translation3::from(there - rotation * middle), rotation))
}

/// Least squares of the reprojection from a pose.
fn least_squares(start: Isometry3<f64>, seen: &[Seen], intrinsics: &Intrinsics) -> Option<Fit> {
    let mut pose = start;
    let mut fit = None;
    for _ in 0..STEPS {
        let (mut information, mut gradient, mut cost) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        for s in seen {
            let p = pose * s.corner;
            let residual = s.pixel - projected(&p, intrinsics)?;
            let (fx, fy, z) = (intrinsics.fx, intrinsics.fy, p.z);
            let by_point = Matrix2x3::new(fx / z, 0.0, -fx * p.x / (z * z), 0.0, fy / z, -fy * p.y / (z * z));
            let rotation = pose.rotation.to_rotation_matrix();
            let mut jacobian = Matrix2x6::zeros();
            let turned = by_point * rotation.matrix() * -s.corner.coords.cross_matrix();
            jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&turned);
            jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(&(by_point * rotation.matrix()));
            information += jacobian.transpose() * jacobian;
            gradient += jacobian.transpose() * residual;
            cost += residual.norm_squared();
        }
        fit = Some(Fit { pose, information, cost });
        let step = information.cholesky()?.solve(&gradient);
        pose *= exp(&step);
        if step.norm() < 1e-12 {
            break;
        }
    }
    fit.filter(|fit| fit.cost.is_finite())
}

/// The corners without those that are mistaken; `None` if there are none such. The worst goes first: it has bent the pose of all.
fn without_mistaken(fit: &Fit, seen: &[Seen], intrinsics: &Intrinsics) -> Option<Vec<Seen>> {
    let distance = |s: &Seen| Some((s.pixel - projected(&(fit.pose * s.corner), intrinsics)?).norm());
    let distances: Vec<f64> = seen.iter().map(distance).collect::<Option<_>>()?;
    let mut sorted = distances.clone();
    sorted.sort_by(f64::total_cmp);
    // The median length of two normal deviates is 1.18 of their standard deviation.
    let sigma = sorted[sorted.len() / 2] / 1.18;
    let worst = sorted[sorted.len() - 1];
    let is_mistaken = worst > (MISTAKEN.0 * sigma).max(MISTAKEN.1);
    is_mistaken.then(|| seen.iter().zip(&distances).filter(|(_, d)| **d < worst).map(|(s, _)| *s).collect())
}

fn projected(p: &Point3<f64>, intrinsics: &Intrinsics) -> Option<Point2<f64>> {
    intrinsics.project(p).map(|(u, v)| Point2::new(u, v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::{CAMERA, Simulated};
    use nalgebra::Rotation3;

    fn pose(tilt: f64, distance: f64) -> Isometry3<f64> {
        let rotation = Rotation3::from_euler_angles(std::f64::consts::PI + tilt, 0.3 * tilt, 0.4);
        Isometry3::from_parts(Translation3::new(-0.06, 0.05, distance), UnitQuaternion::from_rotation_matrix(&rotation))
    }

    #[test]
    fn a_board_is_found_within_its_covariance() {
        let mut inside = 0;
        for seed in 0..100 {
            let mut simulated = Simulated::new(seed);
            let truth = pose(0.1 + 0.006 * seed as f64, 0.5);
            let pixels = simulated.pixels(&truth);
            let found = board_pose(&Simulated::corners(), &pixels, &CAMERA).expect("found");
            let error = log(&found.camera_from_board, &truth);
            inside += (0..6).filter(|k| error[*k].abs() < 1.96 * found.covariance[(*k, *k)].sqrt()).count();
            assert!((found.sigma - simulated.noise).abs() < 0.25 * simulated.noise, "{}", found.sigma);
            assert!(found.ambiguity < 0.8 && found.used.len() == 54, "{found:?}");
        }
        assert!((540..=594).contains(&inside), "{inside} of 600");
    }

    #[test]
    fn corners_that_are_mistaken_are_left_out() {
        let mut simulated = Simulated::new(1);
        let truth = pose(0.4, 0.5);
        let mut pixels = simulated.pixels(&truth);
        pixels[7] = [pixels[7][0] + 368.0, pixels[7][1]];
        pixels[20][1] -= 3.0;
        let found = board_pose(&Simulated::corners(), &pixels, &CAMERA).expect("found");
        assert_eq!(found.used.len(), 52);
        assert!(log(&found.camera_from_board, &truth).norm() < 2e-3);
    }

    #[test]
    fn what_shows_no_board_is_refused() {
        let corners = Simulated::corners();
        let pixels = Simulated::new(1).pixels(&pose(0.3, 0.5));
        let of = |corners: &[[f64; 2]], pixels: &[[f64; 2]]| board_pose(corners, pixels, &CAMERA).err();
        assert_eq!(of(&corners[..5], &pixels[..5]), Some(BoardPoseError::TooFew(5)));
        assert_eq!(of(&corners[..9], &pixels[..9]), Some(BoardPoseError::Degenerate), "one row of corners");
        assert_eq!(of(&corners, &pixels[1..]), Some(BoardPoseError::Unpaired { points: 54, pixels: 53 }));
        assert_eq!(of(&corners, &vec![[1.0, 1.0]; 54]), Some(BoardPoseError::Degenerate));
        assert_eq!(of(&corners, &vec![[f64::NAN, 1.0]; 54]), Some(BoardPoseError::NotFinite));
    }
}
