//! Sums over points on the nodes of a tile, laid out so that one point is added to a whole column of nodes at a time.
//!
//! A point reaches a cube of nodes, four or eight along an edge. What it adds to the nodes of one column differs by
//! height alone, so each sum has a row of its own for every column: additions are vector instructions, on any processor
//! and in WebAssembly, in the same order and with the same bits.

use super::node::Sums;
use super::working_grid::NODES;
use glam::Vec4;

/// Numbers that a row has before and after those of the tile's nodes: a cube at the edge is added as a whole.
const MARGIN: usize = 8;
/// Numbers in a row.
const ROW: usize = NODES + 2 * MARGIN;

/// The sums of all columns along z: for each a row for each sum.
#[derive(Debug)]
pub(super) struct Columns(Vec<[[f32; ROW]; 8]>);

impl Default for Columns {
    fn default() -> Self {
        Self(vec![[[0.0; ROW]; 8]; NODES * NODES])
    }
}

/// What a point adds to one column of its cube, by height: to `M` times four nodes.
pub(super) struct Share<const M: usize> {
    /// Weights.
    pub(super) weight: [Vec4; M],
    /// Distances from the point's plane.
    pub(super) plane: [Vec4; M],
    /// The point's normal.
    pub(super) normal: [f32; 3],
    /// Node minus point across the column.
    pub(super) across: [f32; 2],
    /// Node minus point along the column.
    pub(super) along: [Vec4; M],
}

impl Columns {
    /// Adds to the nodes of a column from height `first` on, some of which are the tile's, the others at most 8 beyond.
    #[inline(always)]
    pub(super) fn add<const M: usize>(&mut self, column: usize, first: i32, share: &Share<M>) {
        let start = (first + MARGIN as i32) as usize;
        assert!(start <= ROW - 4 * M, "the cube of a point lies beyond the tile's margin");
        let rows = &mut self.0[column];
        let Share { normal: [nx, ny, nz], across: [x, y], .. } = *share;
        for m in 0..M {
            let w = share.weight[m];
            let products = [w, w * share.plane[m], w * nx, w * ny, w * nz, w * x, w * y, w * share.along[m]];
            for (row, product) in rows.iter_mut().zip(products) {
                let sums = &mut row[start + 4 * m..start + 4 * m + 4];
                (Vec4::from_slice(sums) + product).write_to_slice(sums);
            }
        }
    }

    /// The sums of the four nodes from height `z` on, at most 4 beyond the tile.
    #[inline(always)]
    pub(super) fn four(&self, column: usize, z: usize) -> Sums {
        let rows = &self.0[column];
        Sums(std::array::from_fn(|k| Vec4::from_slice(&rows[k][z + MARGIN..z + MARGIN + 4])))
    }

    /// Forgets a column whose nodes in `reached`, a bit each, are all of the tile's that were added to.
    pub(super) fn clear(&mut self, column: usize, reached: u64) {
        let (first, last) = (reached.trailing_zeros() as usize, (63 - reached.leading_zeros()) as usize);
        // What lies beyond the tile was reached only together with its outermost nodes.
        let start = if first == 0 { 0 } else { first + MARGIN };
        let end = if last == NODES - 1 { ROW } else { last + 1 + MARGIN };
        for row in &mut self.0[column] {
            row[start..end].fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point above the middle of a column, of weight 1 in each of the heights that it reaches.
    fn share<const M: usize>() -> Share<M> {
        let plane = std::array::from_fn(|m| Vec4::new(0.0, 1.0, 2.0, 3.0) + 4.0 * m as f32);
        Share { weight: [Vec4::ONE; M], plane, normal: [0.0, 0.0, 1.0], across: [0.5, -0.5], along: plane }
    }

    #[test]
    fn a_cube_is_added_where_it_is() {
        let mut columns = Columns::default();
        columns.add(7, 3, &share::<1>());
        columns.add(7, 4, &share::<1>());
        let Sums([weight, plane, _, _, nz, x, y, z]) = columns.four(7, 3);
        assert_eq!(weight, Vec4::new(1.0, 2.0, 2.0, 2.0));
        assert_eq!((plane, z, nz), (Vec4::new(0.0, 1.0, 3.0, 5.0), plane, weight));
        assert_eq!((x, y), (0.5 * weight, -0.5 * weight));
        assert_eq!(columns.four(8, 3).0, [Vec4::ZERO; 8], "of one column only");
    }

    #[test]
    fn a_column_is_forgotten_with_what_lies_beyond_the_tile() {
        let edge = NODES as i32;
        for (first, reached) in [(-7, 1), (edge - 1, 1 << (edge - 1)), (5, 0xff << 5)] {
            let mut columns = Columns::default();
            columns.add(0, first, &share::<2>());
            columns.clear(0, reached);
            assert!(columns.0[0].as_flattened().iter().all(|sum| *sum == 0.0), "the cube from {first}");
        }
    }
}
