//! The board in one picture: its corners without those that were mistaken for others, and its pose.
//!
//! Detectors take a corner for another one now and then, hundreds of pixels away. Two gates keep such out: a homography that most
//! corners agree with, to a quarter of a square; and the pose, to six standard deviations of the corners.

use crate::board_pose::{BoardPoseError, board_pose};
use crate::homography;
use nalgebra::{Isometry3, Matrix6, Point2, Point3};
use semascan_perception::view::CameraModel;
use serde::Deserialize;

/// Share of the distance to the next corner up to which a corner agrees with the homography of most.
const AGREES: f64 = 0.25;

/// A corner of a board and where it is in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Corner {
    /// On the board, millimetres.
    pub board_mm: [f64; 2],
    /// In the picture as it was taken; (0, 0) is the middle of the first pixel.
    pub pixel: [f64; 2],
}

/// A board that was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardView {
    /// The board in the camera.
    pub camera_from_board: Isometry3<f64>,
    /// Of a twist in the board's frame.
    pub covariance: Matrix6<f64>,
    /// The corners that agree.
    pub corners: Vec<Corner>,
    /// From where the pose has each of them to where it was seen, pixels of the picture as it was taken.
    pub residuals: Vec<[f64; 2]>,
    /// Standard deviation of a corner along each axis, pixels.
    pub sigma: f64,
    /// Corners that fit the board, but not its pose: badly placed, or by a lens that is not the given one.
    pub doubtful: Vec<Corner>,
    /// Corners that were taken for others.
    pub mistaken: Vec<Corner>,
    /// Error of the pose over that of its mirror image: near 1, either of them may be the right one.
    pub ambiguity: f64,
}

/// The board by its corners in a picture of `camera`.
///
/// # Errors
/// [`BoardPoseError`].
pub fn board_view(corners: &[Corner], camera: &CameraModel) -> Result<BoardView, BoardPoseError> {
    if corners.iter().flat_map(|corner| corner.board_mm.iter().chain(&corner.pixel)).any(|c| !c.is_finite()) {
        return Err(BoardPoseError::NotFinite);
    }
    // As a pinhole would have seen them. What the lens cannot have brought to its pixel is no corner.
    let k = camera.intrinsics();
    let ideal: Vec<Option<[f64; 2]>> = corners
        .iter()
        .map(|corner| {
            let ray = camera.ray_of_pixel(corner.pixel[0], corner.pixel[1])?;
            Some([k.fx * ray.x + k.cx, k.fy * ray.y + k.cy])
        })
        .collect();
    let seen: Vec<(usize, [f64; 2])> = ideal.iter().enumerate().filter_map(|(n, pixel)| Some((n, (*pixel)?))).collect();
    let on_board: Vec<Point2<f64>> = seen.iter().map(|(n, _)| Point2::from(corners[*n].board_mm)).collect();
    let in_picture: Vec<Point2<f64>> = seen.iter().map(|(_, pixel)| Point2::from(*pixel)).collect();
    let agrees = homography::agreeing(&on_board, &in_picture, AGREES * next_corner(&in_picture));
    let seen: Vec<(usize, [f64; 2])> =
        seen.iter().zip(&agrees).filter(|(_, agrees)| **agrees).map(|(s, _)| *s).collect();
    let agreeing: Vec<usize> = seen.iter().map(|(n, _)| *n).collect();

    let metres: Vec<[f64; 2]> = seen.iter().map(|(n, _)| corners[*n].board_mm.map(|mm| mm * 1e-3)).collect();
    let pixels: Vec<[f64; 2]> = seen.iter().map(|(_, pixel)| *pixel).collect();
    let found = board_pose(&metres, &pixels, k)?;
    let kept: Vec<usize> = found.used.iter().map(|k| seen[*k].0).collect();
    let mut residuals = Vec::with_capacity(kept.len());
    for corner in kept.iter().map(|n| &corners[*n]) {
        let [x, y] = corner.board_mm.map(|mm| mm * 1e-3);
        let (u, v) = camera
            .pixel_of_point(&(found.camera_from_board * Point3::new(x, y, 0.0)))
            .ok_or(BoardPoseError::Degenerate)?;
        residuals.push([corner.pixel[0] - u, corner.pixel[1] - v]);
    }
    Ok(BoardView {
        camera_from_board: found.camera_from_board,
        covariance: found.covariance,
        corners: kept.iter().map(|n| corners[*n]).collect(),
        residuals,
        sigma: found.sigma,
        doubtful: agreeing.iter().filter(|n| !kept.contains(n)).map(|n| corners[*n]).collect(),
        mistaken: (0..corners.len()).filter(|n| !agreeing.contains(n)).map(|n| corners[n]).collect(),
        ambiguity: found.ambiguity,
    })
}

/// Median over all corners of the distance to the nearest other one, pixels.
fn next_corner(pixels: &[Point2<f64>]) -> f64 {
    let nearest = |n: usize| {
        let others = pixels.iter().enumerate().filter(|(other, _)| *other != n);
        others.map(|(_, other)| (other - pixels[n]).norm()).fold(f64::INFINITY, f64::min)
    };
    let mut distances: Vec<f64> = (0..pixels.len()).map(nearest).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::{CAMERA, Simulated};
    use nalgebra::Vector3;
    use semascan_perception::view::Distortion;

    #[test]
    fn corners_with_wrong_names_are_left_out_behind_a_lens_too() {
        let lens = Distortion::named("plumb_bob", &[-0.12, 0.05, 0.001, -0.0005, 0.0]).expect("a lens");
        let camera = CameraModel::new(CAMERA, lens).expect("a camera");
        let truth = Isometry3::new(Vector3::new(-0.1, -0.06, 0.4), Vector3::new(0.4, -0.3, 0.1));
        let mut corners: Vec<Corner> = Simulated::corners()
            .iter()
            .map(|[x, y]| {
                let (u, v) = camera.pixel_of_point(&(truth * Point3::new(*x, *y, 0.0))).expect("seen");
                Corner { board_mm: [x * 1e3, y * 1e3], pixel: [u, v] }
            })
            .collect();
        // A third are taken for the one beside them, as at a board whose edge is not seen.
        for corner in &mut corners[..18] {
            corner.board_mm[0] += 20.0;
        }
        let found = board_view(&corners, &camera).expect("seen");
        assert_eq!((found.mistaken.len(), found.corners.len()), (18, 36));
        assert!((found.camera_from_board.translation.vector - truth.translation.vector).norm() < 1e-6);
        assert!(found.residuals.iter().flatten().all(|r| r.abs() < 1e-3));
    }
}
