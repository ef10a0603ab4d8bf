//! What a pick found at a place of the picture.

use glam::Vec3;

/// What is seen at a place of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// Nothing of the model.
    Nothing,
    /// It has changed since the picture was drawn: ask again.
    Changed,
    /// A piece of its surface.
    Surface {
        /// Which.
        of: Piece,
        /// Where, metres, table frame.
        place: Vec3,
        /// How far away along the direction of view, metres.
        distance: f32,
    },
}

/// A piece of the surface as the graphics device knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// The point in a slot of a block of a chunk; see [`super::thinning::point_in_slot`].
    Slot {
        /// The chunk.
        chunk: [i32; 3],
        /// Which of its blocks.
        block: usize,
        /// Which slot of the block.
        slot: usize,
    },
    /// A triangle of the mesh that has this vertex.
    Vertex(u32),
}
