//! Drawing fewer points without clusters or stripes: the order in which a chunk's points fill its blocks.
//!
//! Points are put in the order of a space-filling curve [Morton 1966], cut into one run a block, and inside a run they
//! lie in bit-reversed order (van der Corput 1935); the slots that a shorter run leaves empty lie between them. So the
//! first k slots of every block hold k / 256 of its points, evenly over the surface, for every k, and a thinner picture
//! is the same draw call with a smaller k.

use super::pool::BLOCK_POINTS;
use crate::morton::along_curve;

/// The slots of each block in order: index of the point that lies there, or none.
pub fn assign_slots(positions: &[[f32; 3]]) -> Vec<[Option<usize>; BLOCK_POINTS]> {
    let points = positions.len();
    let blocks = points.div_ceil(BLOCK_POINTS);
    let order = along_curve(positions);
    let bits = BLOCK_POINTS.trailing_zeros();
    (0..blocks)
        .map(|block| {
            let run = &order[block * points / blocks..(block + 1) * points / blocks];
            std::array::from_fn(|slot| {
                let reversed = slot.reverse_bits() >> (usize::BITS - bits);
                run.get(reversed).copied()
            })
        })
        .collect()
}

/// The point of a chunk that lies in a slot of one of its blocks; `None` where there is none.
pub fn point_in_slot(positions: &[[f32; 3]], block: usize, slot: usize) -> Option<usize> {
    assign_slots(positions).get(block)?.get(slot).copied().flatten()
}

/// How many slots of every block to draw, so that about `budget` of `points` points are drawn; at least one.
pub fn slots_within(budget: Option<usize>, points: usize) -> u32 {
    let slots = budget.map_or(BLOCK_POINTS, |budget| budget.saturating_mul(BLOCK_POINTS) / points.max(1));
    slots.clamp(1, BLOCK_POINTS) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A square of `side * side` points in raster order.
    fn square(side: usize) -> Vec<[f32; 3]> {
        (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, 0.0]).collect()
    }

    #[test]
    fn every_point_lies_in_exactly_one_slot() {
        for n in [0, 1, 255, 256, 257, 1000, 32_768] {
            let positions: Vec<_> = square(200).into_iter().take(n).collect();
            let blocks = assign_slots(&positions);
            assert_eq!(blocks.len(), n.div_ceil(BLOCK_POINTS));
            let mut all: Vec<usize> = blocks.into_iter().flatten().flatten().collect();
            all.sort_unstable();
            assert_eq!(all, (0..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_slot_leads_back_to_its_point() {
        let positions: Vec<_> = square(30).into_iter().take(700).collect();
        for (block, slots) in assign_slots(&positions).iter().enumerate() {
            for (slot, point) in slots.iter().enumerate() {
                assert_eq!(point_in_slot(&positions, block, slot), *point);
            }
        }
        assert_eq!(point_in_slot(&positions, 3, 0), None);
        assert_eq!(point_in_slot(&[], 0, 0), None);
    }

    #[test]
    fn any_prefix_covers_the_surface_evenly_and_holds_its_share() {
        let side = 57;
        let positions = square(side);
        for slots in [16, 40, 100] {
            let kept: Vec<usize> =
                assign_slots(&positions).into_iter().flat_map(|b| b.into_iter().take(slots).flatten()).collect();
            let share = side * side * slots / BLOCK_POINTS;
            assert!(kept.len().abs_diff(share) <= share / 5, "{slots}: {} for {share}", kept.len());
            let spacing = ((side * side) as f32 / kept.len() as f32).sqrt();
            let distance = |p: &[f32; 3]| {
                let to = |i: &usize| Vec3::from(*p).distance(Vec3::from(positions[*i]));
                kept.iter().map(to).fold(f32::MAX, f32::min)
            };
            let worst = positions.iter().map(distance).fold(0.0, f32::max);
            assert!(worst <= 2.0 * spacing, "{slots}: a hole of {worst} at a spacing of {spacing}");
        }
    }

    #[test]
    fn broken_positions_get_slots_all_the_same() {
        let positions = [[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [1.0; 3]];
        assert_eq!(assign_slots(&positions).concat().into_iter().flatten().count(), 3);
    }

    #[test]
    fn the_budget_is_kept_but_never_draws_nothing() {
        assert_eq!(slots_within(None, 1000), 256);
        assert_eq!(slots_within(Some(1_000_000), 1000), 256);
        assert_eq!(slots_within(Some(1000), 2000), 128);
        assert_eq!(slots_within(Some(0), 1000), 1);
        assert_eq!(slots_within(Some(10), 0), 256);
        assert_eq!(slots_within(Some(usize::MAX), 1), 256);
    }
}
