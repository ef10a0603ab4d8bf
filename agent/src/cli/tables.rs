//! `semascan tables P1`: reruns a paper's tables on the virtual cell.

use super::Failure;
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use semascan_agent::evaluate::tables::p1;
use std::io::Write;
use std::path::PathBuf;

/// The papers whose tables can be rerun.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Paper {
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
    /// Runs of each object
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Views of each run (P1: 16)
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=360))]
    views: u32,
    /// Only objects whose name contains this
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Folder with the YCB meshes (lemon/textured.obj ...) [default: objects/ycb in SEMASCAN_DATA]
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
            Paper::P1 => self.p1(),
        }
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
            seeds: self.seeds,
            views: self.views,
            setting: p1::Setting::P1,
            ycb,
            only: self.only.clone(),
            workers: std::thread::available_parallelism().map_or(1, usize::from),
        };
        let bar = ProgressBar::no_length();
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {elapsed} of {duration}") {
            bar.set_style(style);
        }
        let result = p1::run(&config, |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        let report = result.map_err(|error| match error {
            p1::TableError::NoObject(_) => Failure::Call(error.into()),
            error => Failure::Work(error.into()),
        })?;
        let text = serde_json::to_string_pretty(&report)?;
        if let Some(file) = &self.out {
            std::fs::write(file, &text).with_context(|| format!("{} could not be written", file.display()))?;
        }
        p1::print(&report, &mut std::io::stderr().lock())?;
        if self.json {
            writeln!(std::io::stdout().lock(), "{text}")?;
        }
        Ok(())
    }
}
