//! `semascan completions SHELL`: what a shell needs to complete the arguments of this program.

use super::{Cli, Failure};
use crate::stdout::print;
use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

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
        let mut script = Vec::new();
        generate(self.shell, &mut Cli::command(), "semascan", &mut script);
        print(&script)
    }
}
