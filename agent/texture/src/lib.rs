//! A colour texture of the photographs on a semantic mesh, after [Waechter 2014].
//!
//! | file | what |
//! |---|---|
//! | `photograph.rs` | a photograph at its pose, and colours at places of it |
//! | `surface.rs` | the faces of the mesh, and which lie side by side |
//! | `visibility.rs` | what of the surface a photograph shows: in the picture, before everything else |
//! | `sights.rs` | for each face the photographs that show it, how well, and in which colour |
//! | `assign_views.rs` | one photograph for each face, so that neighbours have the same |
//! | `charts.rs` | faces side by side with one photograph, and their places in it |
//! | `pack.rs` | rectangles side by side in one atlas |
//! | `level_seams.rs` | corrections that make colours meet where charts do |
//! | `texels.rs` | the texels of a triangle |
//! | `bake.rs` | texels of charts from their photographs |
//! | `atlas.rs` | the atlas with all charts, and what marks places that no photograph shows |
//! | `nodes.rs` | the vertices of charts, where charts meet, and the colours there |
//! | `cut.rs` | the mesh cut along the charts |
//! | `textured_mesh.rs` | the result and its figures |
//! | `texturing.rs` | all of this in its order |
//!
//! Faces that no photograph shows get no colour: they have a neutral one, [`UNSEEN_COLOR`], with alpha 0, and are counted.
//! The photographs are asked for twice and one at a time, so that the memory does not grow with their number. The result does
//! not depend on the number of threads.

mod assign_views;
mod atlas;
mod bake;
mod charts;
mod cut;
mod level_seams;
mod nodes;
mod pack;
mod photograph;
mod sights;
mod surface;
mod texels;
mod textured_mesh;
mod texturing;
mod visibility;

#[cfg(test)]
mod fixtures;

pub use atlas::UNSEEN_COLOR;
pub use photograph::Photograph;
pub use textured_mesh::{TextureFigures, TexturedMesh};
pub use texturing::{LARGEST_ATLAS, TextureError, TextureOptions, texture};
