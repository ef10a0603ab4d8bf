//! `calibration.html`: one file that shows a calibration to the people who have to trust it. It needs no network, runs no script and
//! prints on A4, as the report of an inspection does.
//!
//! | file | what |
//! |---|---|
//! | `result.rs` | what was found, how uncertain it is, what is weak, what would help |
//! | `captures.rs` | each capture against the result, the pictures with their corners, captures that verify it |
//! | `camera.rs` | whether the camera's given numbers hold |

mod camera;
mod captures;
mod result;
#[cfg(test)]
mod tests;

use crate::html::{POLICY, STYLE};
use maud::{DOCTYPE, PreEscaped, html};
use semascan_model::calibration::CalibrationRecord;

/// How its drawings look.
const DRAWINGS: &str = include_str!("drawings.css");
/// How many times longer residuals are drawn than they are.
const ENLARGED: f64 = 100.0;

/// Everything that the report is made of.
#[derive(Clone, Debug)]
pub struct CalibrationReport<'a> {
    /// The file of captures.
    pub name: &'a str,
    /// Program and version.
    pub software: &'a str,
    /// What was found.
    pub record: &'a CalibrationRecord,
    /// Covariance of a twist in the camera's frame: radians, metres.
    pub hand_eye_covariance: Option<[[f64; 6]; 6]>,
    /// Covariance of the turns about x and y of the table's frame and of the shifts along them: radians, metres.
    pub turntable_covariance: Option<[[f64; 4]; 4]>,
    /// The captures, in the order of the record's.
    pub captures: Vec<ShownCapture>,
    /// What people were told of captures that were left out before.
    pub said: &'a [String],
    /// What the corners say of the camera, where there are corners.
    pub camera: Option<CameraFigures>,
    /// Captures that verify the result; empty where none were given.
    pub verified: Vec<VerifiedCapture>,
    /// Captures that would help most, each in words with what it would bring.
    pub next: Vec<String>,
}

/// A capture as it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownCapture {
    /// Its place in the file.
    pub number: usize,
    /// Its picture.
    pub picture: Option<ShownPicture>,
    /// From the camera to the board, metres.
    pub distance: f64,
    /// Between the line of sight and the board's normal, degrees.
    pub tilt_deg: f64,
}

/// A picture of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownPicture {
    /// The name of its file; empty where the capture came with corners alone.
    pub name: String,
    /// The picture as a JPEG, of any scale.
    pub jpeg: Option<Vec<u8>>,
    /// Columns and rows of the picture as it was taken.
    pub size: (u32, u32),
    /// Corners that were used, and from where the board's pose has each to where it was seen, pixels.
    pub corners: Vec<([f64; 2], [f64; 2])>,
    /// Corners that were left out.
    pub left_out: Vec<[f64; 2]>,
    /// Standard deviation of a corner along each axis, pixels.
    pub sigma: f64,
}

/// What corners say of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFigures {
    /// Whether the given numbers hold, in words.
    pub verdict: String,
    /// Whether they are contradicted.
    pub is_contradicted: bool,
    /// Root mean square distance of corners with the given camera, pixels.
    pub rms: f64,
    /// The same with the corners' own camera.
    pub own_rms: Option<f64>,
    /// Share of the picture that has corners, 0 to 1.
    pub coverage: f64,
    /// Name, given value, own value, expanded uncertainty of that.
    pub numbers: Vec<(String, f64, f64, f64)>,
    /// Outer radius, corners, root mean square distance, mean distance outwards: pixels.
    pub rings: Vec<(f64, usize, f64, f64)>,
    /// Root mean square distance by capture.
    pub by_capture: Vec<f64>,
}

/// A capture that verifies the result.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifiedCapture {
    /// Its place in its file.
    pub number: usize,
    /// From where the result has the board to where it was seen, degrees.
    pub deg: f64,
    /// The same, millimetres.
    pub mm: f64,
    /// Whether both are within the limits.
    pub is_within: bool,
}

/// The report as one HTML file.
pub fn calibration_html(report: &CalibrationReport<'_>) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(report.software);
                title { "Calibration report: " (report.name) }
                style { (PreEscaped(STYLE)) (PreEscaped(DRAWINGS)) }
            }
            body {
                (result::header(report))
                main {
                    (result::result(report))
                    (captures::residuals(report))
                    (captures::verified(report))
                    (camera::camera(report))
                    (captures::pictures(report))
                    (result::covariance(report))
                }
            }
        }
    };
    page.into_string()
}
