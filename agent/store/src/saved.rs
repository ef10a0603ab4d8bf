//! An inspection that was written before, read back.

use crate::generation::{SetError, check_set};
use semascan_formats::{ReadError, ply, regular_file};
use semascan_model::record::{InspectionRecord, RecordError};
use semascan_model::{SemanticCloud, Taxonomy};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

/// How often a folder is looked at again whose files change while it is read, and how long after.
const LOOKS: u32 = 5;
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// An inspection that was written before.
#[derive(Clone, Debug)]
pub struct SavedInspection {
    /// Its record.
    pub record: InspectionRecord,
    /// Its points, table frame; none if it did not come to a model.
    pub cloud: SemanticCloud,
    /// The classes of the points.
    pub taxonomy: Taxonomy,
}

/// Why a saved inspection cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: io::Error,
    },
    /// The record is none.
    #[error("{}: {source}", path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// Why.
        source: RecordError,
    },
    /// There is no record: the folder holds no inspection, or one whose writing was cut off.
    #[error("{}: holds no inspection.json, and so no whole inspection", folder.display())]
    NoRecord {
        /// The folder.
        folder: PathBuf,
    },
    /// The files do not belong together.
    #[error(transparent)]
    Set(#[from] SetError),
    /// The cloud is none.
    #[error(transparent)]
    Cloud(#[from] ReadError),
}

/// Reads the inspection in `folder`. One that did not come to a model has a record alone.
///
/// # Errors
/// [`SavedError`] naming the file, also where the files are of several inspections.
pub fn read_inspection(folder: &Path) -> Result<SavedInspection, SavedError> {
    regular_file::check_folder(folder).map_err(|source| SavedError::Io { path: folder.to_owned(), source })?;
    for _ in 1..LOOKS {
        match read_once(folder) {
            // Replaced while it was read: the next look sees the new set whole.
            Err(SavedError::Set(_) | SavedError::Io { .. }) if folder.is_dir() => thread::sleep(BETWEEN_LOOKS),
            result => return result,
        }
    }
    read_once(folder)
}

/// Reads the record of the inspection in `folder`, beside which the files stand that belong to it.
///
/// # Errors
/// As [`read_inspection`].
pub fn read_record(folder: &Path) -> Result<InspectionRecord, SavedError> {
    let path = folder.join("inspection.json");
    let text = match regular_file::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound && folder.is_dir() => {
            return Err(SavedError::NoRecord { folder: folder.to_owned() });
        }
        Err(source) => return Err(SavedError::Io { path, source }),
    };
    let record = InspectionRecord::from_json(&text).map_err(|source| SavedError::Record { path, source })?;
    check_set(folder, &record)?;
    Ok(record)
}

fn read_once(folder: &Path) -> Result<SavedInspection, SavedError> {
    let record = read_record(folder)?;
    let path = folder.join("cloud.ply");
    let bytes = match regular_file::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound && record.points == 0 => {
            let taxonomy = Taxonomy::from_names::<&str>(&[], &[]);
            return Ok(SavedInspection { record, cloud: SemanticCloud::default(), taxonomy });
        }
        Err(source) => return Err(SavedError::Io { path, source }),
    };
    let model = ply::read(&path.display().to_string(), &bytes)?;
    // The bytes that were read are those of the set, whatever happened to the folder since it was checked.
    let expected = record.files.as_ref().map(|files| files.generation.clone());
    let found = model.comment("generation").map(str::to_owned);
    if found != expected {
        return Err(SetError::Mixed { path, found, expected }.into());
    }
    Ok(SavedInspection { record, cloud: model.mesh.vertices, taxonomy: model.taxonomy })
}
