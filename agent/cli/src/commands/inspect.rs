//! `semascan inspect S --out DIR`: one inspection without a browser.

use super::report;
use super::run::{InspectionArgs, run, unique_id};
use super::{Failure, config, serve};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use semascan_inspection::pipeline::{InspectionSink, Stage, StageStatus, ViewOutcome};
use semascan_perception::fuse::{SemanticMap, TouchedChunk};
use semascan_perception::register::JointRefinement;
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Arguments of `semascan inspect`.
#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// What to inspect: `virtual:starter-motor?seed=7&views=5`, a BOP scene folder, or a folder of PCD files
    source: String,
    /// Folder to write the inspection into
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Configuration of the cell
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    #[command(flatten)]
    inspection: InspectionArgs,
    /// Also write each view as a semantic cloud of its own: DIR/views/000000.ply
    #[arg(long)]
    view_clouds: bool,
    /// Threads to compute with; the result does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Print the record as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl InspectArgs {
    pub(crate) fn run(mut self) -> Result<(), Failure> {
        serve::use_threads(self.threads)?;
        self.inspection.configure(&config::read(self.config.as_deref()).map_err(Failure::Call)?);
        let mut source = self.inspection.open(&self.source)?;
        let bar = Bar::new(source.info().view_count);
        let stop = AtomicBool::new(false);
        let done = run(source.as_mut(), &self.inspection, &unique_id(), &bar, &stop);
        bar.0.finish_and_clear();
        let done = done?;
        done.write(&self.out, source.as_ref())?;
        if self.view_clouds {
            done.write_view_clouds(&self.out.join("views"), source.as_ref())?;
        }
        report::print(&done.record, &self.out)?;
        if self.json {
            let mut out = std::io::stdout().lock();
            serde_json::to_writer(&mut out, &done.record)?;
            writeln!(out)?;
        }
        Ok(())
    }
}

/// A progress bar that hears the inspection.
struct Bar(ProgressBar);

impl Bar {
    fn new(views: Option<u32>) -> Self {
        let bar = views.map_or_else(ProgressBar::no_length, |n| ProgressBar::new(n.into()));
        // A template that indicatif cannot read costs the decoration only.
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} views  {elapsed}  {wide_msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }
}

impl InspectionSink for Bar {
    fn stage(&self, view: u32, stage: Stage, status: &StageStatus) {
        if *status == StageStatus::Started {
            self.0.set_message(format!("view {view}: {}", stage.name()));
        }
    }

    fn map_changed(&self, _map: &SemanticMap, _touched: &[TouchedChunk], _last: bool) {}

    fn view_done(&self, outcome: &ViewOutcome) {
        if let Err(reason) = &outcome.result {
            self.0.suspend(|| tracing::warn!("view {} left out: {reason}", outcome.index));
        }
        self.0.inc(1);
    }

    fn refined(&self, _views: &[u32], _refinement: &JointRefinement) {}
}
