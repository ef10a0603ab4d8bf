//! `semascan synth --turntable PART`: simulated recordings of a turntable by a fixed depth camera, each a BOP scene.
//!
//! Unless `--posed` is given the scene holds no camera poses, as such recordings do; the truth is in `truth.json` beside
//! it, which no reader of scenes knows: `table_from_camera` of each view (metres; x, y, z, w of the rotation).

use super::Failure;
use crate::stdout::print_json;
use anyhow::Context;
use clap::{Args, ValueEnum};
use nalgebra::Isometry3;
use semascan_inspection::record::pose_record;
use semascan_perception::view::View;
use semascan_simulation::{TurntableDisc, TurntableOptions, TurntablePart, TurntableRecording};
use semascan_sources::bop::{SceneEntry, SceneWriter};
use serde_json::json;
use std::ops::Range;
use std::path::Path;

/// Arguments of simulated turntable recordings.
#[derive(Debug, Args)]
pub(crate) struct TurntableArgs {
    /// Write recordings of a turntable by a fixed depth camera, with the room about it, instead of training data: one BOP
    /// scene a part, without poses, the truth beside it in truth.json
    #[arg(long, value_enum, value_name = "PART")]
    turntable: Option<PartArg>,
    /// Degrees between two views [default: a full turn over all views]
    #[arg(long, value_name = "DEG", requires = "turntable", allow_hyphen_values = true, value_parser = degrees)]
    step: Option<f64>,
    /// What the disc looks like
    #[arg(long, value_enum, default_value = "printed", requires = "turntable")]
    disc: DiscArg,
    /// Write the poses too
    #[arg(long, requires = "turntable")]
    posed: bool,
    /// Write the part's masks too
    #[arg(long, requires = "turntable")]
    masks: bool,
}

/// Reads the degrees between two views.
fn degrees(text: &str) -> Result<f64, String> {
    let degrees: f64 = text.parse().map_err(|_| format!("{text} is no number of degrees"))?;
    let turns = degrees != 0.0 && degrees.abs() <= 180.0;
    if turns { Ok(degrees) } else { Err(format!("{text}: up to 180 degrees, and not 0")) }
}

/// What stands on the disc.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PartArg {
    /// An angle with a block and a pin: of no symmetry
    Bracket,
    /// A round vessel with a handle
    Mug,
    /// A cylinder with print
    Can,
    /// A box with print
    Carton,
    /// A wheel with twelve teeth, the same after each
    Gear,
    /// A starter motor in its chuck
    Motor,
}

/// What the disc looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DiscArg {
    /// Something irregular is printed on it
    Printed,
    /// The same from every side
    Plain,
}

impl TurntableArgs {
    /// What is recorded in `views` views of `size`; `None` if no turntable is asked for.
    pub(crate) fn options(&self, views: u32, size: (u32, u32)) -> Option<TurntableOptions> {
        let part = match self.turntable? {
            PartArg::Bracket => TurntablePart::Bracket,
            PartArg::Mug => TurntablePart::Mug,
            PartArg::Can => TurntablePart::Can,
            PartArg::Carton => TurntablePart::Carton,
            PartArg::Gear => TurntablePart::Gear,
            PartArg::Motor => TurntablePart::Motor,
        };
        let disc = match self.disc {
            DiscArg::Printed => TurntableDisc::Printed,
            DiscArg::Plain => TurntableDisc::Plain,
        };
        Some(TurntableOptions { part, disc, views, step: self.step, size, posed: self.posed, masks: self.masks })
    }
}

/// Writes the recordings `parts` of the set `seed` into folders of `out`.
///
/// # Errors
/// [`Failure::Work`] naming what cannot be written.
pub(crate) fn write(
    out: &Path,
    parts: Range<u32>,
    seed: u64,
    options: TurntableOptions,
    json: bool,
) -> Result<(), Failure> {
    let mut written = Vec::new();
    for part in parts {
        let folder = out.join(format!("{part:06}"));
        let recording = TurntableRecording::new(seed.wrapping_add(part.into()), options);
        write_recording(&folder, &recording, options)?;
        tracing::info!("{} views written to {}", options.views, folder.display());
        written.push(folder);
    }
    if json {
        print_json(&json!({ "recordings": written, "views": options.views }))?;
    }
    Ok(())
}

fn write_recording(folder: &Path, recording: &TurntableRecording, options: TurntableOptions) -> anyhow::Result<()> {
    use semascan_inspection::source::Source;
    let taxonomy = &recording.info().taxonomy;
    let writer = SceneWriter::create(folder, taxonomy, Isometry3::identity())?;
    let mut entries: Vec<SceneEntry> = Vec::new();
    for view in (0..options.views).filter_map(|index| recording.view(index)) {
        // What is known of the pose is what the recording says, not the truth.
        entries.push(writer.write(&View { truth: None, ..view })?);
    }
    writer.finish(&entries)?;
    let poses: Vec<_> = (0..options.views).map(|i| pose_record(&recording.table_from_camera(i))).collect();
    let truth = json!({
        "simulated": true,
        "step_deg": recording.step().to_degrees(),
        "table_from_camera": poses,
    });
    let path = folder.join("truth.json");
    std::fs::write(&path, format!("{truth:#}\n")).with_context(|| path.display().to_string())
}
