//! The turntable before a fixed camera, on simulated recordings.

use semascan_inspection::source::Source;
use semascan_perception::register::turntable::{
    TurningView, Turntable, TurntableConfig, TurntableError, axis_of_poses, solve,
};
use semascan_simulation::{
    TurntableDisc, TurntableOptions, TurntablePart, TurntableRecording, VirtualCell, VirtualCellSpec,
};

fn recording(part: TurntablePart, disc: TurntableDisc, views: u32) -> TurntableRecording {
    let options = TurntableOptions { part, disc, views, step: None, size: (320, 240), posed: false, masks: false };
    TurntableRecording::new(6, options)
}

fn solved(recording: &TurntableRecording, config: TurntableConfig) -> Result<Turntable, TurntableError> {
    let views = (0..).map_while(|i| recording.view(i));
    solve(views.map(|v| TurningView::of(&v)).collect(), &config)
}

/// How far each view's angle is from the truth, radians; views without an angle are left out.
fn errors(recording: &TurntableRecording, found: &Turntable) -> Vec<f64> {
    let first = found.angles.iter().position(Result::is_ok).unwrap_or(0);
    let turned = |i: usize| recording.step() * (i as f64 - first as f64);
    let tau = std::f64::consts::TAU;
    let off = |a: f64| (a + 0.5 * tau).rem_euclid(tau) - 0.5 * tau;
    let placed = found.angles.iter().enumerate().filter_map(|(i, a)| Some((i, a.as_ref().ok()?.radians)));
    placed.map(|(i, angle)| off(angle - turned(i)).abs()).collect()
}

#[test]
fn the_axis_and_all_angles_of_a_printed_disc_are_found() {
    let recording = recording(TurntablePart::Carton, TurntableDisc::Printed, 6);
    let found = solved(&recording, TurntableConfig::default()).expect("found");
    let poses: Vec<_> = (0..6).map(|i| recording.table_from_camera(i)).collect();
    let truth = axis_of_poses(&poses).expect("turns about one axis");
    // Poses do not say which end of the axis is up.
    let tilt = found.axis.direction.dot(&truth.direction).abs().min(1.0).acos().to_degrees();
    assert!(tilt < 0.3, "{:?} {truth:?}", found.axis);
    let between = truth.point - found.axis.point;
    let off = (between - truth.direction.into_inner() * between.dot(&truth.direction)).norm();
    assert!(off < 4e-3, "{off} m");
    let errors = errors(&recording, &found);
    assert!(errors.len() == 6 && errors.iter().all(|e| e.to_degrees() < 2.0), "{errors:?}");
    // The turning frame: its axis is +z, and the camera is above the disc.
    let table_from_camera = found.axis.table_from_camera();
    let up = table_from_camera.rotation * found.axis.direction.into_inner();
    assert!((up - nalgebra::Vector3::z()).norm() < 1e-9 && table_from_camera.translation.z > 0.1);
    assert!((table_from_camera * found.axis.point).coords.norm() < 1e-9);
}

#[test]
fn a_known_step_leaves_only_the_sense_of_rotation() {
    let recording = recording(TurntablePart::Mug, TurntableDisc::Plain, 6);
    let config = TurntableConfig { step: Some(60_f64.to_radians()), ..TurntableConfig::default() };
    if let Ok(found) = solved(&recording, config) {
        let errors = errors(&recording, &found);
        assert!(errors.len() > 1 && errors.iter().all(|e| e.to_degrees() < 6.0), "{errors:?}");
    }
}

#[test]
fn a_camera_that_moves_is_no_turntable() {
    let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=3&views=4&size=160x120&cell=3").expect("a cell");
    let mut cell = VirtualCell::open(&spec).expect("opens");
    let views: Vec<TurningView> =
        std::iter::from_fn(|| cell.next_view()).map(|v| TurningView::of(&v.expect("a view"))).collect();
    let poses: Vec<_> = (0..4).filter_map(|i| Some(cell.view(i)?.truth?.table_from_camera)).collect();
    assert!(axis_of_poses(&poses).is_none(), "the camera goes up and down");
    let refused = solve(views, &TurntableConfig::default());
    assert!(refused.as_ref().is_err_and(|e| !e.is_fixed()), "{refused:?}");
}
