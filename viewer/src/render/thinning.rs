//! Drawing fewer points without holes or clusters: the order in which a chunk's points fill its blocks.
//!
//! Points arrive in raster order. They are dealt to the chunk's blocks in turn, and inside a block they lie in
//! bit-reversed order (van der Corput), so the first k slots of every block are an even sample of the chunk for every k.
//! A thinner picture is then the same draw call with a smaller k.

use super::pool::BLOCK_POINTS;

/// The slots of each block in order: index of the point that lies there. Slots past the end are empty.
pub fn deal(points: usize) -> Vec<Vec<usize>> {
    let blocks = points.div_ceil(BLOCK_POINTS);
    let bits = BLOCK_POINTS.trailing_zeros();
    (0..blocks)
        .map(|block| {
            let held = (points - block).div_ceil(blocks);
            let reversed = |i: usize| i.reverse_bits() >> (usize::BITS - bits);
            (0..BLOCK_POINTS)
                .map(reversed)
                .filter(|i| *i < held)
                .map(|i| block + i * blocks)
                .collect()
        })
        .collect()
}

/// How many slots of every block to draw, so that `blocks` blocks keep within a budget of points; at least one.
pub fn slots_within(budget: Option<usize>, blocks: usize) -> u32 {
    let slots = budget.map_or(BLOCK_POINTS, |points| points / blocks.max(1));
    slots.clamp(1, BLOCK_POINTS) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_lies_in_exactly_one_slot() {
        for n in [0, 1, 255, 256, 257, 1000, 32_768] {
            let blocks = deal(n);
            assert!(
                blocks
                    .iter()
                    .all(|b| b.len() <= BLOCK_POINTS && !b.is_empty())
            );
            let mut all: Vec<usize> = blocks.into_iter().flatten().collect();
            all.sort_unstable();
            assert_eq!(all, (0..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn any_prefix_is_spread_evenly() {
        let n = 2000;
        for slots in [8, 32, 100] {
            let mut kept: Vec<usize> = deal(n)
                .into_iter()
                .flat_map(|b| b.into_iter().take(slots))
                .collect();
            kept.sort_unstable();
            let widest = kept.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(n);
            let mean = n / kept.len();
            assert!(widest <= 4 * mean + 8, "{slots}: {widest} against {mean}");
        }
    }

    #[test]
    fn the_budget_is_kept_but_never_draws_nothing() {
        assert_eq!(slots_within(None, 100), 256);
        assert_eq!(slots_within(Some(1_000_000), 100), 256);
        assert_eq!(slots_within(Some(12_800), 100), 128);
        assert_eq!(slots_within(Some(0), 100), 1);
        assert_eq!(slots_within(Some(10), 0), 10);
    }
}
