//! Writers for point clouds, meshes and scenes, the same code in agent and browser: all write to any [`std::io::Write`],
//! a `Vec<u8>` among them.
//!
//! | module | what |
//! |---|---|
//! | [`filter`] | which points an export holds |
//! | [`ply`] | `cloud.ply`, `mesh.ply` and `truth.ply` |
//! | [`obj`] | a mesh in groups with materials by component |
//! | [`stl`] | a mesh as one solid by component |
//! | [`glb`] | a scene of points or of meshes with a node by component |

mod by_component;
pub mod filter;
pub mod glb;
pub mod obj;
pub mod ply;
pub mod stl;

pub use by_component::{Component, components};
pub use filter::ExportFilter;

/// A name as a part of a file name: letters, digits, `-` and `_`.
pub fn file_part(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// Why an export failed.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The destination refused the bytes.
    #[error("cannot write the export: {0}")]
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
