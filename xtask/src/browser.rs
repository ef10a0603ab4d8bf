//! The browser tests of `tests/browser`: brings in what they need (Chromium, Firefox, Node, npm packages) and runs them
//! against a built agent.

use crate::packages::{self, NeedsYou};
use crate::process::{capture, exists, run, run_reading};
use crate::report::note;
use crate::tally::{Tally, read_node};
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names Chromium goes by; `SEMASCAN_CHROMIUM` names another.
const CHROMIUM: [&str; 4] = ["chromium", "chromium-browser", "google-chrome-stable", "google-chrome"];

/// Names Firefox goes by; `SEMASCAN_FIREFOX` names another.
const FIREFOX: [&str; 2] = ["firefox-esr", "firefox"];

/// Oldest Node that the browser tests' packages run on.
const OLDEST_NODE: u32 = 20;

/// The built programs under test.
#[derive(Clone, Copy)]
pub(crate) struct Programs<'a> {
    /// The agent.
    pub(crate) agent: &'a Path,
    /// What a hostile agent sends.
    pub(crate) endless_stream: &'a Path,
}

/// The programs that the tests run in and by.
pub(crate) struct Browser {
    chromium: PathBuf,
    firefox: PathBuf,
}

impl Browser {
    /// Finds or installs Chromium, Firefox and Node.
    pub(crate) fn prepare() -> Result<Self> {
        prepare_node()?;
        if in_path("Xvfb").is_none() {
            // And on no graphics card.
            let packages = ["xvfb", "libegl1", "libgl1-mesa-dri"];
            packages::install("without a screen Firefox draws on one in memory", &packages)?;
        }
        let chromium = program("SEMASCAN_CHROMIUM", &CHROMIUM, "the browser tests drive Chromium", "chromium")?;
        let firefox = program("SEMASCAN_FIREFOX", &FIREFOX, "the browser tests drive Firefox", "firefox-esr")?;
        Ok(Self { chromium, firefox })
    }

    /// Runs every `*.test.mjs`, or those whose name contains `filter`, with `programs` under test.
    pub(crate) fn run_tests(
        &self,
        workspace: &Workspace,
        programs: Programs<'_>,
        filter: Option<&str>,
        tally: &mut Tally,
    ) -> Result<()> {
        let folder = workspace.root.join("tests/browser");
        install_npm_packages(&folder)?;
        let tests = tests(&folder, filter)?;
        // Two files at a time: a software rasterizer draws on every core, but half of the time a page waits for frames,
        // for its agent, or for a network. A test that never comes back is a failed test.
        let mut node = self.node(&folder, programs);
        node.args(["--test", "--test-concurrency=2", "--test-reporter=spec"]);
        node.args(["--test-timeout=600000", "--test-force-exit"]).args(tests);
        run_reading(&mut node, |line| {
            read_node(line, tally);
            true
        })
    }

    /// The command that runs the benchmark `tests/browser/bench/NAME.mjs` with `programs` under test.
    pub(crate) fn benchmark(&self, workspace: &Workspace, programs: Programs<'_>, name: &str) -> Result<Command> {
        let folder = workspace.root.join("tests/browser");
        install_npm_packages(&folder)?;
        let mut node = self.node(&folder, programs);
        node.arg(format!("bench/{name}.mjs"));
        Ok(node)
    }

    fn node(&self, folder: &Path, programs: Programs<'_>) -> Command {
        let mut node = Command::new("node");
        node.current_dir(folder).env("SEMASCAN_AGENT", programs.agent).env("SEMASCAN_CHROMIUM", &self.chromium);
        node.env("SEMASCAN_FIREFOX", &self.firefox);
        node.env("SEMASCAN_ENDLESS_STREAM", programs.endless_stream);
        node
    }
}

/// The program that `variable` names, or the first of `names` in PATH, or else the Debian `package`, installed because of `why`.
fn program(variable: &str, names: &[&str], why: &str, package: &str) -> Result<PathBuf> {
    if let Some(path) = std::env::var_os(variable) {
        return Ok(path.into());
    }
    let find = || names.iter().find_map(|name| in_path(name));
    if let Some(path) = find() {
        return Ok(path);
    }
    packages::install(why, &[package])?;
    find().with_context(|| format!("{package} was installed but is not in PATH; set {variable}"))
}

fn in_path(program: &str) -> Option<PathBuf> {
    std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(program)).find(|path| path.is_file())
}

/// Node from the distribution where there is none; one that is too old only a person can replace.
fn prepare_node() -> Result<()> {
    if !exists("node") || !exists("npm") {
        packages::install("the browser tests are written for Node", &["nodejs", "npm"])?;
    }
    let version = capture(Command::new("node").arg("--version"))?;
    let major = version.trim_start_matches('v').split('.').next().and_then(|text| text.parse::<u32>().ok());
    if major.is_none_or(|major| major < OLDEST_NODE) {
        let why = format!("the browser tests need Node {OLDEST_NODE} or newer and this is {version}");
        return Err(NeedsYou::new(why, format!("# install Node {OLDEST_NODE} (https://nodejs.org)")).into());
    }
    Ok(())
}

/// `npm ci`, unless it ran since the lock file last changed.
fn install_npm_packages(folder: &Path) -> Result<()> {
    let changed = |path: &str| fs::metadata(folder.join(path)).and_then(|file| file.modified());
    let wanted = changed("package-lock.json").context("tests/browser/package-lock.json")?;
    if changed("node_modules/.package-lock.json").is_ok_and(|installed| installed >= wanted) {
        return Ok(());
    }
    note("installing the npm packages of the browser tests");
    run(Command::new("npm").current_dir(folder).args(["ci", "--no-audit", "--no-fund", "--ignore-scripts"]))
}

fn tests(folder: &Path, filter: Option<&str>) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
        if name.ends_with(".test.mjs") && filter.is_none_or(|part| name.contains(part)) {
            names.push(name.to_owned());
        }
    }
    names.sort();
    anyhow::ensure!(!names.is_empty(), "no browser test matches {:?} in {}", filter.unwrap_or(""), folder.display());
    Ok(names)
}
