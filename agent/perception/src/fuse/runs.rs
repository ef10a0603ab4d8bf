//! Where a view's pixels fall: runs of neighbouring pixels that lie in the same brick, in the order of the bricks.
//!
//! A row of pixels crosses a brick in a handful of samples, so runs are sorted in place of samples: ten times fewer.
//! Their order (brick, pixel) is what makes fusion independent of the number of threads.

use super::keys::{BRICK_EDGE, BrickKey, pack_brick};
use super::labelled_view::LabelledView;
use nalgebra::Isometry3;
use rayon::prelude::*;

/// Largest distance of a sample from the table's origin in voxels; what fits the address space with room to spare.
const FARTHEST: f32 = 1_000_000.0;

/// Neighbouring pixels of one row in one brick; those without depth among them count as not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// Packed brick address.
    pub(super) brick: u64,
    /// First pixel.
    pub(super) start: u32,
    /// Number of pixels.
    pub(super) len: u32,
}

/// Puts pixels into voxels. In single precision relative to the camera, whose own place is kept as a whole number of
/// voxels and a rest: an error of 1e-4 voxels a metre away at half-millimetre voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placer {
    /// Table from camera, times voxels a metre.
    turn: [[f32; 3]; 3],
    rest: [f32; 3],
    whole: [i32; 3],
    inverse_focal: [f32; 2],
    centre: [f32; 2],
    width: u32,
}

/// A pixel's ray at depth 1.
pub(super) type Ray = [f32; 2];

impl Placer {
    /// `None` if the camera is too far away for any voxel to have an address.
    pub(super) fn new(view: &LabelledView, edge: f64) -> Option<Self> {
        let k = view.cloud.intrinsics;
        let Isometry3 { rotation, translation } = view.table_from_camera;
        let turn = rotation.to_rotation_matrix().into_inner() / edge;
        let camera = translation.vector / edge;
        let whole = camera.map(f64::floor);
        (camera.iter().all(|c| c.abs() < f64::from(FARTHEST)) && turn.iter().all(|t| t.is_finite())).then(|| Self {
            turn: std::array::from_fn(|r| std::array::from_fn(|c| turn[(r, c)] as f32)),
            rest: std::array::from_fn(|i| (camera[i] - whole[i]) as f32),
            whole: std::array::from_fn(|i| whole[i] as i32),
            inverse_focal: [1.0 / k.fx as f32, 1.0 / k.fy as f32],
            centre: [k.cx as f32, k.cy as f32],
            width: k.width,
        })
    }

    /// Ray of the pixel in column `u` and row `v`.
    #[inline]
    pub(super) fn ray(&self, u: u32, v: u32) -> Ray {
        [(u as f32 - self.centre[0]) * self.inverse_focal[0], (v as f32 - self.centre[1]) * self.inverse_focal[1]]
    }

    /// Column and row of pixel `i`.
    pub(super) fn column_and_row(&self, i: u32) -> (u32, u32) {
        (i % self.width, i / self.width)
    }

    /// The point at depth `z` on `ray`, in voxels from the lowest corner of the camera's voxel.
    #[inline]
    fn point(&self, ray: Ray, z: f32) -> [f32; 3] {
        let (x, y) = (ray[0] * z, ray[1] * z);
        std::array::from_fn(|r| self.turn[r][0] * x + self.turn[r][1] * y + self.turn[r][2] * z + self.rest[r])
    }

    /// Voxel of the point at depth `z` on `ray`, and the point in voxels from that voxel's lowest corner.
    #[inline]
    pub(super) fn place(&self, ray: Ray, z: f32) -> Option<([i32; 3], [f32; 3])> {
        let p = self.point(ray, z);
        if !p.iter().all(|c| c.abs() < FARTHEST) {
            return None;
        }
        // Rounding towards zero is one instruction, rounding down a call.
        let lowest: [i32; 3] = p.map(|c| {
            let whole = c as i32;
            whole - i32::from((whole as f32) > c)
        });
        let offset = std::array::from_fn(|i| p[i] - lowest[i] as f32);
        Some((std::array::from_fn(|i| lowest[i] + self.whole[i]), offset))
    }

    /// The brick at the address `brick` as a box of points from [`Self::point`]: lowest corner, in it, and highest, not.
    fn bounds(&self, brick: [i32; 3]) -> [[f32; 3]; 2] {
        let low = std::array::from_fn(|i| brick[i] * BRICK_EDGE - self.whole[i]);
        [low.map(|c| c as f32), low.map(|c| (c + BRICK_EDGE) as f32)]
    }

    /// A camera-frame direction in the table frame, scaled by voxels a metre.
    #[inline]
    pub(super) fn turned(&self, n: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|r| self.turn[r][0] * n[0] + self.turn[r][1] * n[1] + self.turn[r][2] * n[2])
    }
}

/// Every pixel that has depth and an address, as runs in (brick, pixel) order.
pub(super) fn sorted_runs(view: &LabelledView, placer: &Placer) -> Vec<Run> {
    let width = view.cloud.intrinsics.width.max(1) as usize;
    // In place, not in a function of its own: that takes four times as long.
    let row_runs = |(v, row): (usize, &[f32])| {
        let mut runs: Vec<Run> = Vec::new();
        // The box of the run under way; most pixels lie in it.
        let [mut low, mut high] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for (u, &z) in row.iter().enumerate() {
            if z <= 0.0 {
                continue;
            }
            let i = (v * width + u) as u32;
            let ray = placer.ray(u as u32, v as u32);
            let p = placer.point(ray, z);
            if (0..3).all(|a| p[a] >= low[a] && p[a] < high[a])
                && let Some(run) = runs.last_mut()
            {
                run.len = i + 1 - run.start;
                continue;
            }
            let Some((voxel, _)) = placer.place(ray, z) else { continue };
            let BrickKey(at) = BrickKey::containing(voxel);
            let Some(brick) = pack_brick(at) else { continue };
            runs.push(Run { brick, start: i, len: 1 });
            [low, high] = placer.bounds(at);
        }
        runs
    };
    let by_row: Vec<Vec<Run>> = view.cloud.smooth.par_chunks(width).enumerate().map(row_runs).collect();
    let mut runs = by_row.concat();
    runs.par_sort_unstable_by_key(|r| (r.brick, r.start));
    runs
}
