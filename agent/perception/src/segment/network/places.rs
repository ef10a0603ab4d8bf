//! The folders of a user's installation in which models and ONNX Runtime are looked for.
//!
//! No Python is started to ask for its folders: those of the environments that are named here are known by their layout,
//! `lib/python3.X/site-packages` (POSIX) or `Lib/site-packages` (Windows).

use etcetera::base_strategy::{BaseStrategy, choose_native_strategy};
use std::path::{Path, PathBuf};

/// Folders of the user and of the user's Python.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Places {
    /// Our folder in the user's data folder: `~/.local/share/semascan` on Linux.
    pub(crate) data: Option<PathBuf>,
    /// Prefixes of Python installations, best first.
    pub(crate) python: Vec<PathBuf>,
}

impl Places {
    /// As the environment says: the data folder of the system's convention; the environment that is active (`VIRTUAL_ENV`,
    /// `CONDA_PREFIX`), then the user's own packages (`~/.local`).
    pub(crate) fn of_environment() -> Self {
        let user = choose_native_strategy().ok();
        let active = ["VIRTUAL_ENV", "CONDA_PREFIX"].into_iter().filter_map(std::env::var_os);
        let mut python: Vec<PathBuf> = active.filter(|v| !v.is_empty()).map(PathBuf::from).collect();
        python.extend(user.iter().map(|user| user.home_dir().join(".local")));
        Self { data: user.map(|user| user.data_dir().join("semascan")), python }
    }

    /// The folders of Python packages, those of the newest Python first: of the prefix that `executable` is installed in
    /// (`PREFIX/bin/semascan`), then of the others.
    pub(crate) fn site_packages(&self, executable: Option<&Path>) -> Vec<PathBuf> {
        let own = executable.and_then(|executable| executable.parent()?.parent());
        let others = self.python.iter().map(PathBuf::as_path).filter(|prefix| Some(*prefix) != own);
        own.into_iter().chain(others).flat_map(of_prefix).collect()
    }
}

fn of_prefix(prefix: &Path) -> Vec<PathBuf> {
    let mut versions: Vec<(u32, PathBuf)> = std::fs::read_dir(prefix.join("lib"))
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            let folder = entry.ok()?.path();
            let minor = folder.file_name()?.to_str()?.strip_prefix("python3.")?.parse().ok()?;
            Some((minor, folder.join("site-packages")))
        })
        .collect();
    versions.sort_by_key(|(minor, _)| std::cmp::Reverse(*minor));
    let windows = prefix.join("Lib/site-packages");
    versions.into_iter().map(|(_, folder)| folder).chain([windows]).filter(|folder| folder.is_dir()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_of_the_newest_python_come_first_and_of_the_executable_s_before_others() {
        let root = tempfile::tempdir().expect("a folder");
        let site = |prefix: &str, lib: &str| {
            let folder = root.path().join(prefix).join(lib).join("site-packages");
            std::fs::create_dir_all(&folder).expect("a folder");
            folder
        };
        let old = site("own", "lib/python3.9");
        let new = site("own", "lib/python3.11");
        let active = site("active", "lib/python3.10");
        let windows = site("windows", "Lib");
        let missing = root.path().join("missing");
        let prefixes = ["active", "windows"].map(|prefix| root.path().join(prefix));
        let places = Places { python: [prefixes.as_slice(), &[missing]].concat(), data: None };
        let executable = root.path().join("own/bin/semascan");
        assert_eq!(places.site_packages(Some(&executable)), [new, old, active.clone(), windows.clone()]);
        assert_eq!(places.site_packages(None), [active, windows]);
    }

    #[test]
    fn the_user_s_folders_end_in_our_name() {
        if let Some(data) = Places::of_environment().data {
            assert!(data.is_absolute() && data.ends_with("semascan"), "{}", data.display());
        }
    }
}
