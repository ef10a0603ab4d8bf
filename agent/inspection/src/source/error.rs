//! Why a source or one of its views cannot be had.

use std::path::PathBuf;

/// Why a source or one of its views cannot be had; every message names the file or field at fault.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The source string cannot be understood.
    #[error("source {uri}: {reason}")]
    Uri {
        /// What was asked for.
        uri: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A field of a file or configuration holds what it must not.
    #[error("{}: field {field}: {reason}", path.display())]
    Field {
        /// The file.
        path: PathBuf,
        /// The field, as a path of keys.
        field: String,
        /// What is wrong.
        reason: String,
    },
}
