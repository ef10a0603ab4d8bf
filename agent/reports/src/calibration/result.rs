//! What was found, how uncertain it is, what is weak about it, and which captures would help.

use super::CalibrationReport;
use crate::figure::plain;
use maud::{Markup, html};
use semascan_model::calibration::CalibratedPose;

pub(super) fn header(report: &CalibrationReport<'_>) -> Markup {
    let record = report.record;
    let used = record.captures.iter().filter(|capture| capture.is_used).count();
    let failed = report.verified.iter().filter(|capture| !capture.is_within).count();
    let contradicted = report.camera.as_ref().is_some_and(|camera| camera.is_contradicted);
    let (class, seal, below) = if failed > 0 {
        (
            "bad",
            "Not verified",
            format!("{failed} of {} verification captures are beyond the limits", report.verified.len()),
        )
    } else if contradicted {
        ("bad", "Camera in doubt", "the corners contradict the given camera".to_owned())
    } else if !record.warnings.is_empty() {
        ("weak", "Weak", format!("{} warnings", record.warnings.len()))
    } else if report.verified.is_empty() {
        ("open", "Not verified yet", "no capture was kept back".to_owned())
    } else {
        ("good", "Verified", format!("{} captures that were not used agree", report.verified.len()))
    };
    html! {
        header {
            div {
                p.kicker { "Calibration report" }
                h1 { (report.name) }
                p.sub {
                    @if let Some(made) = record.made { (made.strftime("%Y-%m-%d %H:%M UTC")) ", " }
                    (used) " of " (record.captures.len()) " captures"
                    @if let Some(temperature) = record.temperature_c { ", " (plain(temperature, 1)) " °C" }
                    @if let Some(days) = record.valid_days { ", to be made anew after " (days) " days" }
                }
            }
            div class=(format!("seal {class}")) { strong { (seal) } span { (below) } }
        }
    }
}

pub(super) fn result(report: &CalibrationReport<'_>) -> Markup {
    let record = report.record;
    html! {
        section #result {
            h2 { "Result" }
            table {
                thead { tr {
                    th { "What" } th.number { "x, y, z" br; "mm" } th.number { "Quaternion" br; "x, y, z, w" }
                    th.number { "Rotation within" br; "°, k = 2" } th.number { "Place within" br; "mm, k = 2" }
                } }
                tbody {
                    @if let Some(pose) = &record.ee_from_camera { (row("Camera on the end effector", pose)) }
                    @if let Some(pose) = &record.base_from_tablebase {
                        (row(if record.ee_from_camera.is_some() { "Table in the robot's base" } else { "Table in the camera" }, pose))
                    }
                }
            }
            p.note { "Of a table, the rotation is that of its axis and the place is across it. Uncertainties are those in the worst direction." }
            @if !record.warnings.is_empty() || !report.said.is_empty() {
                h3 { "What is weak" }
                ul { @for text in record.warnings.iter().chain(report.said) { li { (text) } } }
            }
            @if !report.next.is_empty() {
                h3 { "Captures that would help most" }
                ol { @for text in &report.next { li { (text) } } }
                p.note {
                    "Predicted from the covariance, each for the case that those before it were taken. Whether the robot reaches a pose "
                    "is not known here."
                }
            }
        }
    }
}

fn row(name: &str, calibrated: &CalibratedPose) -> Markup {
    let q = calibrated.pose.rotation;
    html! {
        tr {
            td { (name) }
            td.number { (calibrated.pose.translation.map(|m| plain(m * 1e3, 3)).join(", ")) }
            td.number { ([q.x, q.y, q.z, q.w].map(|c| plain(c, 5)).join(", ")) }
            td.number { (plain(calibrated.rotation_uncertainty_deg, 4)) }
            td.number { (plain(calibrated.place_uncertainty_mm, 4)) }
        }
    }
}

pub(super) fn covariance(report: &CalibrationReport<'_>) -> Markup {
    html! {
        @if report.hand_eye_covariance.is_some() || report.turntable_covariance.is_some() {
            section #covariance {
                h2 { "Covariance" }
                @if let Some(rows) = &report.hand_eye_covariance {
                    h3 { "Camera on the end effector" }
                    (matrix(&["turn x", "turn y", "turn z", "x", "y", "z"], rows))
                    p.note { "Of a small motion of the camera in its own frame." }
                }
                @if let Some(rows) = &report.turntable_covariance {
                    h3 { "Axis of the table" }
                    (matrix(&["turn x", "turn y", "x", "y"], rows))
                    p.note { "Of a small motion of the axis in the table's frame." }
                }
                p.note { "On the diagonal standard deviations in degrees and millimetres, off it correlations." }
            }
        }
    }
}

fn matrix<const N: usize>(names: &[&str; N], rows: &[[f64; N]; N]) -> Markup {
    let sigma = |k: usize| rows[k][k].max(0.0).sqrt();
    let entry = |row: usize, column: usize| {
        if row != column {
            return plain(rows[row][column] / (sigma(row) * sigma(column)), 2);
        }
        if names[row].starts_with("turn") { plain(sigma(row).to_degrees(), 4) } else { plain(sigma(row) * 1e3, 4) }
    };
    html! {
        table.matrix {
            thead { tr { th {} @for name in names { th.number { (name) } } } }
            tbody {
                @for (row, name) in names.iter().enumerate() {
                    tr { th { (name) } @for column in 0..N { td.number { (entry(row, column)) } } }
                }
            }
        }
    }
}
