//! glTF 2.0 (Khronos Group, 2021), as text or binary (GLB): scenes with a node by component; scenes of other programs.

mod accessor;
mod container;
mod document;
mod placement;
mod read;
mod write;

pub(crate) use read::read;
pub use write::{GlbOptions, SceneColors, write_mesh, write_points, write_textured_mesh};
