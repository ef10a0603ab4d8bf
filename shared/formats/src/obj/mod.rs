//! Wavefront OBJ with its material library: the mesh in objects by component; parts of other programs.

mod material;
mod read;
mod write;

pub(crate) use read::read;
pub use write::{write_materials, write_mesh, write_mesh_at, write_textured_materials, write_textured_mesh_at};
