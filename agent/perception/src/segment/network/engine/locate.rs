//! Where ONNX Runtime lies.
//!
//! In this order: where the configuration says, the environment variable `ORT_DYLIB_PATH`, beside the executable (and in
//! `onnxruntime` there), `target/onnxruntime` (where `cargo xtask` puts it), the user's data folder (`semascan/onnxruntime` in
//! it), the package `onnxruntime` in Python's site-packages (the environment that is active, the one that the executable is
//! installed in, the user's own), the system's folders. The first two name a file and bind: if it does not load, that is an
//! error and nothing else is tried.

use crate::segment::network::places::Places;
use std::path::{Path, PathBuf};

/// Names the library's file.
const VARIABLE: &str = "ORT_DYLIB_PATH";

/// Folders of the system that package managers and vendors put it into.
const SYSTEM: [&str; 6] = [
    "/usr/local/lib",
    "/usr/lib",
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/opt/onnxruntime/lib",
    "/opt/homebrew/lib",
];

/// A library that may be ONNX Runtime.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// The file.
    pub path: PathBuf,
    /// What named it.
    pub from: &'static str,
    /// Whether a person named it: it is then the only one.
    pub binding: bool,
}

/// The libraries to try, best first, and the places that were looked in.
pub fn candidates(configured: Option<&Path>) -> (Vec<Found>, Vec<PathBuf>) {
    let variable = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
    let executable = std::env::current_exe().ok();
    search(configured, variable.as_deref(), executable.as_deref(), &Places::of_environment())
}

fn search(
    configured: Option<&Path>,
    variable: Option<&Path>,
    executable: Option<&Path>,
    places: &Places,
) -> (Vec<Found>, Vec<PathBuf>) {
    for (path, from) in [(configured, "the configuration"), (variable, VARIABLE)] {
        if let Some(path) = path {
            return (vec![Found { path: path.into(), from, binding: true }], vec![path.into()]);
        }
    }
    let mut folders = Vec::new();
    if let Some(beside) = executable.and_then(Path::parent) {
        folders.push((beside.to_owned(), "the executable's folder"));
        folders.push((beside.join("onnxruntime"), "the executable's folder"));
        // target/debug/semascan and target/debug/deps/test both lie below target.
        // No other folder above the executable is looked into: it need not be the user's own.
        let target = beside.ancestors().take(3).skip(1).filter(|above| is_target(above));
        folders.extend(target.map(|target| (target.join("onnxruntime"), "cargo's target folder")));
    }
    folders.extend(places.data.iter().map(|data| (data.join("onnxruntime"), "the user's data folder")));
    let packages = places.site_packages(executable).into_iter().map(|site| site.join("onnxruntime/capi"));
    folders.extend(packages.map(|package| (package, "Python's site-packages")));
    folders.extend(SYSTEM.map(|f| (PathBuf::from(f), "the system")));
    let found = folders
        .iter()
        .flat_map(|(folder, from)| in_folder(folder).map(|path| Found { path, from, binding: false }))
        .collect();
    (found, folders.into_iter().map(|(folder, _)| folder).collect())
}

/// Whether cargo builds into `folder`: by its usual name, or by the mark that cargo leaves in it.
fn is_target(folder: &Path) -> bool {
    folder.file_name().is_some_and(|name| name == "target") || folder.join("CACHEDIR.TAG").is_file()
}

/// The library in `folder`: the one with the highest version where there are several.
fn in_folder(folder: &Path) -> Option<PathBuf> {
    let files = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    files
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let rest = name.strip_prefix("libonnxruntime.").unwrap_or_default();
            name == "onnxruntime.dll" || rest.starts_with("so") || rest.ends_with("dylib")
        })
        .max_by_key(|path| version(path))
}

/// The numbers in a file's name, to be compared.
fn version(path: &Path) -> Vec<u64> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    name.split(|c: char| !c.is_ascii_digit()).filter_map(|digits| digits.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch(folder: &Path, name: &str) -> PathBuf {
        std::fs::create_dir_all(folder).expect("a folder");
        std::fs::write(folder.join(name), b"").expect("a file");
        folder.join(name)
    }

    #[test]
    fn what_a_person_names_is_the_only_one() {
        let (a, b) = (Path::new("/a.so"), Path::new("/b.so"));
        let names = |found: Vec<Found>| found.into_iter().map(|f| (f.path, f.binding)).collect::<Vec<_>>();
        assert_eq!(names(search(Some(a), Some(b), None, &Places::default()).0), [(a.into(), true)]);
        assert_eq!(names(search(None, Some(b), None, &Places::default()).0), [(b.into(), true)]);
    }

    #[test]
    fn cargo_s_target_folder_is_found_from_binaries_and_tests() {
        let root = tempfile::tempdir().expect("a folder");
        let library = touch(&root.path().join("target/onnxruntime"), "libonnxruntime.so.1.31.1");
        for executable in ["target/debug/semascan", "target/debug/deps/test-1"] {
            let (found, looked_in) = search(None, None, Some(&root.path().join(executable)), &Places::default());
            assert_eq!(found.first().map(|f| (&f.path, f.binding)), Some((&library, false)), "{executable}");
            assert!(looked_in.len() > 6);
        }
        // What lies above an installed program is somebody else's.
        touch(&root.path().join("onnxruntime"), "libonnxruntime.so");
        let installed = root.path().join("bin/semascan");
        let (found, looked_in) = search(None, None, Some(&installed), &Places::default());
        assert!(!looked_in.contains(&root.path().join("onnxruntime")), "{looked_in:?}");
        assert!(found.iter().all(|f| !f.path.starts_with(root.path())), "{found:?}");
        let beside = touch(&root.path().join("target/debug"), "libonnxruntime.so");
        let (found, _) = search(None, None, Some(&root.path().join("target/debug/semascan")), &Places::default());
        assert_eq!(found.first().map(|f| &f.path), Some(&beside));
    }

    #[test]
    fn the_library_of_a_python_package_and_of_the_data_folder_is_found() {
        let root = tempfile::tempdir().expect("a folder");
        let environment = root.path().join("venv");
        let package = environment.join("lib/python3.12/site-packages/onnxruntime/capi");
        let library = touch(&package, "libonnxruntime.so.1.31.1");
        // Where the environment is active, and where the program is installed in it.
        let active = Places { python: vec![environment.clone()], ..Places::default() };
        for (places, executable) in
            [(active.clone(), None), (Places::default(), Some(environment.join("bin/semascan")))]
        {
            let (found, _) = search(None, None, executable.as_deref(), &places);
            assert_eq!(found.first().map(|f| (&f.path, f.from)), Some((&library, "Python's site-packages")));
        }
        let data = root.path().join("data/semascan");
        let own = touch(&data.join("onnxruntime"), "libonnxruntime.so.1.20.0");
        let (found, _) = search(None, None, None, &Places { data: Some(data), ..active });
        assert_eq!(found.iter().take(2).map(|f| &f.path).collect::<Vec<_>>(), [&own, &library]);
    }

    #[test]
    fn the_newest_library_of_a_folder_counts_and_helpers_do_not() {
        let root = tempfile::tempdir().expect("a folder");
        touch(root.path(), "libonnxruntime_providers_shared.so");
        assert_eq!(in_folder(root.path()), None);
        touch(root.path(), "libonnxruntime.so.1.9.0");
        let newest = touch(root.path(), "libonnxruntime.so.1.31.1");
        assert_eq!(in_folder(root.path()), Some(newest));
    }
}
