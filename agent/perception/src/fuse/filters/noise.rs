//! Noisy doubles: what a voxel map makes of noisy pixels.
//!
//! They miss the voxel of their surface and found one of their own beside it, where nothing averages them. Such a voxel is
//! known by its small weight next to heavy ones and by lying off their surface by no more than its own noise explains. A
//! second surface that was measured well is neither.

use super::outlier_filter::OutlierFilter;
use super::surroundings::{Cells, Place, Surroundings};
use glam::{BVec4A, Vec4};

/// Neighbours farther than this, in voxels, do not speak of the surface at a voxel.
const NEAR: f32 = 2.0;
/// Fewest heavy neighbours that make a surface.
const SURFACE: f32 = 2.0;
/// Standard deviations that noise explains.
const EXPLAINED: f32 = 5.0;

/// What makes a voxel a noisy double.
#[derive(Clone, Copy, Debug)]
pub(super) struct Suspicion {
    /// Neighbours of at least this weight speak of the surface; infinite where the voxel is above suspicion.
    heavy: f32,
    /// Distances that its own noise explains, voxels.
    explained: f32,
}

impl Suspicion {
    /// Of a voxel of weight `weight`; `unit_sigma` is the deviation of one of weight 1, voxels.
    #[inline(always)]
    pub(super) fn of(weight: f32, filter: &OutlierFilter, unit_sigma: f32) -> Self {
        let explained = EXPLAINED * unit_sigma / weight.sqrt();
        let heavy = if explained > filter.off_surface { filter.heavier * weight } else { f32::INFINITY };
        Self { heavy, explained }
    }

    /// Which of `cells`, of weights `weights`, speak of the surface.
    #[inline(always)]
    pub(super) fn asks(&self, cells: &Cells, weights: Vec4) -> BVec4A {
        cells.mask & weights.cmpge(Vec4::splat(self.heavy)) & cells.squares.cmplt(Vec4::splat(NEAR * NEAR))
    }

    /// Whether the voxel at `place` doubles the surface that its heavy neighbours make; `asked` of them speak of it.
    pub(super) fn holds(&self, around: &mut Surroundings, place: Place, asked: f32, off_surface: f32) -> bool {
        if asked < SURFACE {
            return false;
        }
        let [mut count, mut weight, mut off] = [Vec4::ZERO; 3];
        around.visit(place, |around, cells| {
            let weights = around.weights(&cells);
            let facing = around.cosines(place, &cells).cmpgt(Vec4::splat(0.5));
            let asked = self.asks(&cells, weights) & facing;
            count += Vec4::select(asked, Vec4::ONE, Vec4::ZERO);
            weight += Vec4::select(asked, weights, Vec4::ZERO);
            off += Vec4::select(asked, weights * around.heights_over(&cells), Vec4::ZERO);
        });
        let off = (off.element_sum() / weight.element_sum()).abs();
        count.element_sum() >= SURFACE && off > off_surface && off < self.explained
    }
}
