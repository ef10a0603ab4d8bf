//! Cells of regular grids: which cell a point lies in, and cells along the Morton curve.

/// The cell that holds `position` in a grid of edge `edge` (metres, or whatever the position is in), as whole numbers
/// that may be beyond any integer type; not finite where the position is not.
#[inline(always)]
pub fn cell(position: [f32; 3], edge: f64) -> [f64; 3] {
    position.map(|c| (f64::from(c) / edge).floor())
}

/// The cell of a coarser grid, `factor` cells an edge, that holds `cell`.
#[inline(always)]
pub fn coarser(cell: [i32; 3], factor: i32) -> [i32; 3] {
    cell.map(|c| c.div_euclid(factor))
}

/// Largest whole number not above `x`: two instructions, where `floor` may be a call. Only for what fits an i32.
#[inline(always)]
pub fn floor(x: f32) -> i32 {
    let whole = x as i32;
    whole - i32::from((whole as f32) > x)
}

/// Smallest whole number not below `x`, as [`floor`].
#[inline(always)]
pub fn ceil(x: f32) -> i32 {
    let whole = x as i32;
    whole + i32::from((whole as f32) < x)
}

/// Place of a cell along the Morton curve: the bits of three coordinates below 2^21 interleaved, the first coordinate's
/// above the second's above the third's.
#[inline]
pub fn morton(cell: [u32; 3]) -> u64 {
    spread(cell[0]) << 2 | spread(cell[1]) << 1 | spread(cell[2])
}

/// 21 bits with two empty ones between each.
#[inline]
fn spread(bits: u32) -> u64 {
    let mut x = u64::from(bits) & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn quick_rounding_is_rounding(x in -1e6..1e6_f32) {
            prop_assert_eq!(floor(x) as f32, x.floor());
            prop_assert_eq!(ceil(x) as f32, x.ceil());
        }

        #[test]
        fn morton_interleaves_the_bits(cell in prop::array::uniform3(0..1_u32 << 21)) {
            let code = morton(cell);
            for bit in 0..63 {
                prop_assert_eq!(code >> bit & 1, u64::from(cell[2 - bit % 3] >> (bit / 3) & 1));
            }
        }
    }

    #[test]
    fn cells_are_closed_below() {
        assert_eq!(cell([0.0, -0.01, 1.0], 0.5), [0.0, -1.0, 2.0]);
        assert_eq!(coarser([7, 8, -1], 8), [0, 1, -1]);
    }
}
