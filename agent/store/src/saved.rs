//! An inspection that was written before, read back.

use semascan_formats::ReadError;
use semascan_formats::ply;
use semascan_model::record::{InspectionRecord, RecordError};
use semascan_model::{SemanticCloud, Taxonomy};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

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
    /// The cloud is none.
    #[error(transparent)]
    Cloud(#[from] ReadError),
}

/// Reads the inspection in `folder`. One that did not come to a model has a record alone.
///
/// # Errors
/// [`SavedError`] naming the file.
pub fn read_inspection(folder: &Path) -> Result<SavedInspection, SavedError> {
    let path = folder.join("inspection.json");
    let text = fs::read_to_string(&path).map_err(|source| SavedError::Io { path: path.clone(), source })?;
    let record = InspectionRecord::from_json(&text).map_err(|source| SavedError::Record { path, source })?;
    let path = folder.join("cloud.ply");
    let bytes = match fs::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound && record.points == 0 => {
            let taxonomy = Taxonomy::from_names::<&str>(&[], &[]);
            return Ok(SavedInspection { record, cloud: SemanticCloud::default(), taxonomy });
        }
        Err(source) => return Err(SavedError::Io { path, source }),
    };
    let model = ply::read(&path.display().to_string(), &bytes)?;
    Ok(SavedInspection { record, cloud: model.mesh.vertices, taxonomy: model.taxonomy })
}
