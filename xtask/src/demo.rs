//! `cargo xtask demo`: from a fresh clone to a running inspection in the browser. Its address answers at once; until the agent
//! is built, with a page that says so.

use crate::first_page::FirstPage;
use crate::process::{line, run as run_command};
use crate::report::{heading, note};
use crate::workspace::{Workspace, cargo};
use crate::{onnx_runtime, web};
use anyhow::{Context, Result};
use clap::Args;
use std::ffi::OsString;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::process::{Child, Command, Stdio};

/// The agent's port where none is said.
const DEFAULT_PORT: u16 = 8787;

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
    let page = match address(&options.arguments) {
        Some(address) => {
            let begun = FirstPage::begin(address)
                .with_context(|| format!("choose another port: cargo xtask demo -- --port {}", address.port() + 1));
            let page = begun?;
            heading("Demo");
            note(format!("it starts at http://{address}: the page there says how far it is and then shows the viewer"));
            page.say("The viewer is being built.");
            Some(page)
        }
        None => None,
    };
    // All of the agent but the embedding of the viewer's files: the viewer's long last step has work for one core only.
    let ahead = Ahead::begin(cargo_for(&Workspace::find()?, "build", options.dev).arg("--lib"))?;
    let workspace = web::run(&web::Options { dev: options.dev })?;
    heading("Agent");
    let library = onnx_runtime::prepare(&workspace);
    if let Err(error) = &library {
        // The demo's own labels come from the simulation: only trained networks need it.
        note(format!("without ONNX Runtime trained networks do not run, the rest does: {error:#}"));
    }
    if let Some(page) = &page {
        page.say("The agent is being built.");
    }
    ahead.end();
    run_command(cargo_for(&workspace, "build", options.dev).args(["--bin", "semascan"]))?;
    let mut agent = cargo_for(&workspace, "run", options.dev);
    agent.args(["--bin", "semascan", "--", "demo"]);
    if options.dev {
        agent.arg("--web-dir").arg(workspace.dist());
    }
    agent.args(&options.arguments);
    if let Ok(library) = library {
        agent.env(onnx_runtime::VARIABLE, library);
    }
    if let Some(page) = page {
        page.end();
    }
    become_command(&mut agent)
}

/// Cargo's `command` for the agent.
fn cargo_for(workspace: &Workspace, command: &str, dev: bool) -> Command {
    let mut cargo = cargo();
    cargo.current_dir(&workspace.root).args([command, "--package", "semascan-cli"]);
    if !dev {
        cargo.arg("--release");
    }
    cargo
}

/// A build in the background, which another build of the same will follow: that one says what is wrong.
struct Ahead(Child);

impl Ahead {
    fn begin(command: &mut Command) -> Result<Self> {
        let command = command.arg("--quiet").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        Ok(Self(command.spawn().with_context(|| format!("cannot start `{}`", line(command)))?))
    }

    /// Waits until it is done, well or not.
    fn end(mut self) {
        let _ = self.0.wait();
    }
}

impl Drop for Ahead {
    /// Where the demo fails, the build is not left behind.
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Where the agent will listen; `None` where it picks a free port itself, only prints its help, or refuses what is said.
fn address(arguments: &[OsString]) -> Option<SocketAddr> {
    let arguments: Vec<&str> = arguments.iter().filter_map(|argument| argument.to_str()).collect();
    if arguments.iter().any(|argument| ["--help", "-h"].contains(argument)) {
        return None;
    }
    let port = value_of("--port", &arguments).map_or(Ok(DEFAULT_PORT), str::parse).ok()?;
    let loopback = IpAddr::from(Ipv4Addr::LOCALHOST);
    let ip = value_of("--listen", &arguments).map_or(Ok(loopback), str::parse).ok()?;
    (port != 0).then(|| SocketAddr::from((ip, port)))
}

/// The value of the argument `name`, as `--name value` or `--name=value`.
fn value_of<'a>(name: &str, arguments: &[&'a str]) -> Option<&'a str> {
    arguments.iter().enumerate().find_map(|(i, argument)| match argument.strip_prefix(name)? {
        "" => arguments.get(i + 1).copied(),
        rest => rest.strip_prefix('='),
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_is_that_of_the_demo_s_arguments() {
        let of = |text: &str| address(&text.split_whitespace().map(OsString::from).collect::<Vec<_>>());
        let at = |text: &str| Some(text.parse().expect("an address"));
        assert_eq!(of(""), at("127.0.0.1:8787"));
        assert_eq!(of("--no-open --port 9000 --source virtual:starter-motor"), at("127.0.0.1:9000"));
        assert_eq!(of("--pace 0 --port=9001 --listen 0.0.0.0"), at("0.0.0.0:9001"));
        assert_eq!(of("--port 0"), None);
        assert_eq!(of("--help"), None);
        assert_eq!(of("--port many"), None);
    }
}
