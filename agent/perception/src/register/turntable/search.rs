//! Where the axis is: the place at which neighbouring views agree best at some angle.

use super::plane::Stage;
use super::profile::{ANGLE_STEP, ANGLES, Turning, pair_score, profile, turning_points};
use super::thinned::TurningView;
use super::{Axis, TurntableConfig};
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;

/// Points of a view in the search for the axis.
const POINTS: usize = 350;
/// Most pairs of views that search for it.
const PAIRS: usize = 10;
/// Share of the radius to each side within which it is searched for.
const REACH: f64 = 0.6;
/// Steps to each side.
const STEPS: i32 = 6;
/// How often the grid is halved.
const HALVINGS: i32 = 4;
/// Places that are looked at closely, and how many steps they are apart at least.
const CANDIDATES: usize = 3;
const APART: f64 = 1.9;
/// Angles tried coarsely: every so many of a profile's.
const EVERY: usize = 2;

/// The places of the axis that suit the views of the stage best, the best first.
pub(super) fn find_axes(views: &[TurningView], stage: &Stage, config: &TurntableConfig) -> Vec<Stage> {
    if stage.known {
        return vec![stage.clone()];
    }
    let pairs = pairs(views.len());
    let points: Vec<Vec<Turning>> = views.par_iter().map(|v| turning_points(v, stage, 1.0 + REACH, POINTS)).collect();
    let normal = stage.axis.direction;
    let x = Unit::try_new(Vector3::x() - normal.into_inner() * normal.x, 1e-6).unwrap_or(Vector3::y_axis());
    let y = normal.cross(&x);
    let step = REACH * stage.radius / f64::from(STEPS);
    let total = |axis: &Axis, every: usize| -> f64 {
        pairs
            .iter()
            .map(|&(i, j)| {
                let (a, b) = ((&views[i], points[i].as_slice()), (&views[j], points[j].as_slice()));
                match config.step {
                    // The sense of rotation is the same for all pairs, but not known: that is for the chain to say.
                    Some(step) => {
                        let turn = step * (j as f64 - i as f64);
                        pair_score(a, b, &stage.changes, axis, turn).max(pair_score(a, b, &stage.changes, axis, -turn))
                    }
                    None if every == 1 => {
                        profile(a, b, &stage.changes, axis).into_iter().fold(f32::NEG_INFINITY, f32::max).into()
                    }
                    None => (0..ANGLES)
                        .step_by(every)
                        .map(|k| pair_score(a, b, &stage.changes, axis, k as f64 * ANGLE_STEP))
                        .fold(f64::NEG_INFINITY, f64::max),
                }
            })
            .sum()
    };
    let shifted = |axis: &Axis, a: i32, b: i32, step: f64| {
        let shift = x.into_inner() * (f64::from(a) * step) + y * (f64::from(b) * step);
        Axis { point: axis.point + shift, direction: normal }
    };
    let grid = |reach: i32| (-reach..=reach).flat_map(move |a| (-reach..=reach).map(move |b| (a, b)));
    let coarse: Vec<(f64, Axis)> = grid(STEPS)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(a, b)| shifted(&stage.axis, a, b, step))
        .map(|axis| (total(&axis, EVERY), axis))
        .collect();
    // The best places that are none of each other's slopes.
    let mut order: Vec<&(f64, Axis)> = coarse.iter().collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut peaks: Vec<(f64, Axis)> = Vec::new();
    for found in order {
        if peaks.len() < CANDIDATES && peaks.iter().all(|p| (p.1.point - found.1.point).norm() > APART * step) {
            peaks.push(*found);
        }
    }
    let refine = |(_, mut axis): (f64, Axis)| {
        let mut best = f64::NEG_INFINITY;
        for halving in 1..=HALVINGS {
            let step = step * 0.5_f64.powi(halving);
            let found = grid(1)
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|(a, b)| shifted(&axis, a, b, step))
                .map(|axis| (total(&axis, 1), axis))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some(found) = found {
                (best, axis) = found;
            }
        }
        Candidate { score: best, axis }
    };
    let mut candidates: Vec<Candidate> = peaks.into_iter().map(refine).collect();
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
    candidates.into_iter().map(|c| Stage { axis: c.axis, ..stage.clone() }).collect()
}

/// A place of the axis, and how well neighbours agree there.
struct Candidate {
    score: f64,
    axis: Axis,
}

/// Neighbours in the order of capture, and the last with the first; evenly chosen where they are many.
fn pairs(views: usize) -> Vec<(usize, usize)> {
    let all: Vec<(usize, usize)> = (0..views).map(|i| (i, (i + 1) % views)).collect();
    all.iter().step_by(views.div_ceil(PAIRS)).copied().collect()
}
