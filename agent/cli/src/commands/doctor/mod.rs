//! `semascan doctor`: whether everything that inspections need is there, and with a `cell.toml` whether the cell is as that says. Each
//! finding says how to mend it.
//!
//! | file | what |
//! |---|---|
//! | `program.rs` | what the program needs wherever it runs |
//! | `cell.rs` | the source: its topics, clocks, transforms, its calibration |
//! | `picture.rs` | depth, focus and exposure of what it shows |
//! | `disk.rs` | where inspections are kept |

mod cell;
mod disk;
mod picture;
mod program;

use super::{Failure, config, numbers};
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::anyhow;
use clap::Args;
use semascan_server::EmbeddedFiles;
use serde::Serialize;
use serde_json::{Value, json};
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `semascan doctor`.
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    /// Configuration of the cell, which is held against what is there: its source is listened to
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// How long a live source is listened to
    #[arg(long, value_name = "SECONDS", default_value = "3", value_parser = numbers::pause, allow_negative_numbers = true)]
    seconds: f64,
    /// Temperature of the cell now, degrees Celsius, to hold against that of its calibration
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    temperature: Option<f64>,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// How something stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Health {
    Ok,
    /// It works, but not as well as it could.
    Warning,
    /// It does not work.
    Failed,
}

/// One thing that was looked at.
#[derive(Clone, Debug, Serialize)]
struct Finding {
    what: &'static str,
    health: Health,
    text: String,
    /// What to do about it; empty where all is well.
    mend: String,
    /// Where it is looked for, the first place first; empty for what is built in.
    looked_in: Vec<PathBuf>,
    details: Value,
}

impl Finding {
    /// All is well.
    fn ok(what: &'static str, text: impl Into<String>) -> Self {
        Self {
            what,
            health: Health::Ok,
            text: text.into(),
            mend: String::new(),
            looked_in: Vec::new(),
            details: Value::Null,
        }
    }

    /// Something is wrong, and what to do about it.
    fn wrong(what: &'static str, health: Health, text: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { health, mend: mend.into(), ..Self::ok(what, text) }
    }
}

impl DoctorArgs {
    pub(crate) fn run(self, embedded: EmbeddedFiles) -> Result<(), Failure> {
        let mut config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        // The source is looked at all the same where the calibration cannot be used.
        let calibration = cell::calibration(&config.cell, self.temperature);
        if calibration.as_ref().is_some_and(|found| found.health == Health::Failed) {
            config.cell.calibration = None;
        }
        let spec = config.complete(config.inspection.clone(), None);
        let mut findings = program::findings(&spec, embedded);
        // Without a configuration nothing is known of a cell.
        if self.config.is_some() {
            findings.extend(calibration);
            let (of_cell, stream) = cell::findings(&config.cell, &spec, Duration::from_secs_f64(self.seconds));
            findings.extend(of_cell);
            findings.push(disk::finding(&config.cell, stream));
        }
        let mut out = Stderr::default();
        for finding in &findings {
            let looked_in = finding.looked_in.iter().map(|place| place.display().to_string()).collect::<Vec<_>>();
            let mark = match finding.health {
                Health::Ok => "ok     ",
                Health::Warning => "warning",
                Health::Failed => "FAILED ",
            };
            writeln!(out, "{mark}  {:<13} {}", finding.what, finding.text)?;
            if !finding.mend.is_empty() {
                writeln!(out, "{:>24}to mend it: {}", "", finding.mend)?;
            }
            if !looked_in.is_empty() {
                writeln!(out, "{:>24}looked for in this order: {}", "", looked_in.join(", "))?;
            }
        }
        let failed: Vec<&str> = findings.iter().filter(|f| f.health == Health::Failed).map(|f| f.what).collect();
        if self.json {
            let report = json!({ "healthy": failed.is_empty(), "findings": findings });
            print_json(&report)?;
        }
        if failed.is_empty() {
            Ok(())
        } else {
            Err(Failure::Work(anyhow!("not as it should be: {}", failed.join(", "))))
        }
    }
}
