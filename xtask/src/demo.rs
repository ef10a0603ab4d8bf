//! `cargo xtask demo`: from a fresh clone to a running inspection in the browser.

use crate::process::line;
use crate::report::{heading, note};
use crate::workspace::cargo;
use crate::{onnx_runtime, web};
use anyhow::Result;
use clap::Args;
use std::ffi::OsString;
use std::process::Command;

/// What the demo is built and called with.
#[derive(Args)]
pub(crate) struct Options {
    /// Build quickly; serve the web files from disk, so that `cargo xtask web --dev` and a reload show a change
    #[arg(long)]
    dev: bool,
    /// Passed on to `semascan demo` (after `--`), as in `-- --port 9000`
    #[arg(last = true)]
    arguments: Vec<OsString>,
}

/// Builds the web files, then the agent that embeds them, and becomes the agent.
pub(crate) fn run(options: &Options) -> Result<()> {
    let workspace = web::run(&web::Options { dev: options.dev })?;
    heading("Agent");
    let mut agent = cargo();
    agent.current_dir(&workspace.root).args(["run", "--package", "semascan-cli", "--bin", "semascan"]);
    if !options.dev {
        agent.arg("--release");
    }
    agent.args(["--", "demo"]);
    if options.dev {
        agent.arg("--web-dir").arg(workspace.dist());
    }
    agent.args(&options.arguments);
    match onnx_runtime::prepare(&workspace) {
        Ok(library) => drop(agent.env(onnx_runtime::VARIABLE, library)),
        // The demo's own labels come from the simulation: only trained networks need it.
        Err(error) => note(format!("without ONNX Runtime trained networks do not run, the rest does: {error:#}")),
    }
    become_command(&mut agent)
}

/// Hands this process over, so that Ctrl-C reaches the agent alone and the shell waits for its orderly end.
#[cfg(unix)]
fn become_command(command: &mut Command) -> Result<()> {
    use std::os::unix::process::CommandExt;
    eprintln!("   $ {}", line(command));
    Err(command.exec().into())
}

#[cfg(not(unix))]
fn become_command(command: &mut Command) -> Result<()> {
    eprintln!("   $ {}", line(command));
    let status = command.status()?;
    anyhow::ensure!(status.success(), "the demo ended with {status}");
    Ok(())
}
