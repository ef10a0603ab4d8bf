//! Readers for what people bring: clouds and meshes of this and other programs, from the bytes of a file.
//!
//! Everything that arrives is untrusted: counts are checked against the bytes that are there before anything is allocated.

pub mod gltf;
pub mod obj;
pub mod ply;
mod shape;
pub mod stl;

pub use shape::Shape;

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
    /// The name's ending is that of no format that is read.
    #[error("{name}: only PLY, OBJ, STL and GLB files are read")]
    Unknown {
        /// The file's name.
        name: String,
    },
}
