//! Why a file could not be read or written.

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The system did not give its bytes.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// The underlying I/O error.
        source: std::io::Error,
    },
    /// The file is not what it should be.
    #[error("{file}: {reason}")]
    Format {
        /// The file.
        file: String,
        /// Its format and what is wrong.
        reason: String,
    },
}

impl ReadError {
    /// `file` is not what its format asks for.
    pub(crate) fn format(file: &str, format: &str, reason: &str) -> Self {
        Self::Format { file: file.to_owned(), reason: format!("is no usable {format}: {reason}") }
    }
}

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The destination refused the bytes.
    #[error("cannot write the file: {0}")]
    Io(#[from] std::io::Error),
    /// More than the format's 32-bit lengths can name.
    #[error("{what} is too large for the format: {len} is over {limit}")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its length.
        len: usize,
        /// What the format allows.
        limit: usize,
    },
    /// A mesh column does not have a value for every vertex.
    #[error("{column} has {len} values for {vertices} vertices")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Its length.
        len: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// A triangle names a vertex that the mesh does not have.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    Vertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// The scene's description could not be made.
    #[error("cannot describe the scene: {0}")]
    Json(#[from] serde_json::Error),
}
