//! The folder that an inspection is written into. What stands under its name is at every moment one whole set of files.
//!
//! A set is written into a temporary folder beside the target, brought to the disk, and put under the name in one step:
//! renamed where nothing is there, exchanged (`renameat2` with `RENAME_EXCHANGE`) where an earlier set is. Of a writer that is
//! killed there stays at most the temporary folder, `.NAME.semascan-UUID`, which the next writer removes.
//!
//! Where folders cannot be exchanged (a mount point, the working directory, other systems), the files are exchanged one by
//! one, the record first out and last in: a folder without a record holds no inspection.
//!
//! An inspection that is begun in an empty folder has a record there at once, which says that it runs. An earlier model stays
//! until the new one is whole: an inspection that fails does not take it away.

use crate::StoreError;
use crate::contents::{Contents, RECORD, VIEWS, remove};
use crate::inspection_set::{self, Additions};
use crate::lock::{FolderLock, beside};
use crate::write::{remove_temporary_files, sync_folder, temporaries, write_new};
use semascan_formats::regular_file;
use semascan_inspection::Inspected;
use semascan_model::record::{FilesRecord, InspectionRecord};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// The folder of an inspection that runs. Its lock is held until this is dropped.
#[derive(Debug)]
pub struct ResultFolder {
    folder: PathBuf,
    /// Where the files under the name may be replaced one by one only.
    in_place: bool,
    /// Whether the folder holds the model of an earlier inspection.
    earlier: Mutex<bool>,
    /// Whether the folder was made for this inspection and holds nothing yet.
    made_empty: AtomicBool,
    _lock: FolderLock,
}

/// What became of a record without a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// It stands in the folder.
    Record,
    /// The folder holds the model of an earlier inspection, as before.
    EarlierModel,
}

impl ResultFolder {
    /// Opens the folder, which is made if need be, and begins it: afterwards it holds `record`, or still the model of an earlier
    /// inspection where `overwrite` allows that it is replaced later.
    ///
    /// # Errors
    /// [`StoreError`] naming the folder or file.
    pub fn begin(folder: &Path, record: &InspectionRecord, overwrite: bool) -> Result<Self, StoreError> {
        let begun = Self::open(folder, overwrite)?;
        begun.publish_record(record)?;
        Ok(begun)
    }

    /// Opens the folder, which is made if need be, and removed again if nothing is published. Everything that would keep a
    /// result from being written is noticed here: a folder that is none, that cannot be written, that holds files of others,
    /// or an inspection while `overwrite` is not given, or that another process writes into.
    ///
    /// # Errors
    /// [`StoreError`] naming the folder or file.
    pub fn open(folder: &Path, overwrite: bool) -> Result<Self, StoreError> {
        // Looked at before anything is made or locked: a call that is refused leaves no trace.
        refuse_contents(folder, overwrite)?;
        let made = !folder.exists();
        fs::create_dir_all(folder).map_err(StoreError::io(folder))?;
        let given = folder;
        let folder = folder.canonicalize().map_err(StoreError::io(folder))?;
        let lock = FolderLock::acquire(&folder)?;
        // Under the lock once more: somebody may have written in between.
        refuse_contents(&folder, overwrite).map_err(|error| named_as(given, error))?;
        remove_leftovers(&folder)?;
        let is_working_directory = std::env::current_dir().is_ok_and(|current| current == folder);
        let can_stage_beside = beside(&folder, "lock").is_some_and(|lock| lock.exists());
        let opened = Self {
            in_place: is_working_directory || !can_stage_beside,
            earlier: Mutex::new(holds_model(&folder)),
            made_empty: AtomicBool::new(made),
            folder,
            _lock: lock,
        };
        // That files can be put there is tried now.
        drop(opened.stage()?);
        Ok(opened)
    }

    /// The folder, absolute.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Puts a record without a model into the folder, unless the model of an earlier inspection stands there.
    ///
    /// # Errors
    /// [`StoreError`] naming the file; what stood there before then stays.
    pub fn publish_record(&self, record: &InspectionRecord) -> Result<Kept, StoreError> {
        if *self.earlier.lock().unwrap_or_else(PoisonError::into_inner) {
            return Ok(Kept::EarlierModel);
        }
        let staged = self.stage()?;
        staged.finish(record, &self.folder, Vec::new())?;
        let earlier = self.earlier.lock().unwrap_or_else(PoisonError::into_inner);
        if *earlier {
            return Ok(Kept::EarlierModel);
        }
        self.switch(staged)?;
        Ok(Kept::Record)
    }

    /// Puts the files of an inspection into the folder, and what `additions` ask for. Returns the record as it was written.
    ///
    /// # Errors
    /// [`StoreError`] naming the file; what stood there before then stays.
    pub fn publish(&self, inspected: &Inspected, additions: Additions<'_>) -> Result<InspectionRecord, StoreError> {
        self.publish_files(&inspected.record, |folder, target, generation| {
            inspection_set::write(folder, target, generation, inspected, additions)
        })
    }

    /// Puts `record` into the folder and beside it the files that `write` makes. It gets the folder to write into, the one
    /// that errors speak of, and the generation, and returns the names of the files.
    pub(crate) fn publish_files(
        &self,
        record: &InspectionRecord,
        write: impl FnOnce(&Path, &Path, &str) -> Result<Vec<String>, StoreError>,
    ) -> Result<InspectionRecord, StoreError> {
        let staged = self.stage()?;
        let names = write(&staged.folder, &self.folder, &staged.generation)?;
        let record = staged.finish(record, &self.folder, names)?;
        let mut earlier = self.earlier.lock().unwrap_or_else(PoisonError::into_inner);
        self.switch(staged)?;
        // From now on it is this inspection's own model that a mere record must not replace.
        *earlier = true;
        Ok(record)
    }

    fn stage(&self) -> Result<Staged, StoreError> {
        let generation = uuid::Uuid::now_v7().to_string();
        let beside = if self.in_place { None } else { beside(&self.folder, &generation) };
        let folder = beside.unwrap_or_else(|| self.folder.join(format!(".set.semascan-{generation}")));
        fs::create_dir(&folder).map_err(StoreError::io(&self.folder))?;
        let staged = Staged { folder, generation };
        // The name's permissions are those that the folder had.
        let permissions = fs::metadata(&self.folder).map_err(StoreError::io(&self.folder))?.permissions();
        fs::set_permissions(&staged.folder, permissions).map_err(StoreError::io(&staged.folder))?;
        Ok(staged)
    }

    /// Puts a finished set under the name.
    fn switch(&self, staged: Staged) -> Result<(), StoreError> {
        self.made_empty.store(false, Ordering::Relaxed);
        // Somebody may have removed it meanwhile.
        fs::create_dir_all(&self.folder).map_err(StoreError::io(&self.folder))?;
        if !self.in_place && exchange(&staged.folder, &self.folder) {
            sync_folder(self.folder.parent().unwrap_or(Path::new("/")))?;
            retire(&staged.folder, &self.folder);
            return Ok(());
        }
        replace_files(&staged, &self.folder)
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        if self.made_empty.load(Ordering::Relaxed) {
            // Fails where somebody else put something there, and then it stays.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// A set while it is written; dropped before it was put under its name it is removed.
#[derive(Debug)]
struct Staged {
    folder: PathBuf,
    generation: String,
}

impl Staged {
    /// Writes the record of a set with the files `names`, and brings the folder to the disk. Errors speak of `target`.
    fn finish(
        &self,
        record: &InspectionRecord,
        target: &Path,
        names: Vec<String>,
    ) -> Result<InspectionRecord, StoreError> {
        let files = FilesRecord { generation: self.generation.clone(), names };
        let record = InspectionRecord { files: Some(files), ..record.clone() };
        inspection_set::write_record(&self.folder.join(RECORD), &target.join(RECORD), &record)?;
        sync_folder(&self.folder)?;
        Ok(record)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        let files = Contents::of_temporary(&self.folder).unwrap_or_default().ours;
        let _ = remove(&self.folder, files);
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Refuses a folder that holds files of others, or anything while `overwrite` is not given.
fn refuse_contents(folder: &Path, overwrite: bool) -> Result<(), StoreError> {
    let contents = Contents::of(folder)?;
    let path = || folder.to_owned();
    match (contents.first(), contents.foreign.into_iter().min()) {
        (Some(found), _) if !overwrite => Err(StoreError::NotEmpty { path: path(), found }),
        (_, Some(found)) => Err(StoreError::Foreign { path: path(), found: found.display().to_string() }),
        _ => Ok(()),
    }
}

/// The same refusal under the name that the caller gave the folder.
fn named_as(given: &Path, error: StoreError) -> StoreError {
    let path = given.to_owned();
    match error {
        StoreError::NotEmpty { found, .. } => StoreError::NotEmpty { path, found },
        StoreError::Foreign { found, .. } => StoreError::Foreign { path, found },
        other => other,
    }
}

/// Whether the record in `folder` is that of an inspection that came to a model.
fn holds_model(folder: &Path) -> bool {
    let text = regular_file::read_to_string(&folder.join(RECORD)).unwrap_or_default();
    InspectionRecord::from_json(&text).is_ok_and(|record| record.points > 0)
}

/// Removes what killed writers left; the lock is held.
fn remove_leftovers(folder: &Path) -> Result<(), StoreError> {
    remove_temporary_files(folder)?;
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let beside = folder.parent().map(|parent| temporaries(parent, Some(&name)).unwrap_or_default());
    for leftover in temporaries(folder, Some("set"))?.into_iter().chain(beside.unwrap_or_default()) {
        if leftover.is_dir() {
            retire(&leftover, folder);
        }
    }
    Ok(())
}

/// Empties and removes a folder that stood under the name before; what others put into it is carried into `folder`.
fn retire(old: &Path, folder: &Path) {
    let others = Contents::of_temporary(old).unwrap_or_default();
    let _ = remove(old, others.ours);
    for name in others.foreign.iter().chain(&others.hidden) {
        let (from, to) = (old.join(name), folder.join(name));
        if let Some(parent) = to.parent() {
            let _ = fs::create_dir_all(parent);
        }
        if to.exists() || fs::rename(&from, &to).is_err() {
            tracing::warn!("{}: stays here, because {} cannot take it", from.display(), folder.display());
        }
    }
    let _ = fs::remove_dir(old.join(VIEWS));
    let _ = fs::remove_dir(old);
}

/// Puts the folder `new` under the name `target` in one step, and what was there under the name `new`. Returns whether
/// that could be done.
#[cfg(any(target_os = "linux", target_vendor = "apple"))]
pub(crate) fn exchange(new: &Path, target: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, new, CWD, target, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
pub(crate) fn exchange(_: &Path, _: &Path) -> bool {
    false
}

/// Replaces the files in `folder` by those of `staged` one by one. The record goes first and comes last.
fn replace_files(staged: &Staged, folder: &Path) -> Result<(), StoreError> {
    // A mount point lies in another file system than what is beside it: files are brought over before anything is removed.
    let inside = Staged {
        folder: folder.join(format!(".set.semascan-{}", uuid::Uuid::now_v7())),
        generation: staged.generation.clone(),
    };
    fs::create_dir(&inside.folder).map_err(StoreError::io(&inside.folder))?;
    let new = Contents::of(&staged.folder)?.ours;
    for name in &new {
        let (from, to) = (staged.folder.join(name), inside.folder.join(name));
        if let Some(parent) = to.parent() {
            fs::create_dir_all(parent).map_err(StoreError::io(parent))?;
        }
        if fs::rename(&from, &to).is_err() {
            write_new(&to, &folder.join(name), |out| {
                io::copy(&mut regular_file::open(&from)?, out)?;
                Ok(())
            })?;
        }
    }
    sync_folder(&inside.folder)?;
    remove(folder, Contents::of(folder)?.ours)?;
    sync_folder(folder)?;
    let (record, model): (Vec<_>, Vec<_>) = new.iter().partition(|name| name.as_path() == Path::new(RECORD));
    for name in model {
        put(&inside.folder.join(name), &folder.join(name))?;
    }
    sync_folder(folder)?;
    for name in record {
        put(&inside.folder.join(name), &folder.join(name))?;
    }
    sync_folder(folder)
}

fn put(from: &Path, to: &Path) -> Result<(), StoreError> {
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent).map_err(StoreError::io(parent))?;
    }
    fs::rename(from, to).map_err(StoreError::io(to))
}
