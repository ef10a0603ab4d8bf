//! From pictures of a board to a calibrated cell, against what is true of it.

mod rendered_cell;

use rendered_cell::{RenderedCell, Taken};
use semascan_boards::detect;
use semascan_calibration::{BoardView, Capture, VerificationLimits, board_view, calibrate, check_intrinsics, verify};
use semascan_calibration::{IntrinsicsVerdict, next_captures};
use semascan_perception::view::{CameraModel, Distortion, Intrinsics};

fn cell() -> RenderedCell {
    let pinhole = Intrinsics { width: 640, height: 480, fx: 620.0, fy: 618.0, cx: 325.0, cy: 236.0 };
    let lens = Distortion::named("plumb_bob", &[-0.11, 0.06, 0.0008, -0.0006, 0.0]).expect("a lens");
    let camera = CameraModel::new(pinhole, lens).expect("a camera");
    let board = serde_json::from_str(
        r#"{"type":"charuco","columns":9,"rows":6,"square_mm":20,"marker_mm":15,"dictionary":"DICT_4X4_50"}"#,
    );
    RenderedCell::new(board.expect("a board"), camera, (0.24, 0.34), 17)
}

fn seen(cell: &RenderedCell, taken: &[Taken]) -> Vec<BoardView> {
    let of = |taken: &Taken| {
        let corners = detect(&cell.board, &taken.picture).expect("the board is seen");
        board_view(&corners, &cell.camera).expect("a pose")
    };
    taken.iter().map(of).collect()
}

#[test]
fn fourteen_pictures_calibrate_a_cell() {
    let mut cell = cell();
    let taken = cell.captures(7, 7);
    let views = seen(&cell, &taken);
    for (taken, view) in taken.iter().zip(&views) {
        let largest = view.corners.iter().map(|corner| cell.corner_error(corner, &taken.camera_from_board));
        let visible =
            cell.board.corners_mm().iter().filter(|mm| cell.corner(**mm, &taken.camera_from_board).is_some()).count();
        assert!(
            largest.fold(0.0, f64::max) < 0.5 && 10 * view.corners.len() >= 9 * visible,
            "{} of {visible}",
            view.corners.len()
        );
    }
    let captures: Vec<Capture> = taken.iter().zip(&views).map(|(taken, view)| taken.capture(view)).collect();
    let found = calibrate(&captures, Some(0.3)).expect("calibrates");
    let ((rotation, place), (turn, shift)) = (cell.camera_error(&found), cell.axis_error(&found));
    eprintln!("camera {rotation:.4} deg, {place:.4} mm; axis {turn:.4} deg, {shift:.4} mm");
    assert!(rotation < 0.03 && place < 0.1, "camera {rotation} deg, {place} mm");
    assert!(turn < 0.02 && shift < 0.1, "axis {turn} deg, {shift} mm");

    // What was not used agrees, and a board that was moved does not.
    let kept_back = cell.captures(1, 1);
    let of_kept_back = seen(&cell, &kept_back);
    let mut verifying: Vec<Capture> = kept_back.iter().zip(&of_kept_back).map(|(t, view)| t.capture(view)).collect();
    let verified = verify(&found, &verifying, VerificationLimits::default()).expect("of its kind");
    assert!(verified.iter().all(|verified| verified.is_within), "{verified:?}");
    verifying[1].camera_from_board.translation.x += 1e-3;
    let verified = verify(&found, &verifying, VerificationLimits::default()).expect("of its kind");
    assert!(!verified[1].is_within);

    // The camera's numbers hold, and another focal length does not.
    let check = check_intrinsics(&views.iter().collect::<Vec<_>>(), &cell.camera);
    assert!(!matches!(check.verdict, IntrinsicsVerdict::Contradicted { .. }), "{:?}", check.verdict);
    let pinhole = Intrinsics { fx: 632.0, fy: 630.0, ..*cell.camera.intrinsics() };
    let longer = CameraModel::new(pinhole, *cell.camera.distortion()).expect("a camera");
    let check = check_intrinsics(&views.iter().collect::<Vec<_>>(), &longer);
    assert!(matches!(check.verdict, IntrinsicsVerdict::Contradicted { .. }), "{:?}", check.verdict);

    // A capture that is said to help is predicted to narrow the result.
    let next = next_captures(&found, &captures, None, 2);
    let before = found.hand_eye.expect("it moved").expanded_uncertainty();
    let after = next[1].hand_eye.expect("it moves");
    assert!(after.0 < before.0 && after.1 < before.1, "{before:?} {after:?}");
}
