//! Networks that label cells of several pixels: what they say is interpolated between the middles of the cells, as their own
//! training does it (bilinear, half-pixel centres).

use super::engine::Tensor;

/// Largest edge of a cell, pixels.
const LARGEST: usize = 16;

/// Edge of the cells of an output of shape `found` where `wanted` is that of the pixels, both `[N, C, H, W]`; `None` if they
/// do not fit.
pub(super) fn factor(found: &[usize], wanted: &[usize]) -> Option<usize> {
    let (&[n, c, h, w], &[n0, c0, h0, w0]) = (found, wanted) else { return None };
    if (n, c) != (n0, c0) || h == 0 || w == 0 || h0 % h != 0 || w0 % w != 0 || h0 / h != w0 / w {
        return None;
    }
    Some(h0 / h).filter(|factor| *factor <= LARGEST)
}

/// An output `[N, C, H, W]` at `factor` times its height and width.
pub(super) fn enlarged(cells: &Tensor, factor: usize) -> Tensor {
    let &[n, c, height, width] = cells.shape.as_slice() else { return cells.clone() };
    let (rows, columns) = (taps(height, factor), taps(width, factor));
    let mut data = Vec::with_capacity(cells.data.len() * factor * factor);
    for plane in cells.data.chunks_exact((height * width).max(1)) {
        for &(top, bottom, down) in &rows {
            for &(left, right, along) in &columns {
                let row = |y: usize| plane[y * width + left] * (1.0 - along) + plane[y * width + right] * along;
                data.push(row(top) * (1.0 - down) + row(bottom) * down);
            }
        }
    }
    Tensor { shape: vec![n, c, height * factor, width * factor], data }
}

/// For each pixel of an axis: the cells before and after it, and the share of the second.
fn taps(cells: usize, factor: usize) -> Vec<(usize, usize, f32)> {
    let last = cells.saturating_sub(1);
    let tap = |pixel: usize| {
        let place = ((pixel as f32 + 0.5) / factor as f32 - 0.5).clamp(0.0, last as f32);
        let before = place as usize;
        (before, (before + 1).min(last), place - before as f32)
    };
    (0..cells * factor).map(tap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_become_pixels_between_their_middles() {
        let cells = Tensor { shape: vec![1, 1, 1, 2], data: vec![0.0, 4.0] };
        let pixels = enlarged(&cells, 2);
        assert_eq!(pixels.shape, [1, 1, 2, 4]);
        assert_eq!(pixels.data, [0.0, 1.0, 3.0, 4.0, 0.0, 1.0, 3.0, 4.0]);
        for (found, wanted) in [
            (&[1, 3, 16, 16][..], Some(4)),
            (&[1, 3, 64, 64], Some(1)),
            (&[1, 3, 21, 21], None),
            (&[1, 3, 16, 32], None),
            (&[1, 2, 16, 16], None),
            (&[1, 3, 2, 2], None),
            (&[3, 64, 64], None),
        ] {
            assert_eq!(factor(found, &[1, 3, 64, 64]), wanted, "{found:?}");
        }
    }
}
