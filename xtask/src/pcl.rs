//! PCL as a rival: a C++ program of ours beside a bench, compiled against Debian's libpcl-dev.

use crate::packages;
use crate::process::{exists, run};
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Libraries that a program may use; the linker leaves out what it does not.
const LIBRARIES: [&str; 6] =
    ["pcl_segmentation", "pcl_registration", "pcl_search", "pcl_kdtree", "pcl_octree", "pcl_common"];

/// The program `pcl_*.cpp` beside the bench target `source`, compiled; `None` if there is none.
pub(crate) fn program(workspace: &Workspace, source: &Path) -> Result<Option<PathBuf>> {
    let Some(code) = source.parent().and_then(beside) else { return Ok(None) };
    if !exists("g++") || headers().is_none() {
        packages::install("PCL is measured beside ours", &["g++", "libpcl-dev"])?;
    }
    let headers = headers().context("libpcl-dev is installed, but /usr/include has no pcl-* folder")?;
    let built = workspace.target.join("bench").join(code.file_stem().unwrap_or_default());
    let libraries = LIBRARIES.map(|l| format!("-l{l}"));
    // As Debian builds PCL itself: no instructions beyond the baseline, or Eigen's alignments would differ.
    run(Command::new("g++")
        .args(["-O3", "-DNDEBUG", "-std=c++17", "-w", "-I"])
        .arg(headers)
        .args(["-I", "/usr/include/eigen3"])
        .arg(&code)
        .arg("-o")
        .arg(&built)
        .arg("-Wl,--as-needed")
        .args(libraries))?;
    Ok(Some(built))
}

/// The first `pcl_*.cpp` of a folder.
fn beside(folder: &Path) -> Option<PathBuf> {
    let is_program = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("pcl_") && name.ends_with(".cpp")
    };
    fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path())).filter(is_program).min()
}

/// Where Debian puts PCL's headers.
fn headers() -> Option<PathBuf> {
    let is_pcl = |path: &PathBuf| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("pcl-"));
    fs::read_dir("/usr/include").ok()?.filter_map(|entry| Some(entry.ok()?.path())).find(is_pcl)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_beside_a_bench_is_found() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let found = beside(&root.join("agent/perception/benches/geometric_segmentation")).expect("there is one");
        assert!(found.ends_with("pcl_segmentation.cpp"), "{}", found.display());
        assert!(beside(&root.join("agent/perception/benches")).is_none());
    }
}
