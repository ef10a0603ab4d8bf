//! What a pick reads back: a square of pixels around one, each with the number of what lies there and its distance (see
//! pick.wgsl), and which of them is meant.

use super::pool::{BLOCK_POINTS, PAGE_BLOCKS};
use glam::Vec2;

/// Side of the square in device pixels: odd, so that one pixel is in the middle.
pub const SIDE: usize = 31;
/// Words of a pixel.
const PIXEL_WORDS: usize = 4;
/// Bytes of a row in the buffer that is read back, a multiple of 256 as copies demand.
pub const ROW_BYTES: usize = (SIDE * PIXEL_WORDS * 4).next_multiple_of(256);

/// How far from the pointer something may lie that it points at, CSS pixels.
const SNAP: f32 = 6.0;

/// Slots of a page take so many bits of a point's number; its page takes the others.
const SLOT_BITS: u32 = (BLOCK_POINTS * PAGE_BLOCKS).trailing_zeros();

/// What was read at the pixel that is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowHit {
    /// Number of what lies there.
    pub number: u32,
    /// Its distance along the direction of view, metres.
    pub distance: f32,
    /// The pixel, in device pixels from the middle of the square, right and down.
    pub offset: Vec2,
}

/// The pixel that is meant among those of the square, `bytes` in rows of [`ROW_BYTES`]: the middle if something lies there,
/// else the nearest within reach where something does, of equally near ones the one nearer to the eye.
///
/// * `scale`: device pixels in a CSS pixel.
pub fn nearest(bytes: &[u8], scale: f32) -> Option<WindowHit> {
    let half = (SIDE / 2) as f32;
    let reach = (SNAP * scale).clamp(1.0, half);
    let mut best: Option<(f32, WindowHit)> = None;
    for y in 0..SIDE {
        for x in 0..SIDE {
            let offset = Vec2::new(x as f32 - half, y as f32 - half);
            let away = offset.length();
            let Some((number, distance)) = pixel(bytes, x, y).filter(|_| away <= reach) else { continue };
            if best.is_none_or(|(least, hit)| (away, distance) < (least, hit.distance)) {
                best = Some((away, WindowHit { number, distance, offset }));
            }
        }
    }
    best.map(|(_, hit)| hit)
}

/// Number and distance at a pixel; `None` where nothing lies, or no distance that makes sense.
fn pixel(bytes: &[u8], x: usize, y: usize) -> Option<(u32, f32)> {
    let start = y * ROW_BYTES + x * PIXEL_WORDS * 4;
    let word = |i: usize| Some(u32::from_le_bytes(bytes.get(start + 4 * i..start + 4 * i + 4)?.try_into().ok()?));
    let number = word(0)?.checked_sub(1)?;
    let distance = f32::from_bits(word(1)?);
    (distance.is_finite() && distance > 0.0).then_some((number, distance))
}

/// Page and slot in it of the point with this number.
pub fn page_and_slot(number: u32) -> (usize, usize) {
    ((number >> SLOT_BITS) as usize, (number & ((1 << SLOT_BITS) - 1)) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(pixels: &[([usize; 2], u32, f32)]) -> Vec<u8> {
        let mut bytes = vec![0; SIDE * ROW_BYTES];
        for ([x, y], number, distance) in pixels {
            let start = y * ROW_BYTES + x * 16;
            bytes[start..start + 4].copy_from_slice(&(number + 1).to_le_bytes());
            bytes[start + 4..start + 8].copy_from_slice(&distance.to_bits().to_le_bytes());
        }
        bytes
    }

    #[test]
    fn the_middle_counts_first_then_what_is_near() {
        let all = [([15, 15], 7, 0.5), ([16, 15], 8, 0.1), ([15, 12], 9, 0.2)];
        let hit = |pixels: &[_]| nearest(&window(pixels), 1.0).map(|h| (h.number, h.distance, h.offset));
        assert_eq!(hit(&all), Some((7, 0.5, Vec2::ZERO)));
        assert_eq!(hit(&all[1..]), Some((8, 0.1, Vec2::X)));
        assert_eq!(hit(&all[2..]), Some((9, 0.2, Vec2::new(0.0, -3.0))));
        assert_eq!(hit(&[]), None);
        // Equally near: what stands in front.
        assert_eq!(hit(&[([14, 15], 1, 0.4), ([16, 15], 2, 0.3)]).map(|h| h.0), Some(2));
        assert_eq!(hit(&[([15, 15], 0, 0.4)]).map(|h| h.0), Some(0), "number 0 is a number");
    }

    #[test]
    fn what_is_out_of_reach_is_not_meant_and_reach_grows_with_the_scale() {
        let far = window(&[([15, 5], 7, 0.5)]);
        assert_eq!(nearest(&far, 1.0), None);
        assert_eq!(nearest(&far, 2.0).map(|h| h.number), Some(7));
        assert_eq!(nearest(&window(&[([0, 0], 7, 0.5)]), 8.0), None, "a corner is beyond the circle");
    }

    #[test]
    fn distances_that_make_no_sense_and_missing_bytes_are_nothing() {
        for distance in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
            assert_eq!(nearest(&window(&[([15, 15], 7, distance)]), 1.0), None);
        }
        assert_eq!(nearest(&window(&[([15, 15], 7, 0.5)])[..1000], 1.0), None);
    }

    #[test]
    fn page_and_slot_share_a_number_as_the_shader_packs_them() {
        for (page, slot) in [(0, 0), (0, BLOCK_POINTS * PAGE_BLOCKS - 1), (1, 0), (150, 70_000)] {
            // points_pick.wgsl: page << 18 | slot.
            assert_eq!(page_and_slot(((page << 18) | slot) as u32), (page, slot));
        }
        assert_eq!(ROW_BYTES % 256, 0);
    }
}
