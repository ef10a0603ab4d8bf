//! Corrections of colours that make them meet where charts do.
//!
//! Each chart has the light and the exposure of its own photograph. As in [Lempitsky 2007] and [Waechter 2014], section 3.2, a
//! correction is sought for each vertex of each chart (a node), such that corrected colours are the same on both sides of a seam
//! and that the correction changes little within a chart:
//!
//! `sum over seams (f_a + g_a - f_b - g_b)^2 + SMOOTH sum over edges (g_i - g_j)^2 + ANCHOR sum over nodes (f_i + g_i - m_i)^2`
//!
//! The last term is ours: `m` is the mean colour of the vertex over all photographs that show it. It decides what seams leave open,
//! how bright the whole is, and it takes from broad highlights and shadows, which lie elsewhere in each photograph; details, which
//! are much smaller than `sqrt(SMOOTH / ANCHOR)` edges, stay as the photograph has them. With it the matrix is positive definite,
//! and conjugate gradients solve it for each channel ([Hestenes 1952], preconditioned by the diagonal).

use rayon::prelude::*;

/// Weight of changes within a chart.
const SMOOTH: f64 = 0.2;
/// Weight of the mean colour.
const ANCHOR: f64 = 0.01;
/// Residual, as part of the right side, at which the system is solved, and most steps until then.
const RESIDUAL: f64 = 1e-4;
const MOST_STEPS: usize = 1000;

/// Two nodes at one place of a seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seam {
    /// Their numbers.
    pub(crate) nodes: [usize; 2],
    /// Colour of the second less that of the first.
    pub(crate) difference: [f64; 3],
}

/// What corrections are sought for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unlevelled {
    pub(crate) seams: Vec<Seam>,
    /// Nodes that are corners of a side within a chart; a side of two faces may stand twice.
    pub(crate) edges: Vec<[usize; 2]>,
    /// Mean colour of each node less its own; `None` where it is not known.
    pub(crate) off_mean: Vec<Option<[f64; 3]>>,
}

/// The correction of each node, in levels.
pub(crate) fn level_seams(unlevelled: &Unlevelled) -> Vec<[f32; 3]> {
    let Unlevelled { seams, edges, off_mean } = unlevelled;
    let count = off_mean.len();
    let pairs = seams.iter().map(|seam| (seam.nodes, 1.0)).chain(edges.iter().map(|edge| (*edge, SMOOTH)));
    // Where a mean is not known, the correction itself shall be small.
    let matrix = Matrix::of(count, pairs.collect(), ANCHOR);
    let channels: Vec<Vec<f64>> = (0..3)
        .into_par_iter()
        .map(|channel| {
            let mut right: Vec<f64> = off_mean.iter().map(|off| ANCHOR * off.map_or(0.0, |off| off[channel])).collect();
            for Seam { nodes: [a, b], difference } in seams {
                right[*a] += difference[channel];
                right[*b] -= difference[channel];
            }
            matrix.solve(&right)
        })
        .collect();
    (0..count).map(|node| [0, 1, 2].map(|channel| channels[channel][node] as f32)).collect()
}

/// A symmetric positive definite matrix: a weighted graph's Laplacian and a multiple of the identity.
struct Matrix {
    starts: Vec<usize>,
    /// Node and weight of the neighbours of each node in turn.
    others: Vec<(usize, f64)>,
    diagonal: Vec<f64>,
}

impl Matrix {
    fn of(count: usize, pairs: Vec<([usize; 2], f64)>, identity: f64) -> Self {
        let mut starts = vec![0; count + 1];
        for [a, b] in pairs.iter().map(|pair| pair.0) {
            starts[a + 1] += 1;
            starts[b + 1] += 1;
        }
        for node in 0..count {
            starts[node + 1] += starts[node];
        }
        let mut next = starts.clone();
        let mut others = vec![(0, 0.0); 2 * pairs.len()];
        let mut diagonal = vec![identity; count];
        for ([a, b], weight) in pairs {
            for (from, to) in [(a, b), (b, a)] {
                others[next[from]] = (to, weight);
                next[from] += 1;
                diagonal[from] += weight;
            }
        }
        Self { starts, others, diagonal }
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let row = |node: usize| {
            let others = &self.others[self.starts[node]..self.starts[node + 1]];
            self.diagonal[node] * x[node] - others.iter().map(|(other, weight)| weight * x[*other]).sum::<f64>()
        };
        (0..x.len()).into_par_iter().with_min_len(4096).map(row).collect()
    }

    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; right.len()];
        let mut residual = right.to_vec();
        let preconditioned =
            |residual: &[f64]| -> Vec<f64> { residual.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect() };
        let mut z = preconditioned(&residual);
        let mut direction = z.clone();
        let mut product = dot(&residual, &z);
        let enough = RESIDUAL * RESIDUAL * dot(right, right);
        for _ in 0..MOST_STEPS {
            if dot(&residual, &residual) <= enough {
                break;
            }
            let image = self.times(&direction);
            let step = product / dot(&direction, &image);
            x.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
            residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
            z = preconditioned(&residual);
            let before = std::mem::replace(&mut product, dot(&residual, &z));
            let share = product / before;
            direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
        }
        x
    }
}

/// In order, so that the sum does not depend on threads.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two strips of `n` nodes side by side: the second one is 40 levels brighter where they meet.
    fn strips(n: usize, off_mean: impl Fn(usize) -> Option<[f64; 3]>) -> Unlevelled {
        let edges = (0..2 * n).filter(|i| i % n + 1 < n).map(|i| [i, i + 1]).collect();
        let seams = vec![Seam { nodes: [n - 1, n], difference: [40.0, 0.0, -8.0] }];
        Unlevelled { seams, edges, off_mean: (0..2 * n).map(off_mean).collect() }
    }

    #[test]
    fn colors_meet_at_the_seam_and_change_little_elsewhere() {
        let n = 200;
        let corrections = level_seams(&strips(n, |_| Some([0.0; 3])));
        let jump = 40.0 + corrections[n][0] - corrections[n - 1][0];
        assert!(jump.abs() < 4.0, "{jump} of 40 levels are left");
        assert!((corrections[n][2] - corrections[n - 1][2] - 8.0).abs() < 1.0 && corrections[n][1].abs() < 1e-3);
        assert!(corrections[0][0].abs() < 0.1, "far away nothing changes: {}", corrections[0][0]);
        assert!(
            corrections.windows(2).enumerate().all(|(i, pair)| i == n - 1 || (pair[0][0] - pair[1][0]).abs() < 6.0)
        );
    }

    #[test]
    fn broad_errors_are_taken_away_and_details_stay() {
        let n = 400;
        let wave = |i: usize, period: f64| 30.0 * (std::f64::consts::TAU * i as f64 / period).sin();
        let mut unlevelled = strips(n, |i| Some([wave(i, 200.0), wave(i, 4.0), 0.0]));
        unlevelled.seams.clear();
        let corrections = level_seams(&unlevelled);
        let greatest = |channel: usize| corrections[50..350].iter().map(|c| c[channel].abs()).fold(0.0, f32::max);
        assert!(greatest(0) > 27.0, "a broad highlight goes: {}", greatest(0));
        assert!(greatest(1) < 1.5, "a print stays: {}", greatest(1));
    }
}
