//! `cargo xtask bench teach`: what a network learns from motors that were inspected in a world unknown to it and whose labels
//! were corrected on their models.
//!
//! The product's own commands do all of it: inspections with the shipped networks, corrections by a simulated person, masks in
//! every view, training (`agent/training`), and the comparison on other motors of the same world.

use crate::onnx_runtime;
use crate::process::run as run_command;
use crate::report::note;
use crate::training::{PYTHON, python_with_torch};
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The benchmark's name.
pub(crate) const NAME: &str = "teach";

/// Motors that are corrected, and the first one's seed: others than the comparison's, and than those that networks were made with.
const MOTORS: &str = "5";
const FIRST_MOTOR: &str = "2001";
/// Views of each.
const VIEWS: &str = "24";
/// Voxels of their models, millimetres: fine, because masks are no sharper.
const VOXEL: &str = "0.6";
/// What is trained, and where it begins.
const RECIPE: &str = "recipes/ud-net-edge-taught.toml";
const START: &str = "agent/models/ud-net-edge";

/// Makes the data set and trains the network in `folder`; gives the command that compares it with the one before. `None`, which
/// is said, without PyTorch. A data set or network that is there already is made anew.
pub(crate) fn run(
    workspace: &Workspace,
    folder: &Path,
    agent: &dyn Fn() -> Result<PathBuf>,
) -> Result<Option<Command>> {
    let Some(python) = python_with_torch()? else {
        note(format!("{PYTHON} names no Python with PyTorch: nothing is trained"));
        return Ok(None);
    };
    let semascan = agent()?;
    let library = onnx_runtime::prepare(workspace)?;
    let models = workspace.root.join("agent/models");
    let command = || {
        let mut command = Command::new(&semascan);
        command.env(onnx_runtime::VARIABLE, &library).env("SEMASCAN_MODELS", &models);
        command
    };
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let [masks, trained, model] = ["masks", "run", "model"].map(|name| folder.join(name));
    let set =
        ["--domain", "shifted", "--seeds", MOTORS, "--first-seed", FIRST_MOTOR, "--views", VIEWS, "--voxel", VOXEL];
    run_command(command().args(["tables", "labels"]).args(set).arg("--masks").arg(&masks))?;
    let mut train = Command::new(python);
    train.current_dir(workspace.root.join("agent/training"));
    train.args(["-m", "semascan_training", "train", RECIPE, "--data"]).arg(&masks).arg("--out").arg(&trained);
    run_command(train.arg("--start").arg(workspace.root.join(START)).arg("--model").arg(&model))?;
    let mut compare = command();
    compare.args(["tables", "teach", "--json", "--before"]).arg(workspace.root.join(START)).arg("--after").arg(&model);
    Ok(Some(compare))
}
