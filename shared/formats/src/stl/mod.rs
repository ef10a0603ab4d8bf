//! STL: triangles and no more.

mod read;
mod write;

pub(crate) use read::read;
pub use write::{write_mesh, write_mesh_at};
