//! Where supervoxels begin: voxels sorted into seed cells of edge R ([Papon 2013], section III B).
//!
//! The grid of cells is anchored at the first voxel, which stands in the middle of its own cell. Cells are taken in
//! Morton order; each gives the voxel nearest to its middle, unless that voxel stands nearly alone.

use super::voxel_grid::{BITS, pack, sort_by_key, unpack};
use semascan_geometry::grid::morton;
use semascan_geometry::vector::squared_distance;

/// Voxels by seed cell.
#[derive(Debug)]
pub(super) struct SeedCells {
    anchor: [f32; 3],
    edge: f32,
    /// Addresses of the occupied cells, in order.
    keys: Vec<u64>,
    /// Where the voxels of each cell begin, and where the last ones end.
    first: Vec<u32>,
    voxels: Vec<u32>,
}

impl SeedCells {
    /// Sorts voxels into cells; there are none if `edge` is not a length. Voxels out of reach have no cell.
    pub(super) fn new(positions: &[[f32; 3]], edge: f32) -> Self {
        let anchor = positions.first().copied().unwrap_or_default();
        let mut cells = Self { anchor, edge, keys: Vec::new(), first: Vec::new(), voxels: Vec::new() };
        if edge.is_finite() && edge > 0.0 {
            let mut sorted: Vec<(u64, u32)> =
                positions.iter().enumerate().filter_map(|(i, &p)| Some((pack(cells.cell(p))?, i as u32))).collect();
            sort_by_key(&mut sorted);
            for (key, voxel) in sorted {
                if cells.keys.last() != Some(&key) {
                    cells.keys.push(key);
                    cells.first.push(cells.voxels.len() as u32);
                }
                cells.voxels.push(voxel);
            }
        }
        cells.first.push(cells.voxels.len() as u32);
        cells
    }

    /// Position in cells: the anchor is in the middle of cell 0.
    fn cell(&self, p: [f32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|a| f64::from(p[a] - self.anchor[a]) / f64::from(self.edge) + 0.5)
    }

    fn voxels_of(&self, cell: usize) -> &[u32] {
        &self.voxels[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    /// Voxels of the occupied cells with addresses from `low` to `high` in every axis.
    fn within(&self, low: [u32; 3], high: [u32; 3]) -> impl Iterator<Item = u32> + '_ {
        let address = |x: u32, y: u32, z: u32| u64::from(x) << (2 * BITS) | u64::from(y) << BITS | u64::from(z);
        let rows = (low[0]..=high[0]).flat_map(move |x| (low[1]..=high[1]).map(move |y| (x, y)));
        rows.flat_map(move |(x, y)| {
            let from = self.keys.partition_point(|&k| k < address(x, y, low[2]));
            let to = from + self.keys[from..].iter().take_while(|&&k| k <= address(x, y, high[2])).count();
            self.voxels[self.first[from] as usize..self.first[to] as usize].iter().copied()
        })
    }

    /// The nearest voxel to `p` in its cell and the cells around, the lower index where two are equally near.
    pub(super) fn nearest(&self, positions: &[[f32; 3]], p: [f32; 3]) -> Option<u32> {
        let c = unpack(pack(self.cell(p))?);
        nearest_of(positions, p, self.within(c.map(|c| c - 1), c.map(|c| c + 1))).map(|n| n.1)
    }

    /// The seeds: for each occupied cell the voxel nearest to its middle, if more than `fewest` voxels stand within
    /// `radius` (at most half a cell) of that one.
    pub(super) fn seeds(&self, positions: &[[f32; 3]], radius: f32, fewest: f32) -> Vec<u32> {
        let mut order: Vec<(u64, u32)> =
            self.keys.iter().enumerate().map(|(i, &k)| (morton(unpack(k)), i as u32)).collect();
        sort_by_key(&mut order);
        order
            .iter()
            .filter_map(|&(_, i)| {
                let c = unpack(self.keys[i as usize]);
                let zero = unpack(pack([0.5; 3])?);
                let middle =
                    [0, 1, 2].map(|a| self.anchor[a] + (f64::from(c[a]) - f64::from(zero[a])) as f32 * self.edge);
                let own = nearest_of(positions, middle, self.voxels_of(i as usize).iter().copied())?;
                // What is nearer than the cell's faces cannot be beaten by another cell.
                let voxel = if own.0 < 0.25 * self.edge * self.edge { own.1 } else { self.nearest(positions, middle)? };
                let at = positions[voxel as usize];
                let corner = |r: f32| pack(self.cell(at.map(|x| x + r))).map(unpack);
                let near = self.within(corner(-radius)?, corner(radius)?);
                let near = near.filter(|&v| squared_distance(positions[v as usize], at) <= radius * radius).count();
                (near as f32 > fewest).then_some(voxel)
            })
            .collect()
    }
}

fn nearest_of(positions: &[[f32; 3]], p: [f32; 3], voxels: impl Iterator<Item = u32>) -> Option<(f32, u32)> {
    voxels
        .map(|v| (squared_distance(positions[v as usize], p), v))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn seeds_are_the_nearest_voxels_to_the_middles(
            positions in prop::collection::vec(
                prop::array::uniform3((-100_000..100_000_i32).prop_map(|k| k as f32 / 1e6)),
                1..150,
            ),
        ) {
            let edge = 0.03;
            let cells = SeedCells::new(&positions, edge);
            let seeds = cells.seeds(&positions, 0.5 * edge, 2.0);
            let mut expected = Vec::new();
            let cell = |p: [f32; 3]| [0, 1, 2].map(|a| (f64::from(p[a] - positions[0][a]) / f64::from(edge) + 0.5).floor());
            let mut occupied: Vec<[f64; 3]> = positions.iter().map(|&p| cell(p)).collect();
            occupied.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
            occupied.dedup();
            for c in occupied {
                let middle = [0, 1, 2].map(|a| positions[0][a] + c[a] as f32 * edge);
                let (_, voxel) = nearest_of(&positions, middle, 0..positions.len() as u32).expect("voxels");
                let at = positions[voxel as usize];
                let near = positions.iter().filter(|&&q| squared_distance(q, at) <= 0.25 * edge * edge).count();
                if near > 2 {
                    expected.push(voxel);
                }
            }
            let mut found = seeds.clone();
            found.sort_unstable();
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }
}
