//! The grid that one tile is computed on: its own 32^3 cells and a halo, and the points in it.

use super::points::Placed;

/// Cells along an edge of a tile.
pub(super) const TILE_EDGE: i32 = 32;
/// Cells before and nodes after the tile's own: a quad reaches one cell out, whether a cell has a quad depends on its
/// neighbours, and how a doubled face is read on theirs.
pub(super) const HALO: i32 = 3;
/// Nodes along an edge of the working grid.
pub(super) const NODES: usize = (TILE_EDGE + 2 * HALO) as usize;
/// Cells along an edge of the working grid.
pub(super) const CELLS: usize = NODES - 1;

/// A point of the tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    /// Its cell, counted from that of the working grid's first node.
    pub(super) cell: [i32; 3],
    pub(super) point: Placed,
    /// Where the whole point is: which of the tile's chunks, and where in that.
    pub(super) chunk: u32,
    pub(super) index: u32,
}

/// Index in the working grid of a node or of the cell above it.
pub(super) const fn node_index(at: [i32; 3]) -> usize {
    (at[0] * (NODES * NODES) as i32 + at[1] * NODES as i32 + at[2]) as usize
}

/// The node at an index.
pub(super) const fn coordinates(node: usize) -> [i32; 3] {
    [(node / (NODES * NODES)) as i32, (node / NODES % NODES) as i32, (node % NODES) as i32]
}
