//! Pictures of two streams that belong together, by their stamps: each is paired with the other stream's nearest where that
//! is so from both sides and they are no further apart than a stated tolerance. What stays alone is counted.

use crate::messages::Stamp;

/// Furthest that two pictures of one view may be apart in time, nanoseconds.
pub const TOLERANCE: u64 = 20_000_000;

/// Which pictures belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pairs {
    /// Places in the two streams, in the order of the first.
    pub pairs: Vec<(usize, usize)>,
    /// Pictures of the first stream without one of the second.
    pub first_alone: usize,
    /// Pictures of the second stream without one of the first.
    pub second_alone: usize,
    /// How far the pictures of a pair are apart in time at most, nanoseconds.
    pub largest_offset: u64,
}

impl Pairs {
    /// Pairs the pictures of two streams, each in the order of its stamps.
    pub fn by_stamp(first: &[Stamp], second: &[Stamp], tolerance: u64) -> Self {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        let mut largest_offset = 0;
        for (i, stamp) in first.iter().enumerate() {
            let Some(j) = nearest(second, *stamp) else { continue };
            // The nearest of a picture may be nearer to another one, and of several equal ones the first is taken.
            if nearest(first, second[j]) != Some(i) || pairs.last().is_some_and(|(_, taken)| *taken == j) {
                continue;
            }
            let offset = stamp.distance(second[j]);
            if offset <= tolerance {
                largest_offset = largest_offset.max(offset);
                pairs.push((i, j));
            }
        }
        let (first_alone, second_alone) = (first.len() - pairs.len(), second.len() - pairs.len());
        Self { pairs, first_alone, second_alone, largest_offset }
    }
}

/// The place of the stamp that is nearest to `stamp`; the first of several.
fn nearest(stamps: &[Stamp], stamp: Stamp) -> Option<usize> {
    let after = stamps.partition_point(|known| *known < stamp);
    let before = after.checked_sub(1).map(|last| {
        let value = stamps[last];
        stamps.partition_point(|known| *known < value)
    });
    match (before, (after < stamps.len()).then_some(after)) {
        (Some(before), Some(after)) => {
            let earlier_is_nearer = stamps[before].distance(stamp) <= stamps[after].distance(stamp);
            Some(if earlier_is_nearer { before } else { after })
        }
        (before, after) => before.or(after),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn stamps(milliseconds: &[i64]) -> Vec<Stamp> {
        milliseconds.iter().map(|ms| Stamp { nanoseconds: ms * 1_000_000 }).collect()
    }

    #[test]
    fn pictures_are_paired_with_their_nearest_and_the_rest_is_counted() {
        let color = stamps(&[0, 33, 66, 100, 133]);
        let depth = stamps(&[2, 30, 80, 105, 500]);
        let pairs = Pairs::by_stamp(&color, &depth, TOLERANCE);
        assert_eq!(pairs.pairs, [(0, 0), (1, 1), (2, 2), (3, 3)]);
        assert_eq!((pairs.first_alone, pairs.second_alone, pairs.largest_offset), (1, 1, 14_000_000));
        assert_eq!(Pairs::by_stamp(&color, &depth, 5_000_000).pairs, [(0, 0), (1, 1), (3, 3)]);
    }

    #[test]
    fn two_colours_do_not_share_one_depth() {
        let pairs = Pairs::by_stamp(&stamps(&[0, 10, 10]), &stamps(&[9]), TOLERANCE);
        assert_eq!((pairs.pairs, pairs.first_alone), (vec![(1, 0)], 2));
        assert_eq!(Pairs::by_stamp(&stamps(&[5, 5]), &stamps(&[5, 5]), 0).pairs, [(0, 0)]);
        assert!(Pairs::by_stamp(&stamps(&[]), &stamps(&[1]), 0).pairs.is_empty());
    }

    proptest! {
        #[test]
        fn no_picture_is_in_two_pairs(
            mut color in prop::collection::vec(any::<i64>(), 0..40),
            mut depth in prop::collection::vec(any::<i64>(), 0..40),
            tolerance in any::<u64>(),
        ) {
            color.sort_unstable();
            depth.sort_unstable();
            let of = |times: &[i64]| times.iter().map(|t| Stamp { nanoseconds: *t }).collect::<Vec<_>>();
            let pairs = Pairs::by_stamp(&of(&color), &of(&depth), tolerance);
            prop_assert!(pairs.pairs.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
            prop_assert_eq!(pairs.pairs.len() + pairs.second_alone, depth.len());
        }
    }
}
