//! The training code of `agent/training`: its linter and those of its tests that a light environment can run.
//!
//! PyTorch has 5 GB on PyPI, for it carries CUDA. What needs it is skipped, and reported as such, unless
//! `SEMASCAN_TRAINING_PYTHON` names a Python with all of `agent/training/requirements.txt`.

use crate::process::{run, run_reading};
use crate::tally::{Tally, read_pytest};
use crate::venv::Environment;
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::Command;

/// Names a Python that has PyTorch.
pub(crate) const PYTHON: &str = "SEMASCAN_TRAINING_PYTHON";

/// Names a Python with the readers of others that the corpus of generated files is read by: the light environment.
pub(crate) const FOREIGN_PYTHON: &str = "SEMASCAN_FOREIGN_PYTHON";

/// What is installed; the versions are those of `requirements.txt`. Those from `pillow` on read what
/// the tests of `shared/formats` and `agent/reports` write (a corpus, our own point clouds and meshes, QIF and DFQ), and write
/// what those of `agent/sources` read (MCAP files of ROS 2 and Foxglove, bags of ROS 1 and ROS 2, RealSense's recordings).
const LIGHT: [&str; 19] = [
    "numpy",
    "onnx",
    "onnxruntime",
    "opencv-python-headless",
    "pytest",
    "ruff",
    "pillow",
    "plyfile",
    "pypcd4",
    "trimesh",
    "open3d==0.20.0",
    "lxml==6.1.3",
    "aqdefreader==1.3.0",
    // What aqdefreader guesses encodings with: later versions have another interface.
    "chardet<6",
    // What it reads dates with, without saying so.
    "python-dateutil==4.0.0",
    "mcap-ros2-support==0.6.0",
    "rosbags==0.11.9",
    "foxglove-sdk==0.30.3",
    "pyrealsense2==2.59.1.11053",
];

/// The training code and the Python that its light tests run in.
pub(crate) struct Training {
    folder: PathBuf,
    light: PathBuf,
}

impl Training {
    /// Makes the light environment if need be.
    pub(crate) fn prepare(workspace: &Workspace) -> Result<Self> {
        let folder = workspace.root.join("agent/training");
        let pins = folder.join("requirements.txt");
        let why = "the training code is tested with Python packages";
        let light = Environment { name: "training-venv", why, packages: &LIGHT, constraints: Some(&pins) };
        Ok(Self { light: light.prepare(workspace)?, folder })
    }

    /// The light environment's Python.
    pub(crate) fn python(&self) -> PathBuf {
        self.light.clone()
    }

    /// Checks the code's rules and format.
    pub(crate) fn lint(&self) -> Result<()> {
        let ruff = |arguments: &[&str]| {
            let mut ruff = Command::new(&self.light);
            run(ruff.current_dir(&self.folder).args(["-m", "ruff"]).args(arguments).arg("--no-cache"))
        };
        ruff(&["check"])?;
        ruff(&["format", "--check"])
    }

    /// Runs the fast tests, in the Python that has PyTorch if there is one.
    pub(crate) fn test(&self, tally: &mut Tally) -> Result<()> {
        let python = python_with_torch()?.unwrap_or_else(|| self.light.clone());
        let mut pytest = Command::new(python);
        pytest.current_dir(&self.folder).args(["-m", "pytest", "-p", "no:cacheprovider"]);
        run_reading(&mut pytest, |line| {
            read_pytest(line, tally);
            true
        })
    }
}

/// The Python that `SEMASCAN_TRAINING_PYTHON` names, as an absolute path: it is started in other folders. Links are not
/// followed, for a virtual environment is known by the place of its link.
pub(crate) fn python_with_torch() -> Result<Option<PathBuf>> {
    let Some(named) = std::env::var_os(PYTHON).filter(|value| !value.is_empty()).map(PathBuf::from) else {
        return Ok(None);
    };
    let python = std::path::absolute(&named).with_context(|| format!("{PYTHON} is {}", named.display()))?;
    anyhow::ensure!(python.is_file(), "{PYTHON}: there is no {}", python.display());
    Ok(Some(python))
}
