//! The tables of [Remanufacturing paper]: reference models (Table 1), networks and fusion (Tables 3 and 5), ensemble
//! and filter (Table 5), and inspections labelled by networks (Table 6).

pub mod ensemble;
pub mod inspections;
pub mod networks;
pub mod reference_models;

use super::frozen_threshold::{self, FrozenThreshold, freeze};
use super::{InspectError, NetworkSetting, Progress};
use crate::{AlignError, NetworkError, TestDomain};
use semascan_inspection::source::SourceError;
use serde::Serialize;
use std::io::{self, Write};

/// The tables there are.
pub const TABLES: [u32; 4] = [1, 3, 5, 6];

/// What is run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Of [`TABLES`].
    pub tables: Vec<u32>,
    /// For Table 1.
    pub reference_models: reference_models::Config,
    /// For all others.
    pub networks: NetworkSetting,
}

/// Why a table could not be made.
#[derive(Debug, thiserror::Error)]
pub enum P0Error {
    /// A motor cannot be had.
    #[error(transparent)]
    Acquire(#[from] SourceError),
    /// An inspection has no result.
    #[error(transparent)]
    Inspect(#[from] InspectError),
    /// Networks could not be judged.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// No view of a motor could be used.
    #[error("motor {0}: no view could be used")]
    NoView(u64),
    /// No alignment of a motor succeeded.
    #[error("motor {motor}: {source}")]
    Align {
        /// Its seed.
        motor: u64,
        /// What the first attempt said.
        source: AlignError,
    },
}

/// The tables that were asked for.
#[derive(Clone, Debug, Serialize)]
pub struct P0Tables {
    /// Table 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_1: Option<reference_models::Table1>,
    /// Table 3, and the single networks of Table 5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_3: Option<networks::Table3>,
    /// The threshold of Tables 5 and 6.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<FrozenThreshold>,
    /// Table 5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_5: Option<ensemble::Table5>,
    /// Table 6.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_6: Option<inspections::Table6>,
}

/// Makes the tables; `on_step` gets how many steps are done, and of how many.
///
/// # Errors
/// [`P0Error`]
pub fn run(config: &Config, mut on_step: impl FnMut(usize, usize)) -> Result<P0Tables, P0Error> {
    let setting = &config.networks;
    let wants = |table: u32| config.tables.contains(&table);
    let views = TestDomain::ALL.len() * setting.test.count();
    let filter = wants(5) || wants(6);
    let mut progress = Progress::new(&mut on_step);
    for (wanted, steps) in [
        (wants(1), config.reference_models.motors.len()),
        (wants(3), views),
        (filter, frozen_threshold::steps(setting)),
        (wants(5), views),
        (wants(6), setting.test.motors.len()),
    ] {
        progress.expect(if wanted { steps } else { 0 });
    }
    let progress = &mut progress;
    let table_1 = wants(1).then(|| reference_models::run(&config.reference_models, || progress.step())).transpose()?;
    let table_3 = wants(3).then(|| networks::run(setting, progress)).transpose()?;
    let shelf = setting.shelf()?;
    let threshold = filter.then(|| freeze(&shelf, setting, progress)).transpose()?;
    let sigma = threshold.as_ref().map_or(1.0, |t| t.sigma);
    let table_5 = wants(5).then(|| ensemble::run(&shelf, setting, sigma, progress)).transpose()?;
    let table_6 = wants(6).then(|| inspections::run(&shelf, setting, sigma, progress)).transpose()?;
    Ok(P0Tables { table_1, table_3, threshold, table_5, table_6 })
}

/// Writes the tables for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &P0Tables) -> io::Result<()> {
    if let Some(table) = &report.table_1 {
        reference_models::print(out, table)?;
        writeln!(out)?;
    }
    if let Some(table) = &report.table_3 {
        networks::print(out, table)?;
        writeln!(out)?;
    }
    if let Some(threshold) = &report.threshold {
        threshold.print(out)?;
        writeln!(out)?;
    }
    if let Some(table) = &report.table_5 {
        ensemble::print(out, table)?;
        writeln!(out)?;
    }
    if let Some(table) = &report.table_6 {
        inspections::print(out, table)?;
    }
    Ok(())
}
