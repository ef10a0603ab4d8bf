//! `cargo xtask attack`: what many and hostile clients cost the agent, within bounds of count and time, on loopback only.
//!
//! The work is done by `tests/examples/attack.rs`. Where an unprivileged network namespace can be made, it runs in one of its
//! own, so that it can take addresses away from connected viewers; elsewhere that part is skipped, and said.

use crate::process::{run as run_command, run_within};
use crate::report::{heading, note};
use crate::test;
use crate::workspace::{Workspace, cargo};
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Addresses whose viewers vanish.
const VANISHING: [&str; 2] = ["10.99.0.1", "10.99.0.2"];
/// The attack ends itself before that.
const LIMIT: Duration = Duration::from_secs(330);

/// What is attacked.
#[derive(Args)]
pub(crate) struct Options {
    /// Attack this agent instead of the one that is built
    #[arg(long, value_name = "PROGRAM")]
    agent: Option<PathBuf>,
}

/// Attacks, and fails if a bound is broken.
pub(crate) fn run(options: &Options) -> Result<()> {
    let workspace = Workspace::find()?;
    heading("Attack");
    // As `cargo xtask test` builds them: after it, nothing is compiled.
    run_command(cargo().current_dir(&workspace.root).args(test::BUILD_PROGRAMS).args(["--example", "attack"]))?;
    let agent = match &options.agent {
        Some(agent) => agent.canonicalize()?,
        None => test::agent(&workspace),
    };
    let attack = test::example(&workspace, "attack");
    if !has_namespaces() {
        note("half-open peers are left out: no network namespace can be made here (unshare --map-root-user --net)");
        return run_within(Command::new(attack).arg(agent), LIMIT);
    }
    let addresses: String = VANISHING.map(|a| format!("ip address add {a}/32 dev lo && ")).concat();
    let script = format!("ip link set lo up && {addresses}exec \"$@\"");
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--net", "sh", "-c", &script, "sh"]).arg(attack).arg(agent);
    run_within(command.arg("--half-open").args(VANISHING), LIMIT)
}

/// Whether this user may make a network namespace and change addresses in it.
fn has_namespaces() -> bool {
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--net", "ip", "link", "set", "lo", "up"]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}
