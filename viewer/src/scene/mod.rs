//! The scene: the model as held, its mesh, and what of both and of the state a frame shows.
//!
//! | module | what |
//! |---|---|
//! | [`model`] | the points, chunk by chunk, kept level with the agent |
//! | [`mesh`] | the mesh of the model, and its deviations |
//! | [`figures`] | the model's figures, for the state |
//! | [`frame_content`] | from the state to what a frame shall show |
//! | [`paint`] | labels that people gave to patches of the surface |
//! | [`photo_layers`] | the photographs that colour the mesh |
//! | [`photograph`] | the pixels of a photograph |
//! | [`pick`] | from what the graphics device saw to what the model knows of it |
//! | [`section_export`] | the section as a drawing |

pub mod figures;
pub mod frame_content;
pub mod mesh;
pub mod model;
pub mod paint;
pub mod photo_layers;
pub mod photograph;
pub mod pick;
pub mod section_export;

pub use mesh::HeldMesh;
pub use model::{HeldModel, ModelChange};
pub use paint::HeldPaint;
pub use photo_layers::HeldLayers;
pub use photograph::HeldPhotograph;
