//! Which of two lists of stamps belong together: each with the nearest of the other list, where both are the nearest to each
//! other and no more apart than a tolerance. (The tool of [Sturm 2012] takes pairs greedily by their distance, which gives the
//! same but for ties.)

/// Most seconds between stamps that belong together: under a period at 30 Hz.
pub(crate) const TOLERANCE: f64 = 0.02;

/// Pairs of places in `a` and `b`, both in ascending order, in the order of `a`.
pub(crate) fn pairs(a: &[f64], b: &[f64], tolerance: f64) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for (place, stamp) in a.iter().enumerate() {
        let Some(other) = nearest(b, *stamp) else { continue };
        let is_near = b.get(other).is_some_and(|found| (found - stamp).abs() <= tolerance);
        if is_near && b.get(other).and_then(|found| nearest(a, *found)) == Some(place) {
            pairs.push((place, other));
        }
    }
    pairs
}

/// The place in `sorted` of the stamp nearest to `stamp`, the first of equals; `None` if there is none.
pub(super) fn nearest(sorted: &[f64], stamp: f64) -> Option<usize> {
    let after = sorted.partition_point(|other| *other < stamp);
    let Some(before) = after.checked_sub(1) else { return (!sorted.is_empty()).then_some(0) };
    let (Some(low), high) = (sorted.get(before), sorted.get(after)) else { return None };
    let is_high_nearer = high.is_some_and(|high| high - stamp < stamp - low);
    if is_high_nearer {
        return Some(after);
    }
    Some(sorted.partition_point(|other| other < low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn stamps_find_each_other_within_the_tolerance() {
        let color = [0.000, 0.033, 0.067, 0.100, 0.200];
        let depth = [0.010, 0.040, 0.045, 0.101, 0.300];
        assert_eq!(pairs(&color, &depth, TOLERANCE), [(0, 0), (1, 1), (3, 3)]);
        assert_eq!(pairs(&[], &depth, TOLERANCE), []);
        assert_eq!(pairs(&[1.0, 1.0], &[1.0, 1.0], TOLERANCE), [(0, 0)]);
    }

    proptest! {
        #[test]
        fn nothing_is_paired_twice(
            mut a in prop::collection::vec(0.0..1.0_f64, 0..40), mut b in prop::collection::vec(0.0..1.0_f64, 0..40),
        ) {
            a.sort_by(f64::total_cmp);
            b.sort_by(f64::total_cmp);
            let found = pairs(&a, &b, TOLERANCE);
            prop_assert!(found.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
            prop_assert!(found.iter().all(|(i, j)| (a[*i] - b[*j]).abs() <= TOLERANCE));
        }
    }
}
