//! PLY (G. Turk, "The PLY polygon file format", 1994): the semantic cloud and labelled meshes, and what other programs write.

mod header;
mod polygons;
mod read;
mod values;
mod vertices;
mod write;

pub use read::{PlyModel, read};
pub use write::{LabelledMesh, write_cloud, write_cloud_at, write_mesh, write_semantic_mesh, write_semantic_mesh_at};
