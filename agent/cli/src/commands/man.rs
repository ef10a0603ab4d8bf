//! `semascan man`: the manual pages of this program and its commands.

use super::{Cli, Failure};
use anyhow::Context;
use clap::{Args, CommandFactory};
use std::fs;
use std::path::PathBuf;

/// Arguments of `semascan man`.
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder to write them into, which is made: a `man1` in a folder of $MANPATH, such as ~/.local/share/man/man1
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl ManArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let place = || self.out.display().to_string();
        fs::create_dir_all(&self.out).with_context(place)?;
        let mut command = Cli::command();
        command.build();
        clap_mangen::generate_to(command, &self.out).with_context(place)?;
        Ok(())
    }
}
