//! What is made of a photograph's pixels: smaller pictures of it, for surface far away, and how sharp it is.

use crate::scene::photo_layers::LayerSize;
use crate::scene::photograph::Pixels;

/// Columns of the picture that sharpness is measured on, at most: beyond it there is more noise than detail.
const SHARPNESS_COLUMNS: u32 = 400;

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

/// How sharp a photograph is: the variance of its Laplacian over that of its brightness, on a picture of few columns. Only to be
/// compared with that of others of the same part. 0 where there is nothing to see.
///
/// * `levels`: the photograph and its smaller pictures.
pub(super) fn sharpness(levels: &[Vec<u8>], size: LayerSize) -> f32 {
    let level = (0..size.levels()).find(|level| size.of_level(*level).0 <= SHARPNESS_COLUMNS).unwrap_or_default();
    let Some(rgba) = levels.get(level as usize) else { return 0.0 };
    let width = size.of_level(level).0 as usize;
    let luma: Vec<f32> = rgba
        .chunks_exact(4)
        .map(|p| 0.2126 * f32::from(p[0]) + 0.7152 * f32::from(p[1]) + 0.0722 * f32::from(p[2]))
        .collect();
    let rows: Vec<&[f32]> = luma.chunks_exact(width.max(1)).collect();
    let mut laplacian = Vec::with_capacity(luma.len());
    for window in rows.windows(3) {
        let (above, row, below) = (window[0], window[1], window[2]);
        let inner = 1..width.saturating_sub(1);
        laplacian.extend(inner.map(|x| above[x] + below[x] + row[x - 1] + row[x + 1] - 4.0 * row[x]));
    }
    let spread = variance(&luma);
    if spread > 1.0 { variance(&laplacian) / spread } else { 0.0 }
}

fn variance(values: &[f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let count = values.len() as f32;
    let mean = values.iter().sum::<f32>() / count;
    values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / count
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: LayerSize = LayerSize { width: 64, height: 48, slots: 4 };

    /// Stripes of eight pixels; their edges are the steeper the sharper.
    fn stripes(sharp: f32) -> Pixels {
        let value = |x: u32| {
            let wave = (std::f32::consts::TAU * (x as f32 + 0.5) / 16.0).cos();
            (127.0 + 120.0 * (sharp * wave).tanh()) as u8
        };
        let rgba = (0..SIZE.height).flat_map(|_| (0..SIZE.width).flat_map(|x| [value(x), value(x), value(x), 255]));
        Pixels { width: SIZE.width, height: SIZE.height, rgba: rgba.collect() }
    }

    #[test]
    fn each_picture_has_half_the_size_and_the_same_mean() {
        let all = levels(stripes(4.0), SIZE).expect("of the right size");
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

    #[test]
    fn a_blurred_photograph_is_less_sharp() {
        let of = |sharp| levels(stripes(sharp), SIZE).map_or(0.0, |levels| sharpness(&levels, SIZE));
        let found = [of(8.0), of(2.0), of(0.5)];
        assert!(found[0] > 1.5 * found[1] && found[1] > 1.2 * found[2], "{found:?}");
        let flat = Pixels { width: 64, height: 48, rgba: vec![90; 64 * 48 * 4] };
        assert_eq!(levels(flat, SIZE).map(|levels| sharpness(&levels, SIZE)), Some(0.0));
        assert_eq!(sharpness(&[], SIZE), 0.0);
    }
}
