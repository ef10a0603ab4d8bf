//! What a folder holds: files that an inspection or its exports wrote, files of others, and leftovers of writers that were
//! killed.
//!
//! A file is ours if it has the name of one of ours and says in its first bytes that Semascan wrote it. Everything else
//! belongs to somebody else and is never removed.

use crate::StoreError;
use crate::generation::glb_asset;
use semascan_formats::regular_file;
use semascan_model::record::InspectionRecord;
use std::fs;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

/// Name of the record. It comes last and goes first: without it the other files are of no inspection.
pub(crate) const RECORD: &str = "inspection.json";
/// The model's points, its surface, and its surface as a scene.
pub(crate) const CLOUD: &str = "cloud.ply";
pub(crate) const MESH: &str = "mesh.ply";
pub(crate) const SCENE: &str = "scene.glb";
/// The true surface, where the source knows it.
pub(crate) const TRUTH: &str = "truth.ply";
/// The report for people.
pub(crate) const REPORT: &str = "report.html";
/// The other files of an inspection.
pub(crate) const MODEL_FILES: [&str; 5] = [CLOUD, MESH, REPORT, SCENE, TRUTH];
/// Folder of the clouds of single views.
pub(crate) const VIEWS: &str = "views";
/// What `export` adds, beside `mesh-COMPONENT.stl`, and what `report` adds.
const EXPORTS: [&str; 8] =
    ["mesh.obj", "mesh.mtl", "mesh.png", "mesh.glb", "findings.csv", "components.csv", "report.dfq", "report.qif"];
/// Bytes of a file in which it says what wrote it.
const HEAD: u64 = 64 << 10;

/// The entries of a folder, by who wrote them.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    /// Files of an inspection and exports of one.
    pub(crate) ours: Vec<PathBuf>,
    /// Names that begin with a dot, which nobody means by the contents of a folder.
    pub(crate) hidden: Vec<PathBuf>,
    /// Everything else: names below the folder.
    pub(crate) foreign: Vec<PathBuf>,
}

impl Contents {
    /// Looks at `folder`; one that is not there holds nothing.
    ///
    /// # Errors
    /// [`StoreError`] naming what cannot be read, or that the folder is none.
    pub(crate) fn of(folder: &Path) -> Result<Self, StoreError> {
        Self::told_apart(folder, &|path, name| is_ours(path, name))
    }

    /// Looks at a temporary folder of ours, in which half files that do not say anything yet are ours by their names.
    ///
    /// # Errors
    /// As [`Contents::of`].
    pub(crate) fn of_temporary(folder: &Path) -> Result<Self, StoreError> {
        let by_name = |name: &str| name == RECORD || MODEL_FILES.contains(&name) || is_view_cloud(name);
        Self::told_apart(folder, &|path, name| (by_name(name) && is_file(path)) || is_ours(path, name))
    }

    fn told_apart(folder: &Path, is_ours: &dyn Fn(&Path, &str) -> bool) -> Result<Self, StoreError> {
        let mut contents = Self::default();
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(contents),
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
                return Err(StoreError::NoFolder { path: folder.to_owned() });
            }
            Err(error) => return Err(StoreError::io(folder)(error)),
        };
        for entry in entries {
            let path = entry.map_err(StoreError::io(folder))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.starts_with('.') {
                contents.hidden.push(name.into());
            } else if name == VIEWS && is_folder(&path) {
                contents.add_views(&path, is_ours)?;
            } else if is_ours(&path, &name) {
                contents.ours.push(name.into());
            } else {
                contents.foreign.push(name.into());
            }
        }
        Ok(contents)
    }

    fn add_views(&mut self, folder: &Path, is_ours: &dyn Fn(&Path, &str) -> bool) -> Result<(), StoreError> {
        for entry in fs::read_dir(folder).map_err(StoreError::io(folder))? {
            let path = entry.map_err(StoreError::io(folder))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let below = Path::new(VIEWS).join(&name);
            let list = if is_view_cloud(&name) && is_ours(&path, &name) { &mut self.ours } else { &mut self.foreign };
            list.push(below);
        }
        Ok(())
    }

    /// The first thing in the folder that a person would see there; `None` if it is empty.
    pub(crate) fn first(&self) -> Option<String> {
        self.ours.iter().chain(&self.foreign).map(|path| path.display().to_string()).min()
    }
}

/// Removes `files` from `folder`, the record first, and the folder `views` if it is then empty.
///
/// # Errors
/// [`StoreError`] naming the file.
pub(crate) fn remove(folder: &Path, mut files: Vec<PathBuf>) -> Result<(), StoreError> {
    files.sort_by_key(|path| path != Path::new(RECORD));
    for path in files.iter().map(|name| folder.join(name)) {
        fs::remove_file(&path).map_err(StoreError::io(&path))?;
    }
    // Fails where somebody else's file lies in it, and then it stays.
    let _ = fs::remove_dir(folder.join(VIEWS));
    Ok(())
}

/// Whether `name` is that of the cloud of a view, `000012.ply`.
pub(crate) fn is_view_cloud(name: &str) -> bool {
    let number = name.strip_suffix(".ply").or_else(|| name.strip_suffix(".ply.part"));
    number.is_some_and(|n| n.len() >= 6 && n.bytes().all(|b| b.is_ascii_digit()))
}

/// A folder itself and no link to one.
fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|m| m.is_dir())
}

/// A file itself and no link to one.
fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|m| m.is_file())
}

fn is_ours(path: &Path, name: &str) -> bool {
    if !is_file(path) {
        return false;
    }
    // Half files that earlier versions left when they were killed.
    if let Some(name) = name.strip_suffix(".part") {
        return name == RECORD || MODEL_FILES.contains(&name) || EXPORTS.contains(&name) || is_view_cloud(name);
    }
    let is_export = EXPORTS.contains(&name) || (name.starts_with("mesh-") && name.ends_with(".stl"));
    if name == RECORD {
        let text = regular_file::read_to_string(path).unwrap_or_default();
        return InspectionRecord::from_json(&text).is_ok();
    }
    (MODEL_FILES.contains(&name) || is_export || is_view_cloud(name)) && says_semascan(path)
}

/// Whether a file says in its first bytes that Semascan wrote it.
fn says_semascan(path: &Path) -> bool {
    if path.extension().is_some_and(|extension| extension == "glb") {
        let asset = regular_file::open(path).and_then(|file| glb_asset(&mut BufReader::new(file)));
        return asset.is_ok_and(|asset| asset["generator"].as_str().is_some_and(|by| by.contains("semascan")));
    }
    let mut head = Vec::new();
    let read = regular_file::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    // Clouds of single views named no program in earlier versions; a table has a head and nothing besides.
    let marks: [&[u8]; 3] = [b"semascan", b"comment frame table, metres", b"inspection,part,"];
    read.is_ok() && marks.iter().any(|mark| head.windows(mark.len()).any(|bytes| bytes == *mark))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_others_wrote_is_told_apart_by_name_and_by_content() {
        let root = tempfile::tempdir().expect("a folder");
        fs::create_dir(root.path().join(VIEWS)).expect("made");
        for (name, text) in [
            ("cloud.ply", "ply\ncomment generator semascan 1\nend_header\n"),
            ("mesh.ply", "ply\ncomment made by hand\nend_header\n"),
            ("mesh-gear.stl", "semascan: gear"),
            ("findings.csv", "inspection,part,number\r\n"),
            ("components.csv", "name,area\n"),
            ("report.html", "<head><meta name=\"generator\" content=\"semascan 1\">"),
            ("mesh-mine.stl", "solid mine"),
            ("inspection.json", "{}"),
            ("truth.ply.part", ""),
            ("notes.txt", "semascan"),
            (".keep", ""),
            ("views/000001.ply", "ply\ncomment frame table, metres\n"),
            ("views/notes.txt", ""),
        ] {
            fs::write(root.path().join(name), text).expect("written");
        }
        let contents = Contents::of(root.path()).expect("readable");
        let sorted = |list: &[PathBuf]| {
            let mut names: Vec<String> = list.iter().map(|p| p.display().to_string()).collect();
            names.sort();
            names.join(" ")
        };
        assert_eq!(
            sorted(&contents.ours),
            "cloud.ply findings.csv mesh-gear.stl report.html truth.ply.part views/000001.ply"
        );
        assert_eq!(
            sorted(&contents.foreign),
            "components.csv inspection.json mesh-mine.stl mesh.ply notes.txt views/notes.txt"
        );
        assert_eq!(sorted(&contents.hidden), ".keep");
        let temporary = Contents::of_temporary(root.path()).expect("readable");
        assert_eq!(
            sorted(&temporary.foreign),
            "components.csv mesh-mine.stl notes.txt views/notes.txt",
            "half files are ours there"
        );
        remove(root.path(), contents.ours).expect("removed");
        let left = Contents::of(root.path()).expect("readable");
        assert!(left.ours.is_empty() && left.foreign.len() == 6 && left.hidden.len() == 1, "{left:?}");
    }
}
