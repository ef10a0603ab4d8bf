//! `semascan tables P0|P1`: reruns a paper's tables on the virtual cell.

use super::Failure;
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use semascan_agent::evaluate::tables::{p0, p1};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

/// The papers whose tables can be rerun.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Paper {
    /// Semantic 3D product modelling for inspection: Table 1
    #[value(name = "P0", alias = "p0")]
    P0,
    /// Semantic 3D reconstruction for manipulators: Tables 3 to 5
    #[value(name = "P1", alias = "p1")]
    P1,
}

/// Arguments of `semascan tables`.
#[derive(Debug, Args)]
pub(crate) struct TablesArgs {
    /// The paper
    #[arg(value_enum)]
    paper: Paper,
    /// P1: runs of each object [default: 10]; P0: motors [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: Option<u64>,
    /// Views of each run [default: 12, P0: 5; P1 itself took 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=360))]
    views: Option<u32>,
    /// P1: only objects whose name contains this
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// P1: folder with the YCB meshes (lemon/textured.obj ...) [default: objects/ycb in SEMASCAN_DATA]
    #[arg(long, value_name = "DIR")]
    ycb: Option<PathBuf>,
    /// Also write the JSON report into this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl TablesArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.paper {
            Paper::P0 => self.p0(),
            Paper::P1 => self.p1(),
        }
    }

    fn p0(self) -> Result<(), Failure> {
        if self.only.is_some() || self.ycb.is_some() {
            return Err(Failure::Call(anyhow!("--only and --ycb belong to P1")));
        }
        let mut config = p0::Config::default();
        config.views = self.views.unwrap_or(config.views);
        if let Some(motors) = self.seeds {
            config.motors = (1..=motors).map(|k| 100 + k).collect();
        }
        let bar = progress_bar(config.motors.len());
        let report = p0::run(&config, |done| bar.set_position(done as u64));
        bar.finish_and_clear();
        let report = report?;
        p0::print(&mut std::io::stderr().lock(), &report)?;
        self.write(&report)
    }

    fn p1(self) -> Result<(), Failure> {
        let in_data = || Some(PathBuf::from(std::env::var_os("SEMASCAN_DATA")?).join("objects/ycb"));
        let ycb = self.ycb.clone().or_else(|| in_data().filter(|folder| folder.is_dir()));
        match &ycb {
            None => tracing::warn!("no YCB meshes: name their folder with --ycb; those objects are left out"),
            Some(folder) if !folder.is_dir() => {
                return Err(Failure::Call(anyhow!("--ycb {}: no such folder", folder.display())));
            }
            Some(_) => {}
        }
        let config = p1::Config {
            seeds: self.seeds.unwrap_or(10),
            views: self.views.unwrap_or(12),
            setting: p1::Setting::P1,
            ycb,
            only: self.only.clone(),
            workers: std::thread::available_parallelism().map_or(1, usize::from),
        };
        let bar = progress_bar(0);
        let result = p1::run(&config, |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        let report = result.map_err(|error| match error {
            p1::TableError::NoObject(_) => Failure::Call(error.into()),
            error => Failure::Work(error.into()),
        })?;
        p1::print(&report, &mut std::io::stderr().lock())?;
        self.write(&report)
    }

    /// The report as JSON, where it was asked for.
    fn write(&self, report: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(report)?;
        if let Some(file) = &self.out {
            std::fs::write(file, &text).with_context(|| format!("{} could not be written", file.display()))?;
        }
        if self.json {
            writeln!(std::io::stdout().lock(), "{text}")?;
        }
        Ok(())
    }
}

fn progress_bar(length: usize) -> ProgressBar {
    let bar = ProgressBar::new(length as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {elapsed} of {duration}") {
        bar.set_style(style);
    }
    bar
}
