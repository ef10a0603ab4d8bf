//! Axis and angles together: what the search found on its grids, made exact by all pairs of views that share much.
//!
//! A pattern search over the place of the axis (its direction is that of the plane, which thousands of pixels tell better
//! than any part does), a common factor of all angles (which a wrong place is nearly
//! balanced by) and each angle. The last view meets the first by the pairs that close the turn.

use super::Axis;
use super::profile::{Turning, pair_score};
use super::thinned::TurningView;
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;

/// Largest angle between two views that are compared, radians: beyond it they share little.
const FARTHEST: f64 = 1.9;
/// First steps: metres, factor, radians of a view; and how often they are halved.
const STEPS: (f64, f64, f64) = (4e-3, 0.03, 0.035);
const HALVINGS: u32 = 5;
/// Most rounds with one size of steps.
const ROUNDS: usize = 6;

/// A motion of the axis and of all angles.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// Metres across the axis, in two directions.
    Shift(f64, f64),
    /// Share by which all angles grow.
    Scale(f64),
}

/// The axis and the angles (of the views that have one) at which all pairs agree best, and their score. Where the angles
/// are known (`fixed`) the axis alone moves.
pub(super) fn refine(
    views: &[TurningView],
    points: &[Vec<Turning>],
    changes: &[bool],
    mut axis: Axis,
    mut angles: Vec<Option<f64>>,
    fixed: bool,
) -> (Axis, Vec<Option<f64>>, f64) {
    let placed: Vec<usize> = (0..angles.len()).filter(|i| angles[*i].is_some()).collect();
    let pairs: Vec<(usize, usize)> = placed
        .iter()
        .flat_map(|i| placed.iter().filter(move |j| *j > i).map(move |j| (*i, *j)))
        .filter(|(i, j)| between(angles[*i], angles[*j]).is_some_and(|turn| turn.abs() < FARTHEST))
        .collect();
    let pair = |axis: &Axis, angles: &[Option<f64>], &(i, j): &(usize, usize)| -> f64 {
        let turn = between(angles[i], angles[j]).unwrap_or(0.0);
        pair_score((&views[i], &points[i]), (&views[j], &points[j]), changes, axis, turn)
    };
    let all = |axis: &Axis, angles: &[Option<f64>]| -> f64 {
        let scores: Vec<f64> = pairs.par_iter().map(|p| pair(axis, angles, p)).collect();
        scores.iter().sum()
    };
    let mut best = all(&axis, &angles);
    let (mut shift, mut scale, mut single) = STEPS;
    for _ in 0..HALVINGS {
        for _ in 0..ROUNDS {
            let before = best;
            for change in [
                Change::Shift(shift, 0.0),
                Change::Shift(-shift, 0.0),
                Change::Shift(0.0, shift),
                Change::Shift(0.0, -shift),
                Change::Scale(scale),
                Change::Scale(-scale),
            ] {
                if fixed && matches!(change, Change::Scale(_)) {
                    continue;
                }
                let (moved, turned) = changed(&axis, &angles, change);
                let score = all(&moved, &turned);
                if score > best {
                    (best, axis, angles) = (score, moved, turned);
                }
            }
            // Each view's own angle touches its pairs alone.
            for &i in placed.iter().filter(|_| !fixed) {
                let own: Vec<(usize, usize)> = pairs.iter().filter(|(a, b)| *a == i || *b == i).copied().collect();
                let of = |angles: &[Option<f64>]| own.iter().map(|p| pair(&axis, angles, p)).sum::<f64>();
                let mut here = of(&angles);
                for way in [single, -single] {
                    let mut turned = angles.clone();
                    turned[i] = turned[i].map(|a| a + way);
                    let there = of(&turned);
                    if there > here {
                        (best, here, angles) = (best + there - here, there, turned);
                    }
                }
            }
            if best < before + 1e-3 {
                break;
            }
        }
        (shift, scale, single) = (0.5 * shift, 0.5 * scale, 0.5 * single);
    }
    (axis, angles, best / pairs.len().max(1) as f64)
}

/// From `a` to `b`, within half a turn.
fn between(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    let half = std::f64::consts::PI;
    Some((b? - a? + half).rem_euclid(2.0 * half) - half)
}

fn changed(axis: &Axis, angles: &[Option<f64>], change: Change) -> (Axis, Vec<Option<f64>>) {
    let direction = axis.direction;
    let x = Unit::try_new(Vector3::x() - direction.into_inner() * direction.x, 1e-6).unwrap_or(Vector3::y_axis());
    let y = direction.cross(&x);
    let mut axis = *axis;
    let mut factor = 1.0;
    match change {
        Change::Shift(a, b) => axis.point += x.into_inner() * a + y * b,
        Change::Scale(share) => factor += share,
    }
    (axis, angles.iter().map(|a| a.map(|a| a * factor)).collect())
}
