//! Corners that are found in rendered pictures against where they are.

use super::*;
use image::GrayImage;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use semascan_calibration::{Board, Corner, board_view};
use semascan_perception::view::{CameraModel, Distortion, Intrinsics};

fn camera() -> CameraModel {
    let pinhole = Intrinsics { width: 640, height: 480, fx: 620.0, fy: 618.0, cx: 325.0, cy: 236.0 };
    let lens = Distortion::named("plumb_bob", &[-0.11, 0.06, 0.0008, -0.0006, 0.0]).expect("a lens");
    CameraModel::new(pinhole, lens).expect("a camera")
}

fn board(json: &str) -> Board {
    serde_json::from_str(json).expect("a board")
}

/// The board before the camera, `tilt` radians off frontal towards `azimuth`, rolled by half of that.
fn pose(board: &Board, tilt: f64, azimuth: f64) -> Isometry3<f64> {
    let [w, h] = board.extent_mm().map(|mm| mm * 5e-4);
    let axis = nalgebra::Unit::new_normalize(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0));
    let rotation = UnitQuaternion::from_axis_angle(&axis, tilt)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * azimuth);
    let middle = Point3::new(w, h, 0.0);
    Isometry3::from_parts(Translation3::from(Vector3::new(0.005, -0.004, 0.30) - rotation * middle.coords), rotation)
}

fn picture(renderer: &Renderer, board: &Board, pose: &Isometry3<f64>, seed: u64) -> GrayImage {
    renderer.picture(board, pose, Exposure { blur: 0.7, noise: 3.0, seed }).expect("a known dictionary")
}

/// Distance of a corner from where it is, pixels.
fn error(camera: &CameraModel, corner: &Corner, pose: &Isometry3<f64>) -> f64 {
    let [x, y] = corner.board_mm.map(|mm| mm * 1e-3);
    let (u, v) = camera.pixel_of_point(&(pose * Point3::new(x, y, 0.0))).expect("before the camera");
    (corner.pixel[0] - u).hypot(corner.pixel[1] - v)
}

/// Views of a board: share of the corners that are kept, median and 95th percentile of their errors.
fn found(board: &Board, views: usize) -> (f64, f64, f64) {
    let (camera, renderer) = (camera(), Renderer::new(&camera()));
    let (mut errors, mut there) = (Vec::new(), 0);
    for view in 0..views {
        let pose = pose(board, 0.1 + 0.55 * view as f64 / views as f64, 1.1 * view as f64);
        let corners = detect(board, &picture(&renderer, board, &pose, view as u64)).expect("the board is seen");
        let kept = board_view(&corners, &camera).expect("a pose").corners;
        errors.extend(kept.iter().map(|corner| error(&camera, corner, &pose)));
        there += board.corners_mm().len();
    }
    errors.sort_by(f64::total_cmp);
    let share = errors.len() as f64 / there as f64;
    let at = |share: f64| errors[(share * (errors.len() - 1) as f64) as usize];
    eprintln!("{share:.3} of the corners, median {:.4}, p95 {:.4}, largest {:.4} pixels", at(0.5), at(0.95), at(1.0));
    assert!(at(1.0) < 1.0, "no corner has the name of another one");
    (share, at(0.5), at(0.95))
}

#[test]
fn corners_of_charuco_boards_are_found() {
    // Bits of markers are five pixels wide at least.
    for (columns, rows, square, marker, dictionary) in
        [(9, 7, 20, 15, "DICT_4X4_50"), (7, 5, 28, 22, "DICT_APRILTAG_36h11")]
    {
        let board = board(&format!(
            r#"{{"type":"charuco","columns":{columns},"rows":{rows},"square_mm":{square},"marker_mm":{marker},"dictionary":"{dictionary}"}}"#
        ));
        let (share, median, p95) = found(&board, 4);
        assert!(share > 0.9 && median < 0.06 && p95 < 0.15, "{dictionary}: {share} {median} {p95}");
    }
}

#[test]
fn corners_of_chessboards_are_found() {
    let board = board(r#"{"type":"chessboard","columns":10,"rows":7,"square_mm":18}"#);
    let (share, median, p95) = found(&board, 4);
    assert!(share > 0.99 && median < 0.06 && p95 < 0.15, "{share} {median} {p95}");
}

#[test]
fn a_picture_without_the_board_has_none() {
    let charuco =
        board(r#"{"type":"charuco","columns":9,"rows":7,"square_mm":20,"marker_mm":15,"dictionary":"DICT_4X4_50"}"#);
    let chessboard = board(r#"{"type":"chessboard","columns":10,"rows":7,"square_mm":18}"#);
    let of_charuco = picture(&Renderer::new(&camera()), &charuco, &pose(&charuco, 0.2, 0.3), 1);
    assert!(matches!(detect(&chessboard, &of_charuco), Err(DetectError::Unseen(_))));
    let grey = GrayImage::from_pixel(640, 480, image::Luma([120]));
    for any in [&charuco, &chessboard] {
        assert!(matches!(detect(any, &grey), Err(DetectError::Unseen(_))));
    }
    let unknown =
        board(r#"{"type":"charuco","columns":9,"rows":7,"square_mm":20,"marker_mm":15,"dictionary":"DICT_9X9"}"#);
    assert!(detect(&unknown, &grey).expect_err("unknown").to_string().contains("DICT_9X9"));
}
