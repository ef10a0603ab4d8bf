//! Rectangles side by side in one atlas: the tallest first, each where it comes to lie lowest on those before it, as the
//! skyline bottom-left rule of [Jylänki 2010] has it.

use crate::charts::PADDING;

/// Atlas edges are multiples of this, so that blocks of compressed textures and mip maps fit.
const STEP: u32 = 4;
/// How much more area than that of the rectangles an atlas begins with.
const SLACK: f64 = 1.04;

/// Where rectangles lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Packing {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Column and row of each rectangle's first texel.
    pub(crate) places: Vec<[u32; 2]>,
}

/// Packs rectangles into an atlas that is about square and whose edges are at most `largest`; `None` if that is too small.
pub(crate) fn pack(sizes: &[(u32, u32)], largest: u32) -> Option<Packing> {
    let largest = largest / STEP * STEP;
    let area: f64 = sizes.iter().map(|(width, height)| f64::from(*width) * f64::from(*height)).sum();
    let widest = sizes.iter().map(|size| size.0).max().unwrap_or(0).max(2 * PADDING);
    if area > f64::from(largest).powi(2) || widest > largest {
        return None;
    }
    let round_up = |edge: u32| edge.div_ceil(STEP) * STEP;
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|i| std::cmp::Reverse((sizes[*i].1, sizes[*i].0)));
    let mut width = round_up(((area * SLACK).sqrt().ceil() as u32).max(widest)).min(largest);
    loop {
        let (places, height) = on_skyline(sizes, &order, width);
        let height = round_up(height.max(STEP));
        if height <= largest {
            return Some(Packing { width, height, places });
        }
        if width == largest {
            return None;
        }
        width = round_up(width + width / 50 + 1).min(largest);
    }
}

/// A step of the skyline: from its column to that of the next one everything above `top` is free.
#[derive(Clone, Copy, Debug)]
struct Ledge {
    left: u32,
    top: u32,
}

/// Puts the rectangles side by side in `width` columns, none wider than that. Returns their places and the rows taken.
fn on_skyline(sizes: &[(u32, u32)], order: &[usize], width: u32) -> (Vec<[u32; 2]>, u32) {
    let mut places = vec![[0; 2]; sizes.len()];
    let mut skyline = vec![Ledge { left: 0, top: 0 }];
    let mut rows = 0;
    for number in order {
        let (wide, high) = sizes[*number];
        let mut best: Option<(u32, usize)> = None;
        for first in 0..skyline.len() {
            let right = skyline[first].left + wide;
            if right > width {
                break;
            }
            let below = skyline[first..].iter().take_while(|ledge| ledge.left < right);
            let top = below.map(|ledge| ledge.top).max().unwrap_or(0);
            if best.is_none_or(|(lowest, _)| top < lowest) {
                best = Some((top, first));
            }
        }
        // The first ledge begins at the left edge, where everything finds room.
        let Some((top, first)) = best else { continue };
        let (left, right) = (skyline[first].left, skyline[first].left + wide);
        places[*number] = [left, top];
        rows = rows.max(top + high);
        let covered = skyline[first..].iter().take_while(|ledge| ledge.left < right).count();
        let end = skyline.get(first + covered).map_or(width, |ledge| ledge.left);
        let last_top = skyline[first + covered - 1].top;
        let rest = (right < end).then_some(Ledge { left: right, top: last_top });
        drop(skyline.splice(first..first + covered, std::iter::once(Ledge { left, top: top + high }).chain(rest)));
        skyline.dedup_by(|next, before| next.top == before.top);
    }
    (places, rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(sizes: &[(u32, u32)], packing: &Packing) {
        let mut is_taken = vec![false; (packing.width * packing.height) as usize];
        for ((width, height), [x, y]) in sizes.iter().zip(&packing.places) {
            assert!(x + width <= packing.width && y + height <= packing.height);
            for row in *y..y + height {
                for column in *x..x + width {
                    let taken = &mut is_taken[(row * packing.width + column) as usize];
                    assert!(!*taken, "two at {column}, {row}");
                    *taken = true;
                }
            }
        }
    }

    #[test]
    fn rectangles_lie_close_and_do_not_overlap() {
        let size = |i: u32| (9 + i * 7919 % 61, 9 + i * 104_729 % 47);
        let sizes: Vec<(u32, u32)> = (0..700).map(size).chain([(300, 20), (12, 350)]).collect();
        let packing = pack(&sizes, 4096).expect("room");
        check(&sizes, &packing);
        let area: u32 = sizes.iter().map(|(w, h)| w * h).sum();
        let filled = f64::from(area) / f64::from(packing.width * packing.height);
        assert!(filled > 0.85, "{filled}");
        assert!(packing.width.is_multiple_of(4) && packing.height.is_multiple_of(4));
    }

    #[test]
    fn what_does_not_fit_is_not_packed() {
        let sizes = vec![(60, 60); 16];
        let packing = pack(&sizes, 240).expect("it fits exactly");
        assert_eq!((packing.width, packing.height), (240, 240));
        check(&sizes, &packing);
        assert_eq!(pack(&sizes, 239), None);
        assert_eq!(pack(&[(300, 10)], 200), None);
        let tall = pack(&[(10, 150)], 200).expect("room");
        check(&[(10, 150)], &tall);
        assert!(pack(&[], 200).is_some());
    }
}
