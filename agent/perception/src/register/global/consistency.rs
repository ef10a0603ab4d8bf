//! Which of many doubtful pairs of points belong to one rigid motion.
//!
//! Two pairs can belong together only if their points are equally far apart in both clouds. Pairs are ranked by how
//! many others are compatible with both of two compatible ones (SC2-PCR, [Chen 2022]): wrong pairs agree by chance with
//! some, but hardly with the same ones. Motions are drawn at random from well supported pairs, so that the seed counts.

use crate::register::rigid;
use nalgebra::{Isometry3, Point3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// A point of each cloud, with normals, that may be the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) source: Point3<f64>,
    pub(super) target: Point3<f64>,
    pub(super) source_normal: Vector3<f64>,
    pub(super) target_normal: Vector3<f64>,
}

/// A motion and how many candidates follow it.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub(super) target_from_source: Isometry3<f64>,
    pub(super) support: usize,
}

/// How far things may be off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    /// Metres.
    pub(super) distance: f64,
    /// Between products of normals.
    pub(super) normal: f64,
    /// Whether the normals' signs count.
    pub(super) oriented: bool,
}

/// Pairs of one hypothesis.
const MEMBERS: usize = 12;
/// Rounds of fitting a motion to those who follow it.
const ROUNDS: usize = 4;

/// Up to `keep` motions, best supported first, no two of them the same. `draws` of them are tried.
pub(super) fn motions(
    candidates: &[Candidate],
    tolerance: Tolerance,
    draws: usize,
    keep: usize,
    rng: &mut Pcg64,
) -> Vec<Hypothesis> {
    let graph = Graph::new(candidates, tolerance);
    let mut seeds = graph.drawn(draws, rng);
    seeds.dedup();
    let mut found: Vec<Hypothesis> = seeds
        .par_iter()
        .filter_map(|seed| {
            let members = graph.members(*seed);
            let pairs: Vec<_> = members.iter().map(|i| (candidates[*i].source, candidates[*i].target)).collect();
            improve(candidates, rigid::fit(&pairs)?, tolerance)
        })
        .collect();
    found.sort_by_key(|h| std::cmp::Reverse(h.support));
    let mut out: Vec<Hypothesis> = Vec::new();
    for h in found {
        if out.len() == keep {
            break;
        }
        let spread = candidates.iter().map(|c| c.source.coords.norm()).fold(0.0, f64::max);
        if !out.iter().any(|o| same(&o.target_from_source, &h.target_from_source, 3.0 * tolerance.distance, spread)) {
            out.push(h);
        }
    }
    out
}

/// Whether two motions differ by less than `distance` anywhere within `reach` of the origin.
fn same(a: &Isometry3<f64>, b: &Isometry3<f64>, distance: f64, reach: f64) -> bool {
    let between = a.inverse() * b;
    between.translation.vector.norm() + between.rotation.angle() * reach < distance
}

/// Fits a motion to the candidates that follow it, until they stay the same.
fn improve(candidates: &[Candidate], first: Isometry3<f64>, tolerance: Tolerance) -> Option<Hypothesis> {
    let mut best = Hypothesis { target_from_source: first, support: 0 };
    let mut motion = first;
    for _ in 0..ROUNDS {
        let followers: Vec<_> = candidates
            .iter()
            .filter(|c| {
                let agree = (motion.rotation * c.source_normal).dot(&c.target_normal);
                let agree = if tolerance.oriented { agree } else { agree.abs() };
                (motion * c.source - c.target).norm() < tolerance.distance && agree > 1.0 - tolerance.normal
            })
            .map(|c| (c.source, c.target))
            .collect();
        if followers.len() <= best.support {
            break;
        }
        best = Hypothesis { target_from_source: motion, support: followers.len() };
        motion = rigid::fit(&followers)?;
    }
    (best.support >= 3).then_some(best)
}

/// Which candidates are compatible, as rows of bits.
struct Graph {
    rows: Vec<Vec<u64>>,
    degrees: Vec<u32>,
}

impl Graph {
    fn new(candidates: &[Candidate], tolerance: Tolerance) -> Self {
        let rows: Vec<Vec<u64>> = candidates
            .par_iter()
            .map(|a| {
                let mut row = vec![0_u64; candidates.len().div_ceil(64)];
                for (j, b) in candidates.iter().enumerate() {
                    if compatible(a, b, tolerance) {
                        row[j / 64] |= 1 << (j % 64);
                    }
                }
                row
            })
            .collect();
        let degrees = rows.iter().map(|r| r.iter().map(|w| w.count_ones()).sum()).collect();
        Self { rows, degrees }
    }

    /// `n` candidates, sorted, each as likely as it has compatible others, squared.
    fn drawn(&self, n: usize, rng: &mut Pcg64) -> Vec<usize> {
        let mut sum = 0.0;
        let sums: Vec<f64> = self
            .degrees
            .iter()
            .map(|d| {
                sum += f64::from(*d).powi(2);
                sum
            })
            .collect();
        if sum <= 0.0 {
            return Vec::new();
        }
        let mut out: Vec<usize> =
            (0..n).map(|_| rng.random_range(0.0..sum)).map(|at| sums.partition_point(|s| *s <= at)).collect();
        out.retain(|i| *i < self.rows.len());
        out.sort_unstable();
        out
    }

    /// The candidate itself and those compatible ones that share most others with it.
    fn members(&self, seed: usize) -> Vec<usize> {
        let row = &self.rows[seed];
        let set = |i: usize| row[i / 64] >> (i % 64) & 1 == 1;
        let common = |i: usize| -> u32 { self.rows[i].iter().zip(row).map(|(a, b)| (a & b).count_ones()).sum() };
        let mut others: Vec<(u32, usize)> = (0..self.rows.len()).filter(|i| set(*i)).map(|i| (common(i), i)).collect();
        others.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        std::iter::once(seed).chain(others.into_iter().take(MEMBERS).map(|o| o.1)).collect()
    }
}

/// Whether two candidates can belong to one motion.
fn compatible(a: &Candidate, b: &Candidate, tolerance: Tolerance) -> bool {
    let (s, t) = (b.source - a.source, b.target - a.target);
    let (ls, lt) = (s.norm(), t.norm());
    // Neighbours agree whatever the motion is.
    if (ls - lt).abs() > tolerance.distance || ls.min(lt) < 4.0 * tolerance.distance {
        return false;
    }
    let close = |x: f64, y: f64| {
        let off = if tolerance.oriented { x - y } else { x.abs() - y.abs() };
        off.abs() < tolerance.normal
    };
    close(a.source_normal.dot(&b.source_normal), a.target_normal.dot(&b.target_normal))
        && close(a.source_normal.dot(&s) / ls, a.target_normal.dot(&t) / lt)
        && close(b.source_normal.dot(&s) / ls, b.target_normal.dot(&t) / lt)
}
