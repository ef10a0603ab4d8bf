//! `semascan synth --out DIR --parts N --views N --seed S`: labelled training data from the virtual cell, or with
//! `--turntable` recordings of a turntable (`synth_turntable`).

use super::synth_turntable::{self, TurntableArgs};
use super::{Failure, numbers, serve};
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::Isometry3;
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use semascan_perception::view::View;
use semascan_simulation::{GENERATOR, Randomisation, TrainingCell, TrainingOptions, VirtualCellSpec};
use semascan_sources::training_set::{Description, GeneratedPart, Manifest, PartGenerator, TrainingSet};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `semascan synth`.
#[derive(Debug, Args)]
pub(crate) struct SynthArgs {
    /// Folder to write the set into, or to go on with; parts that are there are left as they are
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of parts, each a starter motor of its own
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    parts: u32,
    /// Views of each part; every view has lights, camera and surfaces of its own
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    views: u32,
    /// Everything random depends on it
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Columns and rows of the camera's picture
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    size: (u32, u32),
    /// Columns and rows of the window around the part that is written, at the picture's own resolution
    #[arg(long, value_name = "WxH", default_value = "320x256", value_parser = size)]
    window: (u32, u32),
    /// Number of the first part: several processes may write parts of one set, each its own
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=900_000))]
    first_part: u32,
    #[command(flatten)]
    turntable: TurntableArgs,
    /// Threads to compute with; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = numbers::threads(), allow_negative_numbers = true)]
    threads: Option<usize>,
    /// Print a summary as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    out: &'a Path,
    dataset: &'a Manifest,
    first_part: u32,
    parts_written: usize,
    parts_kept: u32,
    views_written: u64,
    seconds: f64,
}

impl SynthArgs {
    pub(crate) fn run(self, quiet: bool) -> Result<(), Failure> {
        serve::use_threads(self.threads)?;
        if self.out.exists() {
            regular_file::check_folder(&self.out).with_context(|| self.out.display().to_string())?;
        }
        if let Some(recordings) = self.turntable.options(self.views, self.size) {
            let parts = self.first_part..self.first_part + self.parts;
            return synth_turntable::write(&self.out, parts, self.seed, recordings, self.json);
        }
        let ((w, h), (columns, rows)) = (self.size, self.window);
        if columns > w || rows > h {
            return Err(Failure::Call(anyhow!("--window {columns}x{rows} does not fit into --size {w}x{h}")));
        }
        let options = TrainingOptions { size: self.size, window: self.window, ..TrainingOptions::default() };
        let end = self.first_part + self.parts;
        let generator = TrainingParts { seed: self.seed, options };
        let set = TrainingSet::open(&self.out, end, self.views, generator).map_err(|e| match e {
            SourceError::Field { .. } => Failure::Call(e.into()),
            e => Failure::Work(e.into()),
        })?;
        let missing = set.missing(self.first_part..end);
        let kept = self.parts - missing.len() as u32;
        if kept > 0 {
            tracing::info!("{kept} of {} parts are there already and are left as they are", self.parts);
        }
        let views = missing.len() as u64 * u64::from(self.views);
        let bar = if quiet { ProgressBar::hidden() } else { progress_bar(views) };
        let start = Instant::now();
        for part in &missing {
            bar.set_message(format!("part {part}"));
            set.write_part(*part, &|| bar.inc(1))?;
        }
        bar.finish_and_clear();
        let seconds = start.elapsed().as_secs_f64();
        let written = missing.len() as u64 * u64::from(self.views);
        tracing::info!(
            "{} parts with {written} views in {seconds:.1} s written to {}",
            missing.len(),
            self.out.display()
        );
        if self.json {
            let summary = Summary {
                out: &self.out,
                dataset: set.manifest(),
                first_part: self.first_part,
                parts_written: missing.len(),
                parts_kept: kept,
                views_written: written,
                seconds,
            };
            print_json(&summary)?;
        }
        Ok(())
    }
}

/// Training parts, as the virtual cell draws them.
struct TrainingParts {
    seed: u64,
    options: TrainingOptions,
}

impl PartGenerator for TrainingParts {
    fn description(&self) -> Description {
        let TrainingOptions { size, window, cell } = self.options;
        let (generator, taxonomy) = (GENERATOR.to_owned(), TrainingCell::taxonomy());
        Description { generator, seed: self.seed, size, window, cell, taxonomy }
    }

    fn part(&self, part: u32) -> Box<dyn GeneratedPart + '_> {
        Box::new(TrainingPart(TrainingCell::new(self.seed, part, self.options, Randomisation::TRAINING)))
    }
}

struct TrainingPart(TrainingCell);

impl GeneratedPart for TrainingPart {
    fn table_from_part(&self) -> Isometry3<f64> {
        self.0.table_from_part()
    }

    fn view(&self, index: u32) -> View {
        self.0.view(index)
    }

    fn about(&self) -> Value {
        json!({ "part_seed": self.0.part_seed(), "part": self.0.description() })
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    VirtualCellSpec::parse_size(text)
        .ok_or_else(|| format!("not WIDTHxHEIGHT, each 16 to {}", VirtualCellSpec::MAX_EDGE))
}

fn progress_bar(views: u64) -> ProgressBar {
    let bar = ProgressBar::new(views);
    // A template that indicatif cannot read costs the decoration only.
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} views  {elapsed} of {duration}  {wide_msg}") {
        bar.set_style(style);
    }
    bar
}
