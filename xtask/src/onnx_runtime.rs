//! ONNX Runtime, which runs the trained networks: taken from the wheel that PyPI has, because neither crates.io nor
//! Debian carries it, and put where the agent looks for it.

use crate::packages::NeedsYou;
use crate::process::{capture, run};
use crate::report::note;
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The version that networks are measured with; the agent needs 1.24 at least.
const VERSION: &str = "1.31.1";

/// Where a library is named that is to be used instead.
pub(crate) const VARIABLE: &str = "ORT_DYLIB_PATH";

/// Takes the library out of the wheel named by the first argument into the folder named by the second.
const UNPACK: &str = "
import pathlib, sys, zipfile
wheel, folder = zipfile.ZipFile(sys.argv[1]), pathlib.Path(sys.argv[2])
for name in wheel.namelist():
    file = name.rpartition('/')[2]
    if file.startswith('libonnxruntime.') or file == 'onnxruntime.dll':
        (folder / (file + '.part')).write_bytes(wheel.read(name))
        (folder / (file + '.part')).rename(folder / file)
        print(folder / file)
";

/// The library: the one that `ORT_DYLIB_PATH` names, or ours, fetched if it is not there yet.
pub(crate) fn prepare(workspace: &Workspace) -> Result<PathBuf> {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
        return Ok(named.into());
    }
    let folder = workspace.target.join("onnxruntime");
    if let Some(library) = library(&folder) {
        return Ok(library);
    }
    let why = "ONNX Runtime comes as a Python package";
    if capture(Command::new("python3").args(["-m", "pip", "--version"])).is_err() {
        let command = format!("sudo apt-get install python3-pip   # or: export {VARIABLE}=/path/to/libonnxruntime.so");
        return Err(NeedsYou::new(format!("{why}, and there is no pip"), command).into());
    }
    note(format!("{why}: fetching {VERSION}"));
    let download = folder.join("download");
    fs::create_dir_all(&download).with_context(|| download.display().to_string())?;
    let wanted = format!("onnxruntime=={VERSION}");
    run(Command::new("python3")
        .args(["-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:", "--dest"])
        .arg(&download)
        .arg(wanted))
    .with_context(|| format!("or name a library: export {VARIABLE}=/path/to/libonnxruntime.so"))?;
    let wheel = fs::read_dir(&download)?.filter_map(|entry| Some(entry.ok()?.path())).find(|path| is_wheel(path));
    let wheel = wheel.context("pip downloaded no wheel")?;
    capture(Command::new("python3").args(["-c", UNPACK]).arg(&wheel).arg(&folder))?;
    fs::remove_dir_all(&download)?;
    library(&folder).with_context(|| format!("{} holds no library of this version", wheel.display()))
}

fn is_wheel(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "whl")
}

/// The library of our version in `folder`. Windows' name carries none.
fn library(folder: &Path) -> Option<PathBuf> {
    let ours = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name == "onnxruntime.dll"
            || name.starts_with("libonnxruntime.") && name.contains(VERSION) && !name.ends_with(".part")
    };
    fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path())).find(ours)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_whole_library_of_our_version_counts() {
        let folder = std::env::temp_dir().join(format!("onnxruntime-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        for other in ["libonnxruntime.so.1.2.3", "libonnxruntime_providers_shared.so", "libonnxruntime.so.1.31.1.part"]
        {
            fs::write(folder.join(other), b"").expect("writes");
        }
        assert_eq!(library(&folder), None);
        let ours = folder.join("libonnxruntime.so.1.31.1");
        fs::write(&ours, b"").expect("writes");
        assert_eq!(library(&folder), Some(ours));
        fs::remove_dir_all(folder).expect("was there");
    }
}
