//! The mean of the points in each voxel. Voxels are as large as a pixel of the first view sees, and grow until what is held is no more than
//! a page shows with ease.

use glam::{DVec3, IVec3};
use semascan_model::{SemanticCloud, SemanticPoint};
use std::collections::HashMap;

/// Edge of voxels of which nothing else is known, metres.
const FINEST: f64 = 5e-4;
/// Most voxels.
const MOST: usize = 1_500_000;

/// Sums of a voxel.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    position: DVec3,
    color: [f32; 3],
    points: f32,
    /// Views that saw it, and the last of them.
    views: u16,
    last: u32,
}

/// Points by voxels.
#[derive(Debug)]
pub(crate) struct Grid {
    /// Edge of a voxel, metres.
    voxel: f64,
    sums: HashMap<IVec3, Sum>,
    most: usize,
}

impl Default for Grid {
    fn default() -> Self {
        Self { voxel: FINEST, sums: HashMap::new(), most: MOST }
    }
}

impl Grid {
    /// The edge of the voxels, metres, while there are none.
    pub(crate) fn begin(&mut self, voxel: f64) {
        if self.sums.is_empty() && voxel.is_finite() {
            self.voxel = voxel.max(FINEST);
        }
    }

    /// A point of the `view`-th view, metres; one beyond what voxels can be counted for is left out.
    pub(crate) fn add(&mut self, position: DVec3, color: [u8; 3], view: u32) {
        let Some(at) = self.voxel_of(position) else { return };
        let sum = self.sums.entry(at).or_insert(Sum { last: u32::MAX, ..Sum::default() });
        sum.position += position;
        sum.color.iter_mut().zip(color).for_each(|(sum, own)| *sum += f32::from(own));
        sum.points += 1.0;
        if sum.last != view {
            sum.views = sum.views.saturating_add(1);
            sum.last = view;
        }
        if self.sums.len() > self.most {
            self.coarsen();
        }
    }

    /// Edge of a voxel, metres.
    pub(crate) fn voxel(&self) -> f64 {
        self.voxel
    }

    /// A point for each voxel, in the order of their places.
    pub(crate) fn cloud(&self) -> SemanticCloud {
        let mut voxels: Vec<(&IVec3, &Sum)> = self.sums.iter().collect();
        voxels.sort_unstable_by_key(|(at, _)| at.to_array());
        let point = |sum: &Sum| SemanticPoint {
            position: (sum.position / f64::from(sum.points)).as_vec3().to_array(),
            color: sum.color.map(|c| (c / sum.points).round() as u8),
            views: sum.views,
            ..SemanticPoint::UNKNOWN
        };
        voxels.into_iter().map(|(_, sum)| point(sum)).collect()
    }

    fn voxel_of(&self, position: DVec3) -> Option<IVec3> {
        let at = (position / self.voxel).floor();
        (at.is_finite() && at.abs().max_element() < f64::from(i32::MAX)).then(|| at.as_ivec3())
    }

    /// Voxels of twice the edge.
    fn coarsen(&mut self) {
        self.voxel *= 2.0;
        let mut coarse: HashMap<IVec3, Sum> = HashMap::with_capacity(self.sums.len() / 2);
        for (at, sum) in self.sums.drain() {
            let into = coarse.entry(IVec3::new(at.x >> 1, at.y >> 1, at.z >> 1)).or_default();
            into.position += sum.position;
            into.color.iter_mut().zip(sum.color).for_each(|(into, own)| *into += own);
            into.points += sum.points;
            // Those of one voxel saw most of the other's views too.
            into.views = into.views.max(sum.views);
            into.last = into.last.max(sum.last);
        }
        self.sums = coarse;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voxel_is_the_mean_of_its_points_and_counts_the_views_that_saw_it() {
        let mut grid = Grid::default();
        grid.add(DVec3::new(1e-4, 1e-4, 1e-4), [10, 0, 0], 0);
        grid.add(DVec3::new(3e-4, 1e-4, 1e-4), [20, 0, 0], 0);
        grid.add(DVec3::new(2e-4, 1e-4, 1e-4), [30, 0, 0], 1);
        grid.add(DVec3::new(f64::NAN, 0.0, 0.0), [0; 3], 1);
        grid.add(DVec3::new(1e30, 0.0, 0.0), [0; 3], 1);
        let cloud = grid.cloud();
        assert_eq!((cloud.len(), cloud.colors[0], cloud.views[0]), (1, [20, 0, 0], 2));
        assert!((cloud.positions[0][0] - 2e-4).abs() < 1e-9);
    }

    #[test]
    fn voxels_grow_where_there_are_too_many() {
        let mut grid = Grid { most: 100, ..Grid::default() };
        for i in 0..1000 {
            grid.add(DVec3::new(f64::from(i) * FINEST - 0.2, 0.0, 0.0), [7, 8, 9], 0);
        }
        let cloud = grid.cloud();
        assert!(cloud.len() <= 100 && cloud.len() > 40, "{}", cloud.len());
        assert_eq!(grid.voxel(), FINEST * 16.0);
        assert!(
            cloud.positions.windows(2).all(|pair| pair[0][0] < pair[1][0])
                && cloud.colors.iter().all(|c| *c == [7, 8, 9])
        );
    }
}
