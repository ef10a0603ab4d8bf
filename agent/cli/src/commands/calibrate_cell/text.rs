//! What was found, in words for people.

use nalgebra::Isometry3;
use semascan_calibration::{Calibration, IntrinsicsCheck, NextCapture};
use std::io::{self, Write};

/// The result for people.
///
/// * `numbers`: the captures' places in their file.
pub(super) fn print(people: &mut impl Write, calibration: &Calibration, numbers: &[usize]) -> io::Result<()> {
    if let Some(hand_eye) = &calibration.hand_eye {
        writeln!(people, "camera on the end effector: {}", pose_text(&hand_eye.ee_from_camera))?;
        writeln!(people, "  within {}", uncertain(hand_eye.expanded_uncertainty()))?;
    }
    if let Some(table) = &calibration.turntable {
        let frame = if calibration.hand_eye.is_some() { "the robot's base" } else { "the camera" };
        writeln!(people, "table in {frame}: {}", pose_text(&table.base_from_tablebase))?;
        writeln!(people, "  its axis within {}", uncertain(table.expanded_uncertainty()))?;
    }
    let (rotation, place) = calibration.sigma;
    let used = calibration.captures.iter().filter(|capture| capture.is_used).count();
    writeln!(
        people,
        "{used} captures; a board's pose has a standard deviation of {:.4} deg, {:.4} mm",
        rotation.to_degrees(),
        place * 1e3
    )?;
    writeln!(people, "capture      deg       mm   by the others' result")?;
    for (number, capture) in numbers.iter().zip(&calibration.captures) {
        let (deg, mm) = (capture.residual.0.to_degrees(), capture.residual.1 * 1e3);
        write!(people, "{number:>7}  {deg:>7.4}  {mm:>7.4}")?;
        match capture.left_out {
            Some((rotation, place)) => write!(people, "   {:>7.4}  {:>7.4}", rotation.to_degrees(), place * 1e3)?,
            None => write!(people, "   the others do not suffice")?,
        }
        writeln!(people, "{}", if capture.is_used { "" } else { "  left out" })?;
    }
    for warning in &calibration.warnings {
        writeln!(people, "warning: {warning}")?;
    }
    Ok(())
}

/// A pose for people.
fn pose_text(pose: &Isometry3<f64>) -> String {
    let (t, (roll, pitch, yaw)) = (pose.translation.vector * 1e3, pose.rotation.euler_angles());
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
    format!("[{:.3}, {:.3}, {:.3}] mm, rpy [{roll:.4}, {pitch:.4}, {yaw:.4}] deg", t.x, t.y, t.z)
}

fn uncertain((rotation, place): (f64, f64)) -> String {
    format!("{:.4} deg, {:.4} mm (k = 2)", rotation.to_degrees(), place * 1e3)
}

/// A capture that would help, and what it would bring.
pub(super) fn in_words(next: &NextCapture, calibration: &Calibration) -> String {
    let distance = next.camera_from_board.translation.vector.norm();
    let mut text = format!("the board {distance:.3} m away, the camera tilted by {:.0} deg", next.tilt.to_degrees());
    if let Some(angle) = next.table_angle.filter(|_| calibration.turntable.is_some()) {
        text += &format!(", the table at {:.0} deg", angle.to_degrees());
    }
    if let Some(base_from_ee) = next.base_from_ee.filter(|_| calibration.hand_eye.is_some()) {
        text += &format!(", the end effector at {}", pose_text(&base_from_ee));
    }
    let hand_eye = calibration.hand_eye.as_ref().map(|found| found.expanded_uncertainty());
    if let Some((now, then)) = hand_eye.zip(next.hand_eye) {
        text += &format!("; the camera within {} in place of {}", uncertain(then), uncertain(now));
    }
    let turntable = calibration.turntable.as_ref().map(|found| found.expanded_uncertainty());
    if let Some((now, then)) = turntable.zip(next.turntable) {
        text += &format!("; the axis within {} in place of {}", uncertain(then), uncertain(now));
    }
    text
}

/// What the corners say of the camera, for people.
pub(super) fn print_camera(people: &mut impl Write, check: &IntrinsicsCheck) -> io::Result<()> {
    writeln!(people, "{}", check.verdict)?;
    let covered = 100.0 * check.coverage;
    writeln!(people, "  corners are {:.3} pixels off with it and cover {covered:.0} % of the picture", check.rms)?;
    for ring in &check.by_radius {
        let (radius, corners, rms, outwards) = (ring.radius, ring.corners, ring.rms, ring.outwards);
        writeln!(
            people,
            "  to {radius:>5.0} pixels from the middle: {rms:.3} off, {outwards:+.3} outwards, {corners} corners"
        )?;
    }
    let Some(own) = &check.own else { return Ok(()) };
    writeln!(people, "  by the corners alone, which are {:.3} pixels off then:", own.rms)?;
    for number in &own.numbers {
        let (name, given, own, uncertainty) = (number.name, number.given, number.own, number.uncertainty);
        writeln!(people, "  {name:>4} {own:>12.5} +- {uncertainty:.5} (k = 2), given {given:.5}")?;
    }
    Ok(())
}
