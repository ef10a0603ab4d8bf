//! A copy of a data folder that is consistent, also while an inspection runs.
//!
//! The database is copied first, as of one moment. All that its rows speak of was on the disk before they were committed and
//! does not change afterwards, so that it is copied after it.

use super::DataFolder;
use super::folder::DATABASE;
use crate::{StoreError, write_file};
use semascan_formats::regular_file;
use semascan_inspection::ports::{Catalogue, InspectionFilter, InspectionState};
use std::fs;
use std::io;
use std::path::Path;

/// What a copy holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Backup {
    /// Inspections.
    pub inspections: u64,
    /// Of these, those that ran: they are continued where the copy is used.
    pub running: u64,
    /// Files.
    pub files: u64,
    /// Bytes of the files.
    pub bytes: u64,
}

impl DataFolder {
    /// Copies everything into `target`, which must be empty or not be there.
    ///
    /// # Errors
    /// [`StoreError`] naming the file.
    pub fn back_up(&self, target: &Path) -> Result<Backup, StoreError> {
        fs::create_dir_all(target).map_err(StoreError::io(target))?;
        if let Some(found) = fs::read_dir(target).map_err(StoreError::io(target))?.next() {
            let found = found.map_err(StoreError::io(target))?.file_name().to_string_lossy().into_owned();
            return Err(StoreError::NotEmpty { path: target.to_owned(), found });
        }
        self.catalogue().copy_to(&target.join(DATABASE))?;
        let copied = super::SqliteCatalogue::open_existing(&target.join(DATABASE))?;
        let mut backup = Backup::default();
        for row in copied.inspections(&InspectionFilter::default())? {
            backup.inspections += 1;
            backup.running += u64::from(row.state == InspectionState::Running);
            let files = copied.files(row.id)?;
            let running = [format!("captures/{}.mcap", row.id), format!("inspections/{}/inspection.json", row.id)];
            let names = if files.is_empty() { running.to_vec() } else { files.into_iter().map(|f| f.name).collect() };
            for name in names {
                match copy(&self.path().join(&name), &target.join(&name)) {
                    Ok(bytes) => {
                        backup.files += 1;
                        backup.bytes += bytes;
                    }
                    // Of one that has only just begun there may be nothing yet, and no row speaks of it.
                    Err(
                        StoreError::Io { source, .. }
                        | StoreError::Export { source: semascan_formats::WriteError::Io(source), .. },
                    ) if source.kind() == io::ErrorKind::NotFound && row.views == 0 => {}
                    Err(error) => return Err(error),
                }
            }
        }
        for name in ["captures", "inspections", "blobs"] {
            let folder = target.join(name);
            fs::create_dir_all(&folder).map_err(StoreError::io(&folder))?;
        }
        use semascan_inspection::ports::Blobs;
        let blobs = super::LocalBlobs::open(&target.join("blobs"))?;
        for digest in self.blobs().list()? {
            let Some(content) = self.blobs().get(&digest)? else { continue };
            blobs.put(&content)?;
            backup.files += 1;
            backup.bytes += content.len() as u64;
        }
        Ok(backup)
    }
}

/// Copies a file as far as it goes now, and brings the copy to the disk.
fn copy(from: &Path, to: &Path) -> Result<u64, StoreError> {
    let file = regular_file::open(from).map_err(StoreError::io(from))?;
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent).map_err(StoreError::io(parent))?;
    }
    let mut bytes = 0;
    write_file(to, |out| {
        bytes = io::copy(&mut &file, out)?;
        Ok(())
    })?;
    Ok(bytes)
}
