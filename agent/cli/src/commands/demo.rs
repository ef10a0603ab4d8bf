//! `semascan demo`: a simulated starter motor, watched in the browser.

use super::config::CellConfig;
use super::reach::ReachArgs;
use super::serve::{Job, serve, use_threads};
use super::signals::Signals;
use super::{Failure, numbers, source};
use anyhow::Context;
use clap::Args;
use semascan_inspection::spec::InspectionSpec;
use semascan_server::EmbeddedFiles;
use semascan_store::data::DataFolder;
use std::path::PathBuf;
use std::sync::Arc;

/// What the demo shows.
const DEMO_SOURCE: &str = "virtual:starter-motor?seed=7&views=12";

/// Arguments of `semascan demo`.
#[derive(Debug, Args)]
#[command(after_long_help = source::help())]
pub(crate) struct DemoArgs {
    /// What to inspect
    #[arg(long, default_value = DEMO_SOURCE)]
    source: String,
    /// Do not open the browser
    #[arg(long)]
    no_open: bool,
    /// Least time between two captures in seconds
    #[arg(
        long, value_name = "SECONDS", default_value_t = 1.5,
        value_parser = numbers::pause, allow_negative_numbers = true
    )]
    pace: f64,
    /// Voxel edge in millimetres
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    voxel: Option<f64>,
    /// Data folder to keep the inspection in [default: a temporary one, gone when the demo ends]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArgs,
}

impl DemoArgs {
    pub(crate) fn run(self, viewer: EmbeddedFiles, signals: &Signals) -> Result<(), Failure> {
        use_threads(self.reach.threads)?;
        let mut spec = InspectionSpec::default();
        spec.source.uri = Some(self.source);
        spec.source.voxel_mm = self.voxel;
        spec.source.pace_s = self.pace;
        let spec = Box::new(spec);
        // Photographs in full size, reviews and past inspections are those of a data folder: the demo shows them too.
        let temporary = tempfile::tempdir().context("the demo keeps its inspection in a temporary folder")?;
        let folder = self.data.as_deref().unwrap_or(temporary.path());
        let job = Job::Keep { data: Arc::new(DataFolder::open(folder)?), spec: Some(spec), criteria: None };
        serve(&self.reach, &CellConfig::default(), viewer, !self.no_open, Some(job), signals)
    }
}
