//! Which points of a chunk are held where there is no memory for all: every second, fourth, eighth, evenly over the surface.
//!
//! A model that is too large for a device is shown whole and thinner, not cut off. Points lie along a space-filling curve, of
//! which every second is taken; so it makes no difference whether a chunk is thinned at once or step by step.

use crate::morton::along_curve;
use semascan_model::SemanticCloud;

/// Halvings after which there are too few points to be of use.
pub const MOST_HALVINGS: u32 = 6;

/// Points that are left of so many.
pub fn points_after(points: usize, halvings: u32) -> usize {
    points.div_ceil(1 << halvings.min(MOST_HALVINGS))
}

/// A cloud that was halved `from` times, halved `to` times; it is left as it is unless that is more.
pub fn halved(cloud: &SemanticCloud, from: u32, to: u32) -> SemanticCloud {
    let (from, to) = (from.min(MOST_HALVINGS), to.min(MOST_HALVINGS));
    if to <= from {
        return cloud.clone();
    }
    let step = 1 << (to - from);
    let of = |i: usize| cloud.get(i);
    match from {
        0 => along_curve(&cloud.positions).into_iter().step_by(step).filter_map(of).collect(),
        // It lies along the curve.
        _ => (0..cloud.len()).step_by(step).filter_map(of).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    /// A square of `side * side` points, a row after the other.
    fn square(side: usize) -> SemanticCloud {
        let position = |i: usize| [(i % side) as f32, (i / side) as f32, 0.0];
        (0..side * side).map(|i| SemanticPoint { position: position(i), ..SemanticPoint::UNKNOWN }).collect()
    }

    #[test]
    fn step_by_step_comes_to_the_same_as_at_once() {
        let whole = square(33);
        let mut stepwise = whole.clone();
        for halvings in 1..=MOST_HALVINGS {
            stepwise = halved(&stepwise, halvings - 1, halvings);
            assert_eq!(stepwise, halved(&whole, 0, halvings));
            assert_eq!(stepwise.len(), points_after(whole.len(), halvings));
        }
        assert_eq!(halved(&stepwise, MOST_HALVINGS, 99), stepwise);
        assert_eq!(halved(&whole, 2, 2), whole);
    }

    #[test]
    fn no_place_is_without_points_and_no_chunk() {
        let kept = halved(&square(32), 0, 4);
        for (x, y) in [(4, 4), (16, 16), (28, 4), (4, 28), (28, 28)] {
            let near = |p: &[f32; 3]| (p[0] - x as f32).hypot(p[1] - y as f32) < 6.0;
            assert!(kept.positions.iter().any(near), "({x}, {y})");
        }
        assert_eq!(halved(&square(1), 0, MOST_HALVINGS).len(), 1);
        assert!(halved(&SemanticCloud::default(), 0, 3).is_empty());
    }
}
