//! A block of bricks and what is around it, as lists of the occupied cells: a voxel's neighbours are found without any
//! look-up by address.
//!
//! The lists are in the order of the cells, and where they begin is known for every cell of the block. A slab of a
//! neighbourhood, one cell thick, is thus a slice of the lists, which is read a few cells at a time and without asking any
//! cell whether it is occupied. The slice also holds what lies above and below the neighbourhood, which is little where
//! the cells of a column run along the normals of the surface; so they do.

use crate::fuse::brick::Voxel;
use crate::fuse::keys::{BRICK_EDGE, BrickKey, within_brick};
use crate::fuse::map::SemanticMap;
use glam::{BVec4A, Vec4};
use semascan_geometry::grid::coarser;
use semascan_geometry::vote::largest;

/// Entries of lists that are worked on together.
const LANES: usize = 4;
/// Largest radius: surroundings do not reach beyond the bricks that touch the block.
pub(super) const LARGEST_RADIUS: i32 = 4;
/// Bricks along an edge of a block. Its cells and those around it can be counted in 16 bits.
const BLOCK: i32 = 4;
/// The same with the bricks around it.
const SPAN: i32 = BLOCK + 2;

/// One voxel in so many is asked for the way it faces.
const SAMPLED: usize = 8;

/// The block that a brick belongs to.
pub(super) fn block_of(brick: BrickKey) -> [i32; 3] {
    coarser(brick.0, BLOCK)
}

/// Cells begin `radius` cells before the block's lowest.
#[derive(Debug)]
pub(super) struct Surroundings {
    radius: i32,
    /// Cells along an edge.
    side: i32,
    /// Lowest brick of the block.
    lowest: [i32; 3],
    /// The map's axes from the slowest to the fastest that cells are numbered along; the last is that of the columns.
    axes: [usize; 3],
    /// Number of occupied cells before each cell, and before the end.
    before: Vec<u16>,
    /// Mean points in voxels from the first cell, a list an axis of `axes`.
    points: [Vec<f32>; 3],
    /// Unit normals or zero, a list an axis of `axes`.
    normals: [Vec<f32>; 3],
    weights: Vec<f32>,
    /// How high in its column each cell is.
    heights: Vec<f32>,
}

/// A voxel in its surroundings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    cell: usize,
    /// In the lists.
    at: usize,
}

/// Some cells of a neighbourhood.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    /// Where the first of them is in the lists.
    start: usize,
    /// Which of them are occupied by a neighbour.
    pub(super) mask: BVec4A,
    /// From their points to the voxel's.
    step: [Vec4; 3],
    pub(super) squares: Vec4,
}

impl Surroundings {
    /// For neighbourhoods of half edge `radius`, 1 to [`LARGEST_RADIUS`].
    pub(super) fn new(radius: i32) -> Self {
        let side = BLOCK * BRICK_EDGE + 2 * radius;
        let cells = (side * side * side) as usize;
        let list = || vec![0.0; cells + LANES];
        Self {
            radius,
            side,
            lowest: [0; 3],
            axes: [0, 1, 2],
            before: vec![0; cells + 1],
            points: [list(), list(), list()],
            normals: [list(), list(), list()],
            weights: list(),
            heights: list(),
        }
    }

    /// Lays out `block`, and as many cells around it as the radius.
    pub(super) fn read(&mut self, map: &SemanticMap, block: [i32; 3]) {
        self.lowest = block.map(|c| c * BLOCK);
        let bricks: Vec<([i32; 3], &[Voxel])> = (0..SPAN * SPAN * SPAN)
            .filter_map(|i| {
                let step = [i / (SPAN * SPAN) - 1, i / SPAN % SPAN - 1, i % SPAN - 1];
                let at = map.index.get(&BrickKey(std::array::from_fn(|a| self.lowest[a] + step[a])))?;
                Some((step.map(|s| s * BRICK_EDGE + self.radius), map.bricks[*at].voxels.as_slice()))
            })
            .collect();
        // A few voxels know which way the surface faces.
        let mut facing = [0.0; 3];
        for voxel in bricks.iter().flat_map(|(_, voxels)| voxels.iter().step_by(SAMPLED)) {
            for (sum, along) in facing.iter_mut().zip(voxel.normal) {
                *sum += along.abs();
            }
        }
        let column = largest(&facing, f32::MIN);
        self.axes = [(column + 1) % 3, (column + 2) % 3, column];

        self.before.fill(0);
        for (first, voxels) in &bricks {
            for voxel in *voxels {
                if let Some((number, _)) = self.cell_of(*first, voxel.local) {
                    self.before[number] = 1;
                }
            }
        }
        let mut occupied = 0;
        for before in &mut self.before {
            occupied += std::mem::replace(before, occupied);
        }
        for (first, voxels) in &bricks {
            for voxel in *voxels {
                let Some((number, cell)) = self.cell_of(*first, voxel.local) else { continue };
                let place = usize::from(self.before[number]);
                let inverse = 1.0 / voxel.weight;
                let [x, y, z] = voxel.normal;
                let length = 1.0 / (x * x + y * y + z * z).sqrt().max(f32::MIN_POSITIVE);
                for (i, &axis) in self.axes.iter().enumerate() {
                    self.points[i][place] = cell[axis] as f32 + voxel.offset[axis] * inverse;
                    self.normals[i][place] = voxel.normal[axis] * length;
                }
                self.weights[place] = voxel.weight;
                self.heights[place] = cell[column] as f32;
            }
        }
    }

    /// Number and coordinates of the cell of a voxel of the brick that begins at cell `first`, if not outside.
    #[inline(always)]
    fn cell_of(&self, first: [i32; 3], local: u16) -> Option<(usize, [i32; 3])> {
        let [x, y, z] = within_brick(local);
        let cell = [first[0] + i32::from(x), first[1] + i32::from(y), first[2] + i32::from(z)];
        let inside = |c: i32| c >= 0 && c < self.side;
        let [slow, middle, fast] = self.axes;
        let number = (cell[slow] * self.side + cell[middle]) * self.side + cell[fast];
        (inside(cell[0]) && inside(cell[1]) && inside(cell[2])).then_some((number as usize, cell))
    }

    /// The voxel at `local` in `brick`; `None` if that is not one of the block's.
    #[inline(always)]
    pub(super) fn place(&self, brick: BrickKey, local: u16) -> Option<Place> {
        let first = [0, 1, 2].map(|a| (brick.0[a] - self.lowest[a]) * BRICK_EDGE + self.radius);
        let (cell, _) = self.cell_of(first, local)?;
        Some(Place { cell, at: usize::from(self.before[cell]) })
    }

    #[inline(always)]
    pub(super) fn weight(&self, place: Place) -> f32 {
        self.weights[place.at]
    }

    /// Shows `see` the voxels around that at `place`, [`LANES`] at a time.
    #[inline(always)]
    pub(super) fn visit(&mut self, place: Place, mut see: impl FnMut(&Self, Cells)) {
        let (slab, column) = ((self.side * self.side) as usize, self.side as usize);
        let radius = self.radius as usize;
        let [x, y, z] = [0, 1, 2].map(|i| Vec4::splat(self.points[i][place.at]));
        let height = self.heights[place.at];
        // A voxel is no neighbour of itself.
        self.heights[place.at] = f32::INFINITY;
        let (own, reach) = (Vec4::splat(height), Vec4::splat(radius as f32));
        let (mut low, mut high) =
            (place.cell - radius * (slab + column + 1), place.cell + radius * (column + 1) + 1 - radius * slab);
        for _ in 0..2 * radius + 1 {
            let (mut start, end) = (usize::from(self.before[low]), usize::from(self.before[high]));
            while start < end {
                let dx = x - Vec4::from_slice(&self.points[0][start..]);
                let dy = y - Vec4::from_slice(&self.points[1][start..]);
                let dz = z - Vec4::from_slice(&self.points[2][start..]);
                let within = (Vec4::from_slice(&self.heights[start..]) - own).abs().cmple(reach);
                let listed = Vec4::splat((end - start) as f32).cmpgt(Vec4::new(0.0, 1.0, 2.0, 3.0));
                let squares = dx * dx + dy * dy + dz * dz;
                see(self, Cells { start, mask: within & listed, step: [dx, dy, dz], squares });
                start += LANES;
            }
            (low, high) = (low + slab, high + slab);
        }
        self.heights[place.at] = height;
    }

    #[inline(always)]
    pub(super) fn weights(&self, cells: &Cells) -> Vec4 {
        Vec4::from_slice(&self.weights[cells.start..])
    }

    /// How far the voxel is off the planes through `cells`, voxels.
    #[inline(always)]
    pub(super) fn heights_over(&self, cells: &Cells) -> Vec4 {
        let [x, y, z] = self.normals(cells);
        cells.step[0] * x + cells.step[1] * y + cells.step[2] * z
    }

    /// Cosines between the normals of `cells` and that of the voxel at `place`.
    #[inline(always)]
    pub(super) fn cosines(&self, place: Place, cells: &Cells) -> Vec4 {
        let [x, y, z] = self.normals(cells);
        x * self.normals[0][place.at] + y * self.normals[1][place.at] + z * self.normals[2][place.at]
    }

    #[inline(always)]
    fn normals(&self, cells: &Cells) -> [Vec4; 3] {
        let [xs, ys, zs] = &self.normals;
        let start = cells.start;
        [Vec4::from_slice(&xs[start..]), Vec4::from_slice(&ys[start..]), Vec4::from_slice(&zs[start..])]
    }
}
