//! Python environments of our own: a virtual environment under `target/`, made anew when what is asked for changes.

use crate::packages::{self, NeedsYou};
use crate::process::{capture, exists, run};
use crate::report::note;
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Oldest Python that the pinned packages run on.
const OLDEST_PYTHON: &str = "3.11";

/// Succeeds where Python is new enough.
const NEW_ENOUGH: &str = "import sys; sys.exit(sys.version_info < (3, 11))";

/// Succeeds where virtual environments can be made (Debian has this in a package of its own).
const MAKES_ENVIRONMENTS: &str = "import venv, ensurepip";

/// What pip installs into an environment.
pub(crate) struct Environment<'a> {
    /// Folder below `target/`.
    pub(crate) name: &'a str,
    /// What the packages are for; completes "cannot go on: ..." where there is no Python.
    pub(crate) why: &'a str,
    /// The packages, as pip understands them.
    pub(crate) packages: &'a [&'a str],
    /// A file that pins the versions of these packages and of what they bring, where the list itself does not.
    pub(crate) constraints: Option<&'a Path>,
}

impl Environment<'_> {
    /// The environment's Python. The environment is made if it is not there, and made anew if packages or constraints
    /// have changed since.
    pub(crate) fn prepare(&self, workspace: &Workspace) -> Result<PathBuf> {
        let folder = workspace.target.join(self.name);
        let (python, made) = (folder.join("bin/python"), folder.join("requirements.txt"));
        let wanted = self.requirements()?;
        if fs::read_to_string(&made).is_ok_and(|made| made == wanted) {
            return Ok(python);
        }
        self.prepare_python()?;
        note(format!("making {} with {}", folder.display(), self.packages.join(", ")));
        run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
        let mut install = Command::new(&python);
        install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
        if let Some(file) = self.constraints {
            install.arg("--constraint").arg(file);
        }
        run(install.args(self.packages))?;
        // Written last: an environment that was left half made is made again.
        fs::write(made, wanted)?;
        Ok(python)
    }

    /// All that the environment depends on, as text.
    fn requirements(&self) -> Result<String> {
        let mut text = self.packages.join("\n");
        if let Some(file) = self.constraints {
            text.push_str("\n\n");
            text.push_str(&fs::read_to_string(file).with_context(|| file.display().to_string())?);
        }
        Ok(text)
    }

    /// Python from the distribution where there is none; one that is too old only a person can replace.
    fn prepare_python(&self) -> Result<()> {
        if !exists("python3") || !succeeds(MAKES_ENVIRONMENTS) {
            packages::install(self.why, &["python3", "python3-venv"])?;
        }
        if !succeeds(NEW_ENOUGH) {
            let why = format!("{}, and they need Python {OLDEST_PYTHON} or newer", self.why);
            let command = format!("# install Python {OLDEST_PYTHON} and put it first in PATH");
            return Err(NeedsYou::new(why, command).into());
        }
        Ok(())
    }
}

/// Whether the system's Python runs a line of code without an error.
fn succeeds(code: &str) -> bool {
    capture(Command::new("python3").args(["-c", code])).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_environment_depends_on_its_packages_and_on_the_file_that_pins_them() {
        let file = std::env::temp_dir().join(format!("constraints-{}.txt", std::process::id()));
        let requirements = |packages: &[&str]| {
            Environment { name: "venv", why: "a test", packages, constraints: Some(&file) }.requirements()
        };
        fs::write(&file, "numpy==1").expect("writes");
        let first = requirements(&["numpy"]).expect("reads");
        assert_ne!(first, requirements(&["numpy", "ruff"]).expect("reads"));
        fs::write(&file, "numpy==2").expect("writes");
        assert_ne!(first, requirements(&["numpy"]).expect("reads"));
        fs::remove_file(&file).expect("was there");
        assert!(requirements(&["numpy"]).is_err(), "a missing file is an error");
    }
}
