//! `cargo xtask test`: everything that can tell whether Semascan works, in the order in which it fails fastest.

use crate::browser::Browser;
use crate::packages::NeedsYou;
use crate::process::run as run_command;
use crate::report::{Steps, note};
use crate::workspace::{Workspace, cargo};
use crate::{budget, onnx_runtime, web};
use anyhow::{Context, Result};
use clap::Args;
use std::path::PathBuf;

/// Folder of the real captures that some tests read.
const DATA: &str = "SEMASCAN_DATA";

/// What is tested.
#[derive(Args)]
pub(crate) struct Options {
    /// Leave the browser tests out
    #[arg(long)]
    no_browser: bool,
    /// Run the browser tests only, or those whose file name contains NAME
    #[arg(long, value_name = "NAME", num_args = 0..=1, default_missing_value = "", conflicts_with = "no_browser")]
    browser: Option<String>,
    /// Fail unless the environment variable SEMASCAN_DATA names the folder of real captures
    #[arg(long)]
    require_data: bool,
}

/// Runs the steps, then prints what became of each.
pub(crate) fn run(options: &Options) -> Result<()> {
    let data = find_data(options.require_data)?;
    // What only a person can install is said at once, not after minutes of compiling.
    let browser = if options.no_browser { None } else { Some(Browser::prepare()?) };
    let workspace = Workspace::find()?;
    let onnx_runtime = onnx_runtime::prepare(&workspace)?;
    let mut steps = Steps::default();

    let built = steps.run("web build", || web::run(&web::Options { dev: false }).map(drop))?;
    if built {
        steps.run("download budget", || budget::check(&workspace))?;
    } else {
        steps.skip("download budget", "there is no web build");
    }
    if options.browser.is_some() {
        steps.skip("rust tests", "--browser");
    } else {
        steps.run("rust tests", || {
            let mut test = cargo();
            test.current_dir(&workspace.root).args(["test", "--workspace", "--no-fail-fast"]);
            test.env(onnx_runtime::VARIABLE, &onnx_runtime);
            run_command(data.iter().fold(&mut test, |test, folder| test.env(DATA, folder)))
        })?;
    }
    match browser {
        None => steps.skip("browser tests", "--no-browser"),
        Some(_) if !built => steps.skip("browser tests", "there is no web build"),
        Some(browser) => {
            let filter = options.browser.as_deref().filter(|name| !name.is_empty());
            steps.run("browser tests", || browser.run_tests(&workspace, &agent(&workspace)?, filter))?;
        }
    }
    steps.finish()
}

/// Builds the agent that the browser tests start. The whole workspace is selected, as in `cargo test`: features of the
/// dependencies are then the same and nothing is compiled twice.
fn agent(workspace: &Workspace) -> Result<PathBuf> {
    run_command(cargo().current_dir(&workspace.root).args(["build", "--workspace", "--bin", "semascan"]))?;
    Ok(workspace.target.join("debug").join(format!("semascan{}", std::env::consts::EXE_SUFFIX)))
}

/// The folder of real captures as an absolute path: tests run in the folders of their packages.
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
