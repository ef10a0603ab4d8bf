//! The sums that one linearisation of residuals leaves: normal equations, robust cost, and how far the residuals scatter.
//!
//! Geometric residuals (`correspondences`) and photometric ones (`photometric`) have the same form, a scalar `r` with the
//! row `J = [m x n, n]` over a twist about a centre, and share it. Terms are f32, sums f64.

use nalgebra::{Matrix6, Point3, Vector6};
use rayon::prelude::*;
use std::ops::Range;

/// Points of one task: fixed, so that sums do not depend on the number of threads.
const BLOCK: usize = 4096;
/// Bins of the residual histogram.
pub(super) const BINS: usize = 512;
/// Neighbours in a row of the picture whose residuals are compared.
pub(super) const RUN: usize = 16;

/// The objective around the current pose, as normal equations over a twist (rotation, translation) of the source about
/// `centre`, in the target's frame.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// `sum w J'J`.
    pub hessian: Matrix6<f64>,
    /// `sum w J'r`.
    pub gradient: Vector6<f64>,
    /// Sum of weights.
    pub weight: f64,
    /// Pairs within the gate, whatever their residual.
    pub pairs: u32,
    /// `sum min(r^2, tukey^2)` over all source points; those without a pair count as outside.
    pub truncated_cost: f64,
    /// So many neighbouring points share their error and count as one witness; 1 if all are independent.
    pub correlation: f64,
    /// Standard deviation of the residuals, from the median of their absolute values, metres; 0 without pairs.
    pub sigma: f64,
    /// Centre of the twist in the target's frame.
    pub centre: Point3<f64>,
}

/// Sums over the residuals of a block of points.
pub(super) struct Sums {
    hessian: [f64; 21],
    gradient: [f64; 6],
    weight: f64,
    pub(super) cost: f64,
    pub(super) pairs: u32,
    pub(super) histogram: Vec<u32>,
    /// Squares of the sums of runs over their lengths, and squares of single residuals: equal where errors are
    /// independent, apart by the length of the run where all in it err alike.
    pub(super) of_runs: [f64; 2],
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            hessian: [0.0; 21],
            gradient: [0.0; 6],
            weight: 0.0,
            cost: 0.0,
            pairs: 0,
            histogram: vec![0; BINS],
            of_runs: [0.0; 2],
        }
    }
}

impl Sums {
    /// The sums over `points` residuals, `block` by block on all threads, added in order.
    pub(super) fn over(points: usize, block: impl Fn(Range<usize>) -> Self + Sync) -> Self {
        let blocks: Vec<Self> = (0..points.div_ceil(BLOCK))
            .into_par_iter()
            .map(|b| block(b * BLOCK..((b + 1) * BLOCK).min(points)))
            .collect();
        let mut total = Self::default();
        for block in &blocks {
            total.add(block);
        }
        total
    }

    #[inline]
    pub(super) fn push(&mut self, j: &[f32; 6], w: f32, r: f32, outside: f64) {
        let mut k = 0;
        for a in 0..6 {
            let wj = w * j[a];
            for jb in &j[a..] {
                self.hessian[k] += f64::from(wj * jb);
                k += 1;
            }
            self.gradient[a] += f64::from(wj * r);
        }
        self.weight += f64::from(w);
        self.cost += f64::from(r * r) - outside;
    }

    fn add(&mut self, other: &Self) {
        self.hessian.iter_mut().zip(&other.hessian).for_each(|(a, b)| *a += b);
        self.gradient.iter_mut().zip(&other.gradient).for_each(|(a, b)| *a += b);
        self.histogram.iter_mut().zip(&other.histogram).for_each(|(a, b)| *a += b);
        self.of_runs.iter_mut().zip(&other.of_runs).for_each(|(a, b)| *a += b);
        self.weight += other.weight;
        self.cost += other.cost;
        self.pairs += other.pairs;
    }

    pub(super) fn finish(self, centre: Point3<f64>, range: f64) -> Linearised {
        let mut hessian = Matrix6::zeros();
        let mut k = 0;
        for a in 0..6 {
            for b in a..6 {
                hessian[(a, b)] = self.hessian[k];
                hessian[(b, a)] = self.hessian[k];
                k += 1;
            }
        }
        Linearised {
            hessian,
            gradient: Vector6::from_column_slice(&self.gradient),
            weight: self.weight,
            pairs: self.pairs,
            truncated_cost: self.cost,
            // Alike along rows and columns: a patch of so many pixels has one error.
            correlation: (self.of_runs[0] / self.of_runs[1].max(f64::MIN_POSITIVE)).max(1.0).powi(2),
            sigma: 1.4826 * median_of(&self.histogram, self.pairs) * range / BINS as f64,
            centre,
        }
    }
}

/// Residuals of neighbours in a row.
#[derive(Default)]
pub(super) struct Run {
    sum: f64,
    squares: f64,
    count: f64,
}

impl Run {
    #[inline]
    pub(super) fn push(&mut self, r: f64) {
        self.sum += r;
        self.squares += r * r;
        self.count += 1.0;
    }

    pub(super) fn end(&mut self, of_runs: &mut [f64; 2]) {
        if self.count > 1.0 {
            of_runs[0] += self.sum * self.sum / self.count;
            of_runs[1] += self.squares / self.count;
        }
        *self = Self::default();
    }
}

/// Median of a histogram in bins, linear within the bin; 0 if it is empty.
fn median_of(histogram: &[u32], count: u32) -> f64 {
    let half = f64::from(count) / 2.0;
    let mut below = 0.0;
    for (i, &n) in histogram.iter().enumerate() {
        let n = f64::from(n);
        if n > 0.0 && below + n >= half {
            return i as f64 + (half - below) / n;
        }
        below += n;
    }
    0.0
}
