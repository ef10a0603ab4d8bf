//! Given cameras against simulated corners: those that hold, and those that do not.

use super::*;
use crate::board_view::board_view;
use crate::simulated::{CAMERA, Simulated};
use nalgebra::Point3;
use semascan_perception::view::Distortion;

fn lens(k1: f64) -> Distortion {
    Distortion::named("plumb_bob", &[k1, 0.05, 0.0005, -0.0003]).expect("a lens")
}

/// Views of a board by a camera, as another camera would have it.
fn views(truth: &CameraModel, given: &CameraModel, count: usize, tilt: f64, seed: u64) -> Vec<BoardView> {
    let mut cell = Simulated::new(seed);
    let mut views = Vec::new();
    while views.len() < count {
        let pose = cell.robot_pose(tilt);
        let camera_from_board =
            (pose * cell.ee_from_camera).inverse() * cell.base_from_tablebase * cell.tablebase_from_board;
        let corners = Simulated::corners().into_iter().filter_map(|[x, y]| {
            let (u, v) = truth.pixel_of_point(&(camera_from_board * Point3::new(x, y, 0.0)))?;
            let noise = [cell.normal(), cell.normal()].map(|n| n * cell.noise);
            Some(Corner { board_mm: [x * 1e3, y * 1e3], pixel: [u + noise[0], v + noise[1]] })
        });
        let corners: Vec<Corner> = corners.collect();
        views.push(board_view(&corners, given).expect("seen"));
    }
    views
}

fn check(truth: &CameraModel, given: &CameraModel, count: usize, tilt: f64, seed: u64) -> IntrinsicsCheck {
    let views = views(truth, given, count, tilt, seed);
    check_intrinsics(&views.iter().collect::<Vec<_>>(), given)
}

#[test]
fn a_right_camera_holds_and_the_own_one_is_within_what_it_states() {
    let truth = CameraModel::new(CAMERA, lens(-0.1)).expect("a camera");
    let (mut inside, mut numbers) = (0, 0);
    for seed in 0..25 {
        let found = check(&truth, &truth, 14, 0.6, seed);
        assert_eq!(found.verdict, IntrinsicsVerdict::Holds, "seed {seed}");
        assert!((found.rms - 0.05 * 2.0_f64.sqrt()).abs() < 0.01, "{}", found.rms);
        let own = found.own.expect("an own camera").numbers;
        inside += own.iter().filter(|n| (n.own - n.given).abs() < n.uncertainty).count();
        numbers += own.len();
    }
    let share = inside as f64 / numbers as f64;
    eprintln!("95 % intervals hold the true numbers: {share:.3}");
    assert!((0.90..=0.99).contains(&share), "{share}");
}

#[test]
fn a_wrong_camera_is_contradicted_and_left_as_it_is() {
    let truth = CameraModel::new(CAMERA, lens(-0.1)).expect("a camera");
    let longer = CameraModel::new(Intrinsics { fx: 1212.0, fy: 1212.0, ..CAMERA }, lens(-0.1)).expect("a camera");
    let without = CameraModel::new(CAMERA, Distortion::None).expect("a camera");
    let shifted = CameraModel::new(Intrinsics { cx: 655.0, ..CAMERA }, lens(-0.1)).expect("a camera");
    for (name, given) in [("1 % longer", &longer), ("no lens", &without), ("16 pixels beside", &shifted)] {
        let found = check(&truth, given, 14, 0.6, 3);
        let IntrinsicsVerdict::Contradicted { pixels, focal } = found.verdict else {
            panic!("{name}: {:?}", found.verdict)
        };
        let own = found.own.expect("an own camera");
        assert!(own.rms < 0.09, "{name}: {pixels} {focal} {}", own.rms);
        let first = own.numbers[0];
        assert!((first.own - 1200.0).abs() < 1.5 * first.uncertainty, "{name}: {first:?}");
        assert_eq!(first.given, given.intrinsics().fx);
    }
}

#[test]
fn pictures_that_cannot_tell_say_so() {
    let truth = CameraModel::new(CAMERA, lens(-0.1)).expect("a camera");
    let few = check(&truth, &truth, 3, 0.6, 1);
    assert!(matches!(few.verdict, IntrinsicsVerdict::Open { .. }) && few.own.is_none(), "{:?}", few.verdict);
    let frontal = check(&truth, &truth, 8, 0.02, 1);
    assert!(matches!(frontal.verdict, IntrinsicsVerdict::Open { .. }), "{:?}", frontal.verdict);
}
