//! `cargo xtask test`: everything that can tell whether Semascan works, in the order in which it fails fastest.

use crate::browser::{Browser, Programs};
use crate::packages::NeedsYou;
use crate::process::{run as run_command, run_reading};
use crate::report::{Steps, note};
use crate::tally::{CargoTest, Tally};
use crate::training::{self, Training};
use crate::workspace::{Workspace, cargo};
use crate::{budget, onnx_runtime, web};
use anyhow::{Context, Result};
use clap::Args;
use std::path::PathBuf;

/// Folder of the real captures that some tests read.
const DATA: &str = "SEMASCAN_DATA";
/// What is tested beyond the features that are on by default: logins at an identity provider.
const FEATURES: &str = "semascan-cli/oidc";
/// Builds the agent, to which examples may be added. The whole workspace is selected: most features of the dependencies are then
/// the same as for the tests and little is compiled twice.
pub(crate) const BUILD_PROGRAMS: [&str; 6] = ["build", "--workspace", "--features", FEATURES, "--bin", "semascan"];
/// The example that a browser test passes to a page.
pub(crate) const ENDLESS_STREAM: &str = "endless_stream";

/// What is tested.
#[derive(Args)]
pub(crate) struct Options {
    /// Leave the browser tests out
    #[arg(long)]
    no_browser: bool,
    /// Leave the tests and the linter of the training code out, which need packages from PyPI
    #[arg(long)]
    no_training: bool,
    /// Run the browser tests only, or those whose file name contains NAME
    #[arg(long, value_name = "NAME", num_args = 0..=1, default_missing_value = "", conflicts_with = "no_browser")]
    browser: Option<String>,
    /// Build with every feature (PDF, tract, GenICam) and run its tests, too: some 500 crates more, and aravis
    #[arg(long)]
    all_features: bool,
    /// Fail unless the environment variable SEMASCAN_DATA names the folder of real captures
    #[arg(long)]
    require_data: bool,
}

/// Runs the steps, then prints what became of each.
pub(crate) fn run(options: &Options) -> Result<()> {
    let mut variables = variables(options.require_data)?;
    // What only a person can install is said at once, not after minutes of compiling.
    let browser = if options.no_browser { None } else { Some(Browser::prepare()?) };
    let workspace = Workspace::find()?;
    let mut steps = Steps::default();

    let python = test_training(options, &workspace, &mut steps)?;
    variables.extend(python.map(|python| (training::FOREIGN_PYTHON, python)));
    let web = steps.run("web build", |_| web::run(&web::Options { dev: false }).map(drop))?;
    if web {
        steps.run("download budget", |_| budget::check(&workspace))?;
    } else {
        steps.skip("download budget", "there is no web build");
    }
    let built = steps.run("rust build", |_| build(options, &workspace, &variables))?;
    if options.browser.is_some() {
        steps.skip("rust tests", "--browser");
    } else if built {
        steps.run("rust tests", |tally| test_rust(options, &workspace, &variables, tally))?;
    } else {
        steps.skip("rust tests", "the build failed");
    }
    match browser {
        None => steps.skip("browser tests", "--no-browser"),
        Some(_) if !(web && built) => steps.skip("browser tests", "a build failed"),
        Some(browser) => {
            let filter = options.browser.as_deref().filter(|name| !name.is_empty());
            let programs = Programs { agent: &agent(&workspace), endless_stream: &example(&workspace, ENDLESS_STREAM) };
            steps.run("browser tests", |tally| browser.run_tests(&workspace, programs, filter, tally))?;
        }
    }
    steps.finish()
}

/// The training code's linter and tests, which are done in seconds once their environment is made. Gives its Python.
fn test_training(options: &Options, workspace: &Workspace, steps: &mut Steps) -> Result<Option<PathBuf>> {
    let left_out = match () {
        () if options.no_training => Some("--no-training"),
        () if options.browser.is_some() => Some("--browser"),
        () => None,
    };
    if let Some(why) = left_out {
        steps.skip("training lint", why);
        steps.skip("training tests", why);
        return Ok(None);
    }
    let mut training = None;
    let prepare = |_: &mut Tally| Training::prepare(workspace).map(|prepared| training = Some(prepared));
    steps.run("training environment", prepare)?;
    match training {
        Some(training) => {
            steps.run("training lint", |_| training.lint())?;
            steps.run("training tests", |tally| training.test(tally))?;
            Ok(Some(training.python()))
        }
        None => {
            steps.skip("training lint", "there is no environment");
            steps.skip("training tests", "there is no environment");
            Ok(None)
        }
    }
}

/// Builds all tests and with them the agent, or what browser tests run alone where there are no others.
fn build(options: &Options, workspace: &Workspace, variables: &Variables) -> Result<()> {
    let mut build = cargo();
    build.current_dir(&workspace.root);
    match options.browser {
        Some(_) => build.args(BUILD_PROGRAMS).args(["--example", ENDLESS_STREAM]),
        None => build.args(["test", "--workspace", "--no-run"]).args(features(options)),
    };
    run_command(build.envs(variables.iter().cloned()))
}

/// What cargo is told of features; the build and the tests must be told the same.
fn features(options: &Options) -> &'static [&'static str] {
    if options.all_features { &["--all-features"] } else { &["--features", FEATURES] }
}

/// Runs the tests of all crates.
fn test_rust(options: &Options, workspace: &Workspace, variables: &Variables, tally: &mut Tally) -> Result<()> {
    let mut test = cargo();
    test.current_dir(&workspace.root).args(["test", "--workspace", "--no-fail-fast"]).args(features(options));
    test.args(["--", "--show-output"]);
    let mut output = CargoTest::default();
    run_reading(test.envs(variables.iter().cloned()), |line| output.read(line, tally))
}

/// The agent that `build` made: a build of an integration test builds the binaries of its package too.
pub(crate) fn agent(workspace: &Workspace) -> PathBuf {
    workspace.target.join("debug").join(format!("semascan{}", std::env::consts::EXE_SUFFIX))
}

/// An example that `build` made.
pub(crate) fn example(workspace: &Workspace, name: &str) -> PathBuf {
    workspace.target.join("debug/examples").join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Environment variables of the Rust tests.
type Variables = Vec<(&'static str, PathBuf)>;

/// Where the tests find ONNX Runtime, the real captures and a Python with PyTorch. Paths are absolute: tests run in the
/// folders of their packages.
fn variables(require_data: bool) -> Result<Variables> {
    let data = find_data(require_data)?.map(|folder| (DATA, folder));
    let python = training::python_with_torch()?.map(|python| (training::PYTHON, python));
    let onnx_runtime = onnx_runtime::prepare(&Workspace::find()?)?;
    Ok([Some((onnx_runtime::VARIABLE, onnx_runtime)), data, python].into_iter().flatten().collect())
}

/// The folder of real captures.
fn find_data(required: bool) -> Result<Option<PathBuf>> {
    let Some(folder) = std::env::var_os(DATA).map(PathBuf::from) else {
        if required {
            return Err(NeedsYou::new("the real captures are required", format!("export {DATA}=FOLDER")).into());
        }
        note(format!("{DATA} is not set: tests on real captures are skipped and say so"));
        return Ok(None);
    };
    let folder = folder.canonicalize().with_context(|| format!("{DATA} is {}", folder.display()))?;
    anyhow::ensure!(folder.is_dir(), "{DATA}: {} is not a folder", folder.display());
    note(format!("real captures from {}", folder.display()));
    Ok(Some(folder))
}
