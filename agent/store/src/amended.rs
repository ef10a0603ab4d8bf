//! The record of a written inspection, changed: what is decided about it later stands in it, beside what was measured. The
//! other files of the set stay as they are, and so does their generation.

use crate::contents::RECORD;
use crate::generation::check_set;
use crate::inspection_set::write_record_whole;
use crate::lock::FolderLock;
use crate::saved::SavedError;
use crate::{SetError, StoreError};
use semascan_formats::regular_file;
use semascan_model::record::InspectionRecord;
use std::io;
use std::path::Path;

/// Why a record could not be changed.
#[derive(Debug, thiserror::Error)]
pub enum AmendError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] SavedError),
    /// The files do not belong together.
    #[error(transparent)]
    Set(#[from] SetError),
    /// It cannot be written, or somebody else writes.
    #[error(transparent)]
    Write(#[from] StoreError),
}

/// Changes the record of the inspection in `folder` and returns it as it then stands there. It is exchanged in one step, while
/// nobody else writes into the folder; where `change` fails it stays as it was.
///
/// # Errors
/// [`AmendError`] naming the file, or what `change` says.
pub fn amend_record<E: From<AmendError>>(
    folder: &Path,
    change: impl FnOnce(&mut InspectionRecord) -> Result<(), E>,
) -> Result<InspectionRecord, E> {
    let write = |error: StoreError| AmendError::from(error);
    let given = folder;
    let folder = folder.canonicalize().map_err(|error| write(StoreError::io(given)(error)))?;
    let _lock = FolderLock::acquire(&folder).map_err(write)?;
    let path = folder.join(RECORD);
    let mut record = read(given, &path).map_err(AmendError::from)?;
    check_set(&folder, &record).map_err(AmendError::from)?;
    change(&mut record)?;
    write_record_whole(&path, &record).map_err(write)?;
    Ok(record)
}

fn read(folder: &Path, path: &Path) -> Result<InspectionRecord, SavedError> {
    let text = match regular_file::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(SavedError::NoRecord { folder: folder.to_owned() });
        }
        Err(source) => return Err(SavedError::Io { path: path.to_owned(), source }),
    };
    InspectionRecord::from_json(&text).map_err(|source| SavedError::Record { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const RECORD_TEXT: &str = include_str!("../../../shared/model/src/record/fixtures/version1.json");

    #[test]
    fn a_record_is_changed_whole_or_not_at_all() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join(RECORD);
        let missing = amend_record::<AmendError>(root.path(), |_| Ok(())).expect_err("nothing there");
        assert!(missing.to_string().contains("holds no inspection.json"), "{missing}");
        fs::write(&path, RECORD_TEXT).expect("written");
        let refuse = |_: &mut InspectionRecord| Err(AmendError::Write(StoreError::NoFolder { path: "here".into() }));
        amend_record(root.path(), refuse).expect_err("refused");
        assert_eq!(fs::read_to_string(&path).expect("there"), RECORD_TEXT);
        let changed = amend_record::<AmendError>(root.path(), |record| {
            record.part = "another".into();
            Ok(())
        })
        .expect("changed");
        let written = InspectionRecord::from_json(&fs::read_to_string(&path).expect("there")).expect("a record");
        assert_eq!((written.part.as_str(), &written), ("another", &changed));
        let held = FolderLock::acquire(&root.path().canonicalize().expect("there")).expect("free");
        let locked = amend_record::<AmendError>(root.path(), |_| Ok(())).expect_err("held");
        assert!(locked.to_string().contains("another process writes"), "{locked}");
        drop(held);
    }
}
