//! `semascan calibrate CAPTURES`: where the camera sits on the robot and where the table's axis lies, from captures of a board.
//!
//! | file | what |
//! |---|---|
//! | `pictures.rs` | captures, and the board in the pictures that they name |
//! | `page.rs` | the report put together |
//! | `text.rs` | what was found, in words |
//! | `cell_toml.rs` | the calibration's name in `cell.toml` |

mod cell_toml;
mod page;
mod pictures;
mod text;

use super::Failure;
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use jiff::Timestamp;
use page::Found;
use pictures::Opened;
use semascan_calibration::{
    BoardSight, BoardView, Calibration, IntrinsicsCheck, IntrinsicsVerdict, VerificationLimits, Verified, calibrate,
    check_intrinsics, next_captures, verify,
};
use semascan_inspection::record::pose_record;
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibratedPose, CalibrationCapture, CalibrationRecord};
use semascan_store::write_file;
use std::io::{self, Write};
use std::path::PathBuf;
use text::{in_words, print, print_camera};

/// Captures that are named as those that would help most.
const NEXT: usize = 3;

/// Arguments of `semascan calibrate`.
#[derive(Debug, Args)]
#[command(after_long_help = HELP)]
pub(crate) struct CalibrateCellArgs {
    /// The captures: readings of robot and table, and a picture of the board for each (`--help` has a sample)
    captures: PathBuf,
    /// Write the result into this file, for `calibration=FILE` behind the `?` of a live source or a recording
    #[arg(long, value_name = "JSON")]
    out: Option<PathBuf>,
    /// Write a report with the pictures, every capture's residuals, and what would help
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Put the name of the result into this cell.toml; all else there stays as it is
    #[arg(long, value_name = "TOML", requires = "out")]
    write: Option<PathBuf>,
    /// Captures that are not used, to hold against the result; where one is beyond the limits, no result is written
    #[arg(long, value_name = "CAPTURES")]
    verify: Option<PathBuf>,
    /// How far such a capture may be turned from where the result has it, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.1, requires = "verify", value_parser = positive)]
    limit_deg: f64,
    /// How far it may be shifted, millimetres
    #[arg(long, value_name = "MM", default_value_t = 0.3, requires = "verify", value_parser = positive)]
    limit_mm: f64,
    /// Days after which people are reminded to calibrate anew
    #[arg(long, value_name = "DAYS", default_value_t = 180)]
    valid_days: u32,
    /// Kelvins by which the cell's temperature may differ from that of the captures before people are reminded
    #[arg(long, value_name = "K", default_value_t = 5.0, value_parser = positive)]
    temperature_range: f64,
    /// Replace the files that are there
    #[arg(long)]
    overwrite: bool,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

const HELP: &str = r#"Take 10 to 20 captures: the board at the distance at which parts are inspected, the camera tilted by 15 degrees and more to
every side, the table at angles all around. Between at least three captures with tilts of their own the table stands still.

A sample of the captures' file; poses are in metres, pixels those of the picture as it was taken, pictures lie beside the file, and
`base_from_ee` or `table_angle_deg` is left out where the camera or the table does not move:

{ "camera": { "width": 1280, "height": 960, "fx": 1200, "fy": 1200, "cx": 639.5, "cy": 479.5,
              "distortion": { "model": "plumb_bob", "coefficients": [-0.1, 0.02, 0, 0, 0] } },
  "board": { "type": "charuco", "columns": 9, "rows": 7, "square_mm": 20, "marker_mm": 15, "dictionary": "DICT_4X4_50" },
  "working_distance_m": 0.5, "temperature_c": 21.5,
  "captures": [
    { "base_from_ee": { "translation": [0.4, 0.1, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
      "table_angle_deg": 0,
      "picture": "00.png" } ] }

Boards: "charuco" (also with AprilTags), as OpenCV prints it since 4.6; "chessboard" with "columns", "rows" and "square_mm", one size odd
and one even, all of it in the picture. Sizes are those in squares.

In place of `picture` a capture may have corners, "corners": [ { "board_mm": [0, 0], "pixel": [412.31, 377.05] } ], or the board's pose,
"camera_from_board", as a detector gives them."#;

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "is no positive number".to_owned())
}

impl CalibrateCellArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let name = self.captures.display().to_string();
        for path in self.out.iter().chain(&self.report).filter(|_| !self.overwrite) {
            if path.try_exists().with_context(|| path.display().to_string())? {
                return Err(Failure::Call(anyhow!("{} is there already: --overwrite replaces it", path.display())));
            }
        }
        // What cannot be written at the end is said at the beginning.
        let cell = match (&self.write, &self.out) {
            (Some(cell), Some(out)) => Some((cell, cell_toml::with_calibration(cell, out)?)),
            _ => None,
        };
        let mut people = Stderr::default();
        let opened = pictures::open(&self.captures, self.report.is_some())?;
        for text in &opened.read.said {
            writeln!(people, "{name}: {text}").context("stderr")?;
        }
        let read = &opened.read;
        let calibration = calibrate(&read.captures, opened.file.working_distance())
            .map_err(|error| Failure::Work(anyhow!("{name}: {error}")))?
            .renumbered(&read.numbers);
        print(&mut people, &calibration, &read.numbers).context("stderr")?;
        let intrinsics = intrinsics(&opened)?;
        if let Some(check) = &intrinsics {
            print_camera(&mut people, check).context("stderr")?;
        }
        let next: Vec<String> = next_captures(&calibration, &read.captures, sight(&opened)?.as_ref(), NEXT)
            .iter()
            .map(|next| in_words(next, &calibration))
            .collect();
        for (place, text) in next.iter().enumerate() {
            let before = if place == 0 { "a capture that would help most" } else { "and then" };
            writeln!(people, "{before}: {text}").context("stderr")?;
        }
        let verified = self.verified(&calibration)?;
        for (number, found) in &verified {
            let (deg, mm) = (found.residual.0.to_degrees(), found.residual.1 * 1e3);
            let verdict = if found.is_within { "within the limits" } else { "BEYOND THE LIMITS" };
            writeln!(people, "verification {number}: {deg:.4} deg, {mm:.4} mm off, {verdict}").context("stderr")?;
        }
        let mut record = self.record(&calibration, &opened);
        if let Some(IntrinsicsVerdict::Contradicted { .. }) = intrinsics.as_ref().map(|check| &check.verdict) {
            record.warnings.extend(intrinsics.iter().map(|check| check.verdict.to_string()));
        }
        if let Some(report) = &self.report {
            let found = Found {
                name: &name,
                opened: &opened,
                calibration: &calibration,
                record: &record,
                intrinsics: intrinsics.as_ref(),
                verified: &verified,
                next: &next,
            };
            write_file(report, |file| Ok(file.write_all(page::page(&found).as_bytes())?))?;
            writeln!(people, "{}: written", report.display()).context("stderr")?;
        }
        let beyond = verified.iter().filter(|(_, found)| !found.is_within).count();
        if beyond > 0 {
            let of = verified.len();
            return Err(Failure::Work(anyhow!(
                "{beyond} of {of} verification captures are beyond the limits: the result is not written"
            )));
        }
        if let Some(out) = &self.out {
            write_file(out, |file| Ok(serde_json::to_writer_pretty(file, &record).map_err(io::Error::from)?))?;
            writeln!(people, "{}: written", out.display()).context("stderr")?;
        }
        if let Some((cell, content)) = cell {
            cell_toml::put(cell, &content)?;
            writeln!(people, "{}: names the result", cell.display()).context("stderr")?;
        }
        if self.json {
            print_json(&record)?;
        }
        Ok(())
    }

    /// The verification captures by their places, held against the result.
    fn verified(&self, calibration: &Calibration) -> Result<Vec<(usize, Verified)>, Failure> {
        let Some(path) = &self.verify else { return Ok(Vec::new()) };
        let opened = pictures::open(path, false)?;
        // A capture that shows no board verifies nothing, and nobody should believe that it did.
        if !opened.read.unseen.is_empty() {
            let (name, said) = (path.display(), opened.read.said.join("; "));
            return Err(Failure::Work(anyhow!("{name}: captures {:?} verify nothing: {said}", opened.read.unseen)));
        }
        let limits = VerificationLimits { rotation: self.limit_deg.to_radians(), place: self.limit_mm * 1e-3 };
        let verified = verify(calibration, &opened.read.captures, limits)
            .map_err(|error| Failure::Call(anyhow!("{}: {error}", path.display())))?;
        Ok(opened.read.numbers.into_iter().zip(verified).collect())
    }

    fn record(&self, calibration: &Calibration, opened: &Opened) -> CalibrationRecord {
        let temperature_c = opened.file.temperature();
        CalibrationRecord {
            made: Some(Timestamp::now()),
            valid_days: Some(self.valid_days),
            temperature_c,
            temperature_range_k: temperature_c.map(|_| self.temperature_range),
            ..record(calibration)
        }
    }
}

/// Whether the corners contradict the given camera; `None` where captures came without corners.
fn intrinsics(opened: &Opened) -> Result<Option<IntrinsicsCheck>, Failure> {
    let views: Vec<&BoardView> = opened.read.views.iter().flatten().collect();
    let camera = opened.file.camera().map_err(|error| Failure::Call(error.into()))?;
    Ok(camera.filter(|_| !views.is_empty()).map(|camera| check_intrinsics(&views, &camera)))
}

/// How the board is seen: by the corners of the board, or of the capture that shows most of them.
fn sight(opened: &Opened) -> Result<Option<BoardSight>, Failure> {
    let views: Vec<&BoardView> = opened.read.views.iter().flatten().collect();
    let camera = opened.file.camera().map_err(|error| Failure::Call(error.into()))?;
    let board = opened.file.board().map_err(|error| Failure::Call(error.into()))?;
    let (Some(camera), Some(most)) = (camera, views.iter().max_by_key(|view| view.corners.len())) else {
        return Ok(None);
    };
    let corners: Vec<[f64; 2]> = match board {
        Some(board) => board.corners_mm(),
        None => most.corners.iter().map(|corner| corner.board_mm).collect(),
    };
    let mut sigmas: Vec<f64> = views.iter().map(|view| view.sigma).collect();
    sigmas.sort_by(f64::total_cmp);
    Ok(Some(BoardSight {
        corners: corners.iter().map(|corner| corner.map(|mm| mm * 1e-3)).collect(),
        intrinsics: *camera.intrinsics(),
        sigma: sigmas[sigmas.len() / 2],
    }))
}

fn record(calibration: &Calibration) -> CalibrationRecord {
    let calibrated = |pose: &nalgebra::Isometry3<f64>, (rotation, place): (f64, f64)| CalibratedPose {
        pose: pose_record(pose),
        rotation_uncertainty_deg: rotation.to_degrees(),
        place_uncertainty_mm: place * 1e3,
    };
    CalibrationRecord {
        schema: CALIBRATION_SCHEMA,
        made: None,
        valid_days: None,
        temperature_c: None,
        temperature_range_k: None,
        ee_from_camera: calibration
            .hand_eye
            .map(|hand_eye| calibrated(&hand_eye.ee_from_camera, hand_eye.expanded_uncertainty())),
        base_from_tablebase: calibration
            .turntable
            .map(|table| calibrated(&table.base_from_tablebase, table.expanded_uncertainty())),
        captures: calibration
            .captures
            .iter()
            .map(|capture| CalibrationCapture {
                is_used: capture.is_used,
                residual_deg: capture.residual.0.to_degrees(),
                residual_mm: capture.residual.1 * 1e3,
                left_out_deg: capture.left_out.map(|(rotation, _)| rotation.to_degrees()),
                left_out_mm: capture.left_out.map(|(_, place)| place * 1e3),
            })
            .collect(),
        warnings: calibration.warnings.iter().map(ToString::to_string).collect(),
    }
}
