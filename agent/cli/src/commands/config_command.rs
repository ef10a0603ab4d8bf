//! `semascan config`: a commented sample of `cell.toml`, which its help shows too, or whether a `cell.toml` can be read.

use super::{Failure, config};
use crate::stdout::print;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `semascan config`.
#[derive(Debug, Args)]
#[command(after_long_help = config::SAMPLE)]
pub(crate) struct ConfigArgs {
    /// Read this file and say what is wrong with it
    #[arg(value_name = "TOML", required_unless_present = "sample")]
    file: Option<PathBuf>,
    /// Print a cell.toml with every key, what it means and its default, all of them commented out
    #[arg(long, conflicts_with = "file")]
    sample: bool,
}

impl ConfigArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.sample {
            print(config::SAMPLE.as_bytes())?;
        }
        if let Some(file) = self.file {
            config::read(Some(&file)).map_err(Failure::Call)?;
            tracing::info!("{}: can be used", file.display());
        }
        Ok(())
    }
}
