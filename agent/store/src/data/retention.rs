//! Which inspections are kept, and the removal of the others.

use super::DataFolder;
use crate::StoreError;
use jiff::{SignedDuration, Timestamp};
use semascan_inspection::ports::{Catalogue, InspectionFilter, InspectionRow, InspectionState};
use semascan_model::InspectionId;
use std::fs;
use std::io;
use std::path::Path;

/// Which inspections are kept. One that runs or is held always is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Retention {
    /// Those that ended longer ago are removed.
    pub age: Option<SignedDuration>,
    /// The oldest are removed until all that is kept of inspections has at most so many bytes.
    pub bytes: Option<u64>,
}

/// An inspection that was removed, or would be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Removed {
    /// The inspection.
    pub id: InspectionId,
    /// Bytes of its files.
    pub bytes: u64,
}

impl DataFolder {
    /// Removes the inspections that `retention` does not keep, the oldest first; with `dry_run` it only says which.
    ///
    /// # Errors
    /// [`StoreError`] naming the file that cannot be removed.
    pub fn collect(&self, retention: &Retention, now: Timestamp, dry_run: bool) -> Result<Vec<Removed>, StoreError> {
        let mut rows = self.catalogue().inspections(&InspectionFilter::default())?;
        rows.reverse();
        let mut sized = Vec::new();
        for row in rows {
            let bytes = size(&self.capture_path(row.id))? + size(&self.result_path(row.id))?;
            sized.push((row, bytes));
        }
        let mut total: u64 = sized.iter().map(|(_, bytes)| bytes).sum();
        let mut removed = Vec::new();
        for (InspectionRow { id, ended, state, held, .. }, bytes) in sized {
            let too_old = match (retention.age, ended) {
                (Some(age), Some(ended)) => now.duration_since(ended) > age,
                _ => false,
            };
            let too_much = retention.bytes.is_some_and(|most| total > most);
            if held || state == InspectionState::Running || !(too_old || too_much) {
                continue;
            }
            if !dry_run {
                // The row goes first: files without one are nobody's, a row without files is a fault.
                self.catalogue().remove(id)?;
                remove(&self.capture_path(id))?;
                remove(&self.result_path(id))?;
            }
            total -= bytes;
            removed.push(Removed { id, bytes });
        }
        if !dry_run {
            self.remove_orphans()?;
        }
        Ok(removed)
    }

    /// Removes captures and models that no row speaks of: those of a removal that was cut off.
    fn remove_orphans(&self) -> Result<(), StoreError> {
        for (folder, suffix) in [("captures", ".mcap"), ("captures", ".mcap.part"), ("inspections", "")] {
            let folder = self.path().join(folder);
            for entry in fs::read_dir(&folder).map_err(StoreError::io(&folder))? {
                let entry = entry.map_err(StoreError::io(&folder))?;
                let name = entry.file_name().to_string_lossy().into_owned();
                let id = name.strip_suffix(suffix).and_then(|id| id.parse::<InspectionId>().ok());
                if let Some(id) = id
                    && (suffix == ".mcap.part" || self.catalogue().inspection(id)?.is_none())
                {
                    remove(&entry.path())?;
                }
            }
        }
        Ok(())
    }
}

/// Bytes of a file, or of the files of a folder; 0 where there is none.
fn size(path: &Path) -> Result<u64, StoreError> {
    let about = match fs::symlink_metadata(path) {
        Ok(about) => about,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        Err(error) => return Err(StoreError::io(path)(error)),
    };
    if !about.is_dir() {
        return Ok(about.len());
    }
    let mut bytes = 0;
    for entry in fs::read_dir(path).map_err(StoreError::io(path))? {
        bytes += size(&entry.map_err(StoreError::io(path))?.path())?;
    }
    Ok(bytes)
}

fn remove(path: &Path) -> Result<(), StoreError> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(StoreError::io(path)(error)),
        _ => Ok(()),
    }
}
