//! Readers for what people bring: clouds and meshes of this and other programs, from the bytes of a file.
//!
//! Everything that arrives is untrusted: counts are checked against the bytes that are there before anything is allocated.

pub mod ply;

/// Why a file could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImportError {
    /// The file is not what it should be.
    #[error("not a valid {format} file: {reason}")]
    Format {
        /// Name of the format.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
}
