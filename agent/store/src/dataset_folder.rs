//! The folder that a data set is written into: made aside and put under its name when it is whole.
//!
//! A folder that holds something is refused, unless it is to be replaced and is a data set of ours: then the new one takes its
//! place in one step, and the old one is removed after that. Of a writer that is killed there stays at most the temporary
//! folder `.NAME.semascan-UUID`, which the next writer removes.

use crate::StoreError;
use crate::lock::{FolderLock, beside};
use crate::result_folder::exchange;
use crate::write::{sync_folder, temporaries};
use semascan_formats::regular_file;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The file by which a data set is known.
pub const MANIFEST: &str = "manifest.json";
/// What its field `kind` says.
pub const DATASET_KIND: &str = "semascan dataset";

/// A data set while it is written; dropped before it is published it is removed.
#[derive(Debug)]
pub struct DatasetFolder {
    target: PathBuf,
    draft: PathBuf,
    /// Whether the target was made for this and is empty.
    is_made: bool,
    _lock: FolderLock,
}

impl DatasetFolder {
    /// Begins a data set that will stand under the name `folder`.
    ///
    /// # Errors
    /// [`StoreError`] naming the folder: it is none, holds something, or somebody else writes into it.
    pub fn begin(folder: &Path, overwrite: bool) -> Result<Self, StoreError> {
        refuse(folder, overwrite)?;
        let is_made = !folder.exists();
        fs::create_dir_all(folder).map_err(StoreError::io(folder))?;
        let target = folder.canonicalize().map_err(StoreError::io(folder))?;
        let lock = FolderLock::acquire(&target)?;
        // Under the lock once more: somebody may have written in between.
        refuse(&target, overwrite)?;
        remove_leftovers(&target)?;
        let draft = beside(&target, &uuid::Uuid::now_v7().to_string())
            .ok_or_else(|| StoreError::io(folder)(io::Error::from(io::ErrorKind::InvalidFilename)))?;
        fs::create_dir(&draft).map_err(StoreError::io(&draft))?;
        Ok(Self { target, draft, is_made, _lock: lock })
    }

    /// The folder to write into.
    pub fn draft(&self) -> &Path {
        &self.draft
    }

    /// Puts the data set under its name.
    ///
    /// # Errors
    /// [`StoreError`] naming the folder; what stood there before then stays.
    pub fn publish(mut self) -> Result<(), StoreError> {
        sync_folder(&self.draft)?;
        let is_empty = fs::read_dir(&self.target).map_err(StoreError::io(&self.target))?.next().is_none();
        if is_empty {
            // A folder is renamed onto an empty one in one step.
            fs::rename(&self.draft, &self.target).map_err(StoreError::io(&self.target))?;
        } else if !exchange(&self.draft, &self.target) {
            let old = beside(&self.target, &uuid::Uuid::now_v7().to_string())
                .ok_or_else(|| StoreError::io(&self.target)(io::Error::from(io::ErrorKind::InvalidFilename)))?;
            fs::rename(&self.target, &old).map_err(StoreError::io(&self.target))?;
            fs::rename(&self.draft, &self.target).map_err(StoreError::io(&self.target))?;
            self.draft = old;
        }
        self.is_made = false;
        sync_folder(self.target.parent().unwrap_or(Path::new("/")))
    }
}

impl Drop for DatasetFolder {
    fn drop(&mut self) {
        // The draft, or the data set that it replaced; nothing where it was renamed.
        let _ = fs::remove_dir_all(&self.draft);
        if self.is_made {
            // Fails where somebody else put something there, and then it stays.
            let _ = fs::remove_dir(&self.target);
        }
    }
}

/// Removes the drafts that killed writers left; the lock is held.
fn remove_leftovers(target: &Path) -> Result<(), StoreError> {
    let (Some(parent), Some(name)) = (target.parent(), target.file_name()) else { return Ok(()) };
    for leftover in temporaries(parent, Some(&name.to_string_lossy()))? {
        if leftover.is_dir() {
            fs::remove_dir_all(&leftover).map_err(StoreError::io(&leftover))?;
        }
    }
    Ok(())
}

/// Refuses a folder that holds anything while `overwrite` is not given, and what is no data set of ours.
fn refuse(folder: &Path, overwrite: bool) -> Result<(), StoreError> {
    if !folder.exists() {
        return Ok(());
    }
    if !folder.is_dir() {
        return Err(StoreError::NoFolder { path: folder.to_owned() });
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(StoreError::io(folder))? {
        names.push(entry.map_err(StoreError::io(folder))?.file_name().to_string_lossy().into_owned());
    }
    let Some(found) = names.into_iter().min() else { return Ok(()) };
    let path = folder.to_owned();
    if !overwrite {
        return Err(StoreError::NotEmpty { path, found });
    }
    let manifest = regular_file::read_to_string(&folder.join(MANIFEST)).unwrap_or_default();
    let kind = serde_json::from_str::<serde_json::Value>(&manifest).ok();
    let is_ours = kind.is_some_and(|manifest| manifest["kind"] == DATASET_KIND);
    if is_ours { Ok(()) } else { Err(StoreError::ForeignData { path, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(folder: &Path, overwrite: bool, text: &str) -> Result<(), StoreError> {
        let begun = DatasetFolder::begin(folder, overwrite)?;
        fs::write(begun.draft().join(MANIFEST), format!("{{\"kind\": \"{DATASET_KIND}\"}}")).expect("written");
        fs::write(begun.draft().join("a.txt"), text).expect("written");
        begun.publish()
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").file_name());
        let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
        names.retain(|name| !name.ends_with("lock"));
        names.sort();
        names
    }

    #[test]
    fn a_set_is_there_as_a_whole_and_replaced_only_where_that_is_asked_for() {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("set");
        write(&folder, false, "one").expect("written");
        assert_eq!(names(&folder), ["a.txt", MANIFEST]);
        let refused = write(&folder, false, "two").expect_err("not empty").to_string();
        assert!(refused.contains("a.txt") && refused.contains("--overwrite"), "{refused}");
        assert_eq!(fs::read_to_string(folder.join("a.txt")).expect("there"), "one");
        write(&folder, true, "two").expect("replaced");
        assert_eq!(fs::read_to_string(folder.join("a.txt")).expect("there"), "two");
        drop(DatasetFolder::begin(&folder, true).expect("begun"));
        assert_eq!(fs::read_to_string(folder.join("a.txt")).expect("there"), "two", "not published");
        let killed = beside(&folder, &uuid::Uuid::now_v7().to_string()).expect("a name");
        fs::create_dir_all(killed.join("half")).expect("made");
        write(&folder, true, "three").expect("replaced");
        drop(DatasetFolder::begin(&root.path().join("other"), false).expect("begun"));
        assert_eq!(names(root.path()), ["set"], "nothing is left");
    }

    #[test]
    fn what_is_no_data_set_is_never_replaced() {
        let root = tempfile::tempdir().expect("a folder");
        fs::write(root.path().join("thesis.txt"), "all of it").expect("written");
        let refused = write(root.path(), true, "one").expect_err("foreign").to_string();
        assert!(refused.contains("thesis.txt"), "{refused}");
        assert!(write(&root.path().join("thesis.txt"), true, "one").is_err());
        assert_eq!(fs::read_to_string(root.path().join("thesis.txt")).expect("there"), "all of it");
    }
}
