//! The peers that benchmarks are compared with, run in the same run on the same inputs.
//!
//! A bench target in a folder of its own, `benches/NAME/main.rs`, may have a `rivals.py` beside it. The bench is then
//! given a folder to leave its inputs in, and `rivals.py FOLDER NAME.json` (what the bench printed) is run afterwards;
//! it prints one JSON object with the rivals' figures, and fails if their results are not ours.

use crate::packages;
use crate::venv::Environment;
use crate::workspace::Workspace;
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What the rivals' programs need, pinned: figures are compared across machines and months.
const PINS: [&str; 7] = [
    "numpy==2.4.6",
    "scipy==1.17.1",
    "opencv-python-headless==5.0.0.93",
    "DracoPy==2.2.0",
    "open3d==0.20.0",
    "small_gicp==1.0.1",
    "onnxruntime==1.31.1",
];

/// Shared libraries that Open3D's wheel leaves to the system, and Debian's packages for them.
const LIBRARIES: [(&str, &str); 4] = [
    ("libusb-1.0.so.0", "libusb-1.0-0"),
    ("libGL.so.1", "libgl1"),
    ("libgomp.so.1", "libgomp1"),
    ("libX11.so.6", "libx11-6"),
];

/// The script of a bench target's rivals, if it has one.
pub(crate) fn script(bench_source: &Path) -> Option<PathBuf> {
    let script = bench_source.with_file_name("rivals.py");
    (bench_source.ends_with("main.rs") && script.is_file()).then_some(script)
}

/// A Python with the rivals installed.
pub(crate) fn python(workspace: &Workspace) -> Result<PathBuf> {
    let why = "the rivals are Python packages";
    let python = Environment { name: "bench-venv", why, packages: &PINS, constraints: None }.prepare(workspace)?;
    let missing: Vec<&str> =
        LIBRARIES.iter().filter(|(library, _)| !loads(&python, library)).map(|(_, package)| *package).collect();
    if !missing.is_empty() {
        packages::install("Open3D needs shared libraries", &missing)?;
    }
    Ok(python)
}

fn loads(python: &Path, library: &str) -> bool {
    let load = format!("import ctypes; ctypes.CDLL('{library}')");
    let quiet = Command::new(python).args(["-c", &load]).stderr(Stdio::null()).status();
    quiet.is_ok_and(|status| status.success())
}
