//! A picture on a mesh that is written: what the formats that can have one need of it.

use super::WriteError;

/// A picture on a mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshTexture<'a> {
    /// The picture as PNG. Its alpha is 0 where nothing is known of the surface's colour.
    pub png: &'a [u8],
    /// Its columns and rows.
    pub size: (u32, u32),
    /// Where each vertex of the mesh lies in the picture, 0..=1 from its upper left corner to the right and downwards.
    pub places: &'a [[f32; 2]],
    /// Length of a texel on the surface, metres.
    pub texel: f64,
    /// Share of the surface's area of whose colour nothing is known, 0..=1.
    pub unseen: f64,
    /// The colour that it has, sRGB.
    pub unseen_color: [u8; 3],
}

impl MeshTexture<'_> {
    /// Refuses places that are not as many as `vertices`.
    pub(crate) fn check(&self, vertices: usize) -> Result<(), WriteError> {
        match self.places.len() {
            len if len == vertices => Ok(()),
            len => Err(WriteError::Length { column: "texture places", len, vertices }),
        }
    }
}
