//! What is made of a photograph's pixels: smaller pictures of it, for surface far away.

use crate::scene::photo_layers::LayerSize;
use crate::scene::photograph::Pixels;

/// The photograph and its smaller pictures, each pixel the mean of four of the picture before; `None` if it has not the size.
pub(super) fn levels(pixels: Pixels, size: LayerSize) -> Option<Vec<Vec<u8>>> {
    let bytes = size.width as usize * size.height as usize * 4;
    if (pixels.width, pixels.height, pixels.rgba.len()) != (size.width, size.height, bytes) {
        return None;
    }
    let mut levels = vec![pixels.rgba];
    for level in 1..size.levels() {
        let before = levels.last()?;
        levels.push(halved(before, size.of_level(level - 1), size.of_level(level)));
    }
    Some(levels)
}

/// A picture of half the size; an odd column or row at the end is left out.
fn halved(rgba: &[u8], (width, height): (u32, u32), (columns, rows): (u32, u32)) -> Vec<u8> {
    let at = |x: u32, y: u32| 4 * (y.min(height - 1) as usize * width as usize + x.min(width - 1) as usize);
    let mut small = Vec::with_capacity(4 * columns as usize * rows as usize);
    for y in 0..rows {
        for x in 0..columns {
            let four = [at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1), at(2 * x + 1, 2 * y + 1)];
            small.extend([0, 1, 2, 3].map(|k| (four.map(|i| u16::from(rgba[i + k])).iter().sum::<u16>() / 4) as u8));
        }
    }
    small
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: LayerSize = LayerSize { width: 64, height: 48, slots: 4 };

    /// Stripes of eight pixels.
    fn stripes() -> Pixels {
        let value = |x: u32| {
            let wave = (std::f32::consts::TAU * (x as f32 + 0.5) / 16.0).cos();
            (127.0 + 120.0 * (4.0 * wave).tanh()) as u8
        };
        let rgba = (0..SIZE.height).flat_map(|_| (0..SIZE.width).flat_map(|x| [value(x), value(x), value(x), 255]));
        Pixels { width: SIZE.width, height: SIZE.height, rgba: rgba.collect() }
    }

    #[test]
    fn each_picture_has_half_the_size_and_the_same_mean() {
        let all = levels(stripes(), SIZE).expect("of the right size");
        assert_eq!(all.len(), 7);
        for (level, rgba) in (0..).zip(&all) {
            let (width, height) = SIZE.of_level(level);
            assert_eq!(rgba.len(), (4 * width * height) as usize);
        }
        let mean = |rgba: &[u8]| rgba.chunks(4).map(|p| f32::from(p[0])).sum::<f32>() / (rgba.len() / 4) as f32;
        assert!((mean(&all[0]) - mean(&all[6])).abs() < 4.0, "{} {}", mean(&all[0]), mean(&all[6]));
        let wrong = Pixels { width: 8, height: 8, rgba: vec![0; 256] };
        assert_eq!(levels(wrong, SIZE), None);
        let odd = LayerSize { width: 5, height: 1, slots: 4 };
        let pixels = Pixels { width: 5, height: 1, rgba: (0..20).map(|i| i * 10).collect() };
        assert_eq!(levels(pixels, odd).map(|l| l.iter().map(Vec::len).collect::<Vec<_>>()), Some(vec![20, 8, 4]));
    }
}
