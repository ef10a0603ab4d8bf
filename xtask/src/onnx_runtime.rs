//! ONNX Runtime, which runs the trained networks: taken from the wheel that PyPI has, because neither crates.io nor
//! Debian carries it, and put where the agent looks for it.

use crate::wheel::Wheel;
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// The version that networks are measured with; the agent needs 1.24 at least.
const VERSION: &str = "1.31.1";

/// Where a library is named that is to be used instead.
pub(crate) const VARIABLE: &str = "ORT_DYLIB_PATH";

/// The package that has it. Which Python it is for does not matter: the library is the same in all.
const WHEEL: Wheel = Wheel {
    name: "onnxruntime",
    version: VERSION,
    why: "ONNX Runtime comes",
    python: Some("3.12"),
    // Linux on x86-64 and AArch64, macOS on AArch64, Windows on x86-64.
    sha256: &[
        "1f3dea47f2f0e5117c2404cea7d21fd253ae7836a3bf167a501cdfbb2600d536",
        "0b9a492176886992e0e875f06bc0367e333f5fff11711a2d642e18b02f3009cc",
        "96dd2564b10ea7153ad9c207e7cd8e5917cb3ba521e0e0a62ac03486fdc8d56c",
        "ae8a9a351efda685cc59a66226cdefaa37a126c1d66872ca23a2de9425326130",
    ],
    or: "export ORT_DYLIB_PATH=/path/to/libonnxruntime.so",
};

/// The library: the one that `ORT_DYLIB_PATH` names, or ours, fetched if it is not there yet.
pub(crate) fn prepare(workspace: &Workspace) -> Result<PathBuf> {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
        return Ok(named.into());
    }
    let folder = workspace.target.join("onnxruntime");
    if let Some(library) = library(&folder) {
        return Ok(library);
    }
    WHEEL.unpack(r"libonnxruntime\..*|onnxruntime\.dll", &folder)?;
    library(&folder).with_context(|| format!("{} {VERSION} holds no library of this version", WHEEL.name))
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
