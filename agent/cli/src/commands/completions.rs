//! `semascan completions SHELL`: what a shell needs to complete the arguments of this program.

use super::{Cli, Failure};
use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};
use std::io::Write;

/// Arguments of `semascan completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell. Bash: `semascan completions bash > ~/.local/share/bash-completion/completions/semascan`; zsh: into a file
    /// `_semascan` of a folder in $fpath; fish: `semascan completions fish > ~/.config/fish/completions/semascan.fish`
    #[arg(value_enum)]
    shell: Shell,
}

impl CompletionsArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        // A closed pipe is an error, not a panic.
        let mut script = Vec::new();
        generate(self.shell, &mut Cli::command(), "semascan", &mut script);
        std::io::stdout().lock().write_all(&script)?;
        Ok(())
    }
}
