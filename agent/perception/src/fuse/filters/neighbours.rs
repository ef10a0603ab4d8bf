//! Radius and statistical filter (as in PCL, [Rusu 2011]): a voxel with few neighbours, or whose nearest neighbours are
//! farther away than usual, is a stray.

use glam::{Vec4, Vec4Swizzles};
use rayon::prelude::*;

/// Most nearest neighbours that count.
pub(super) const MOST_NEIGHBOURS: usize = 16;

/// Squared distances of the nearest neighbours in each lane, in order; one that is missing counts as if it sat just
/// outside the radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest<const N: usize>([Vec4; N]);

impl<const N: usize> Nearest<N> {
    pub(super) fn none(radius: i32) -> Self {
        Self([Vec4::splat(((radius + 1) * (radius + 1)) as f32); N])
    }

    /// Notes a neighbour a lane. Without a branch: whether one is among the nearest cannot be foreseen.
    #[inline(always)]
    pub(super) fn see(&mut self, squares: Vec4) {
        let mut moving = squares;
        for place in &mut self.0 {
            (*place, moving) = (place.min(moving), place.max(moving));
        }
    }

    /// Mean distance of the nearest `n`, voxels.
    #[inline(always)]
    pub(super) fn mean(mut self, n: usize) -> f32 {
        self.join(Vec4::zwxy);
        self.join(Vec4::yxwz);
        self.0.iter().take(n).map(|square| square.x.sqrt()).sum::<f32>() / n as f32
    }

    /// Makes the nearest of each lane those of it and the lane that `swap` puts in its place, by a bitonic merge
    /// [Batcher 1968].
    #[inline(always)]
    fn join(&mut self, swap: impl Fn(Vec4) -> Vec4) {
        let before = self.0;
        for (place, other) in self.0.iter_mut().zip(before.iter().rev()) {
            *place = place.min(swap(*other));
        }
        let mut half = N / 2;
        while half > 0 {
            for i in (0..N).filter(|i| i & half == 0) {
                let [near, far] = [self.0[i], self.0[i + half]];
                (self.0[i], self.0[i + half]) = (near.min(far), near.max(far));
            }
            half /= 2;
        }
    }
}

/// The distance above which a voxel is a stray: mean and standard deviation of all. `groups` are summed one by one, so that
/// the limit is the same on any number of threads.
pub(super) fn limit<T: Sync>(groups: &[T], distances: impl Fn(&T) -> &[f32] + Sync, deviations: f64) -> f32 {
    let sum = |of: &(dyn Fn(f64) -> f64 + Sync)| -> f64 {
        let known = |group: &T| {
            let known = distances(group).iter().filter(|d| !d.is_nan());
            known.map(|d| of(f64::from(*d))).sum::<f64>()
        };
        groups.par_iter().map(known).collect::<Vec<_>>().into_iter().sum()
    };
    let count = sum(&|_| 1.0).max(1.0);
    let mean = sum(&|d| d) / count;
    let variance = sum(&|d| (d - mean) * (d - mean)) / count;
    (mean + deviations * variance.sqrt()) as f32
}
