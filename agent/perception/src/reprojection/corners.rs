//! Corners of a grey picture: pixels around which it changes in every direction, so that their place in another picture
//! is determined in both coordinates. The least eigenvalue of the structure tensor ([Shi 1994]).

use super::picture::Grey;

/// Half the window that the structure tensor is summed over, pixels.
const HALF_WINDOW: usize = 3;
/// Least eigenvalue that is believed, squared grey values a pixel: below it is the noise of a camera.
const LEAST: f32 = 12.0;

/// Score, column and row of every pixel whose score is the largest among its neighbours, row by row.
pub(super) fn detect(grey: &Grey) -> Vec<(f32, usize, usize)> {
    let (width, height) = (grey.width, grey.height);
    if width < 2 * HALF_WINDOW + 5 || height < 2 * HALF_WINDOW + 5 {
        return Vec::new();
    }
    let scores = scores(grey);
    let border = HALF_WINDOW + 2;
    let mut found = Vec::new();
    for row in border..height - border {
        for column in border..width - border {
            let i = row * width + column;
            let score = scores[i];
            // Ties go to the first in reading order.
            let around = [i - width - 1, i - width, i - width + 1, i - 1];
            let after = [i + 1, i + width - 1, i + width, i + width + 1];
            if score > LEAST && around.iter().all(|&j| score > scores[j]) && after.iter().all(|&j| score >= scores[j]) {
                found.push((score, column, row));
            }
        }
    }
    found
}

/// Least eigenvalue of the mean structure tensor around each pixel; 0 at the border.
fn scores(grey: &Grey) -> Vec<f32> {
    let (width, height) = (grey.width, grey.height);
    // Products of the derivatives (central differences), then their sums along rows and along columns.
    let mut products = vec![[0.0_f32; 3]; width * height];
    for row in 1..height - 1 {
        for column in 1..width - 1 {
            let i = row * width + column;
            let value = |i: usize| f32::from(grey.values[i]);
            let (x, y) = (0.5 * (value(i + 1) - value(i - 1)), 0.5 * (value(i + width) - value(i - width)));
            products[i] = [x * x, x * y, y * y];
        }
    }
    let mut across = vec![[0.0_f32; 3]; width * height];
    for (line, out) in products.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        for column in HALF_WINDOW..width - HALF_WINDOW {
            let mut sum = [0.0; 3];
            for p in &line[column - HALF_WINDOW..=column + HALF_WINDOW] {
                (0..3).for_each(|k| sum[k] += p[k]);
            }
            out[column] = sum;
        }
    }
    let mut scores = vec![0.0; width * height];
    let share = 1.0 / ((2 * HALF_WINDOW + 1) * (2 * HALF_WINDOW + 1)) as f32;
    for row in HALF_WINDOW..height - HALF_WINDOW {
        let mut sums = vec![[0.0_f32; 3]; width];
        for line in across[(row - HALF_WINDOW) * width..(row + HALF_WINDOW + 1) * width].chunks_exact(width) {
            for (sum, p) in sums.iter_mut().zip(line) {
                (0..3).for_each(|k| sum[k] += p[k]);
            }
        }
        for (score, [xx, xy, yy]) in scores[row * width..(row + 1) * width].iter_mut().zip(sums) {
            let half_difference = 0.5 * (xx - yy);
            *score = share * (0.5 * (xx + yy) - (half_difference * half_difference + xy * xy).sqrt());
        }
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(value: impl Fn(usize, usize) -> u8) -> Grey {
        let (width, height) = (64, 48);
        let values = (0..width * height).map(|i| value(i % width, i / width)).collect();
        Grey { width, height, values }
    }

    #[test]
    fn the_corner_of_a_square_is_found_and_its_edges_are_not() {
        let found = detect(&picture(|x, y| if x >= 30 && y >= 20 { 200 } else { 40 }));
        assert!(!found.is_empty());
        for (_, x, y) in found {
            assert!(x.abs_diff(30) <= 3 && y.abs_diff(20) <= 3, "corner at {x} {y}");
        }
    }

    #[test]
    fn a_picture_without_texture_has_no_corners() {
        assert!(detect(&picture(|_, _| 90)).is_empty());
        assert!(detect(&picture(|x, _| (3 * x) as u8)).is_empty(), "a slope in one direction");
        assert!(detect(&picture(|x, y| 90 + ((x * 7 + y * 13) % 3) as u8)).is_empty(), "noise of one grey value");
        assert!(detect(&Grey { width: 3, height: 2, values: vec![0; 6] }).is_empty(), "a tiny picture");
    }
}
