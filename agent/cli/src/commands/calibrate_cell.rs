//! `semascan calibrate CAPTURES`: where the camera sits on the robot and where the table's axis lies, from captures of a board.

use super::Failure;
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use semascan_calibration::{Calibration, CaptureFile, calibrate};
use semascan_formats::regular_file;
use semascan_inspection::record::pose_record;
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibratedPose, CalibrationCapture, CalibrationRecord};
use semascan_store::write_file;
use std::io::{self, Write};
use std::path::PathBuf;

/// Largest file of captures: thousands of them with their corners.
const LARGEST: u64 = 256 << 20;

/// Arguments of `semascan calibrate`.
#[derive(Debug, Args)]
#[command(after_long_help = HELP)]
pub(crate) struct CalibrateCellArgs {
    /// The captures: readings of robot and table, and the board in each picture (`--help` has a sample)
    captures: PathBuf,
    /// Write the result into this file, for `calibration=FILE` behind the `?` of a live source or a recording
    #[arg(long, value_name = "JSON")]
    out: Option<PathBuf>,
    /// Replace the file that is there
    #[arg(long, requires = "out")]
    overwrite: bool,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

const HELP: &str = r#"Take 10 to 20 captures: the board at the distance at which parts are inspected, the camera tilted by 15 degrees and more to
every side, the table at angles all around. Between at least three captures with tilts of their own the table stands still.

A sample of the captures' file; poses are in metres, pixels those of a picture without distortion, and `base_from_ee` or
`table_angle_deg` is left out where the camera or the table does not move:

{ "camera": { "width": 1280, "height": 960, "fx": 1200, "fy": 1200, "cx": 639.5, "cy": 479.5 },
  "working_distance_m": 0.5,
  "captures": [
    { "base_from_ee": { "translation": [0.4, 0.1, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
      "table_angle_deg": 0,
      "corners": [ { "board_mm": [0, 0], "pixel": [412.31, 377.05] } ] } ] }

In place of `corners` a capture may have the board's pose, "camera_from_board", as a detector gives it."#;

impl CalibrateCellArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let name = self.captures.display();
        if let Some(out) = self.out.as_ref().filter(|_| !self.overwrite)
            && out.try_exists().with_context(|| out.display().to_string())?
        {
            return Err(Failure::Call(anyhow!("{} is there already: --overwrite replaces it", out.display())));
        }
        let content = regular_file::read_at_most(&self.captures, LARGEST).with_context(|| name.to_string())?;
        let file = CaptureFile::parse(&content).map_err(|error| Failure::Call(anyhow!("{name}: {error}")))?;
        let (captures, said) = file.captures().map_err(|error| Failure::Call(anyhow!("{name}: {error}")))?;
        let mut people = Stderr::default();
        for text in said {
            writeln!(people, "{name}: {text}").context("stderr")?;
        }
        let calibration =
            calibrate(&captures, file.working_distance()).map_err(|error| Failure::Work(anyhow!("{name}: {error}")))?;
        print(&mut people, &calibration).context("stderr")?;
        let record = record(&calibration);
        if let Some(out) = &self.out {
            write_file(out, |file| Ok(serde_json::to_writer_pretty(file, &record).map_err(io::Error::from)?))?;
            writeln!(people, "{}: written", out.display()).context("stderr")?;
        }
        if self.json {
            print_json(&record)?;
        }
        Ok(())
    }
}

/// The result for people.
fn print(people: &mut impl Write, calibration: &Calibration) -> io::Result<()> {
    let uncertain =
        |(rotation, place): (f64, f64)| format!("{:.4} deg, {:.4} mm (k = 2)", rotation.to_degrees(), place * 1e3);
    let pose = |pose: &nalgebra::Isometry3<f64>| {
        let (t, (roll, pitch, yaw)) = (pose.translation.vector * 1e3, pose.rotation.euler_angles());
        let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
        format!("[{:.3}, {:.3}, {:.3}] mm, rpy [{roll:.4}, {pitch:.4}, {yaw:.4}] deg", t.x, t.y, t.z)
    };
    if let Some(hand_eye) = &calibration.hand_eye {
        writeln!(people, "camera on the end effector: {}", pose(&hand_eye.ee_from_camera))?;
        writeln!(people, "  within {}", uncertain(hand_eye.expanded_uncertainty()))?;
    }
    if let Some(table) = &calibration.turntable {
        let frame = if calibration.hand_eye.is_some() { "the robot's base" } else { "the camera" };
        writeln!(people, "table in {frame}: {}", pose(&table.base_from_tablebase))?;
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
    for (number, capture) in calibration.captures.iter().enumerate() {
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

fn record(calibration: &Calibration) -> CalibrationRecord {
    let calibrated = |pose: &nalgebra::Isometry3<f64>, (rotation, place): (f64, f64)| CalibratedPose {
        pose: pose_record(pose),
        rotation_uncertainty_deg: rotation.to_degrees(),
        place_uncertainty_mm: place * 1e3,
    };
    CalibrationRecord {
        schema: CALIBRATION_SCHEMA,
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
