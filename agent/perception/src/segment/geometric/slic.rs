//! Superpixels: Simple Linear Iterative Clustering [Achanta 2012], which [Eye-in-hand 2020] compares its supervoxels
//! with ("SLIC + ICP").
//!
//! k-means in CIELAB and pixel position around centres on a grid, each centre competing within its own neighbourhood
//! only; then pieces that are cut off join the patch beside them.

use super::flood::grow;
use super::voxel_grid::NONE;
use image::RgbImage;
use semascan_geometry::vector::squared_distance;

/// How superpixels are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlicConfig {
    /// Grid step S in pixels: about the edge of a superpixel.
    pub step: u32,
    /// Compactness m: the colour difference (CIELAB) that weighs as much as a whole step.
    pub compactness: f32,
    /// Rounds of assignment and update.
    pub iterations: u32,
}

impl Default for SlicConfig {
    fn default() -> Self {
        Self { step: 12, compactness: 10.0, iterations: 10 }
    }
}

#[derive(Clone, Copy, Default)]
struct Centre {
    lab: [f32; 3],
    at: [f32; 2],
}

/// Superpixel of each pixel, row-major, numbered from 0 in the order of their first pixels.
pub fn slic(image: &RgbImage, config: &SlicConfig) -> Vec<u32> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let step = (config.step.max(2) as usize).min(width.max(height));
    let lab = to_lab(image);
    let mut centres = grid_centres(&lab, width, height, step);
    let mut labels = vec![NONE; lab.len()];
    for _ in 0..config.iterations.max(1) {
        assign(&lab, width, height, &centres, step, config.compactness, &mut labels);
        update(&lab, width, &labels, &mut centres);
    }
    connect(&labels, width, height, step * step / 4)
}

/// Centres a step apart, moved to the flattest of the nine pixels around.
fn grid_centres(lab: &[[f32; 3]], width: usize, height: usize, step: usize) -> Vec<Centre> {
    let gradient = |x: usize, y: usize| {
        let at = |x: usize, y: usize| lab[y.min(height - 1) * width + x.min(width - 1)];
        squared_distance(at(x + 1, y), at(x.saturating_sub(1), y))
            + squared_distance(at(x, y + 1), at(x, y.saturating_sub(1)))
    };
    let mut centres = Vec::new();
    for y in (step / 2..height.max(step / 2 + 1)).step_by(step) {
        for x in (step / 2..width.max(step / 2 + 1)).step_by(step) {
            let mut best = (f32::INFINITY, x.min(width - 1), y.min(height - 1));
            for k in 0..9 {
                let (u, v) =
                    ((x + k % 3).saturating_sub(1).min(width - 1), (y + k / 3).saturating_sub(1).min(height - 1));
                let g = gradient(u, v);
                if g < best.0 {
                    best = (g, u, v);
                }
            }
            centres.push(Centre { lab: lab[best.2 * width + best.1], at: [best.1 as f32, best.2 as f32] });
        }
    }
    centres
}

fn assign(
    lab: &[[f32; 3]],
    width: usize,
    height: usize,
    centres: &[Centre],
    step: usize,
    compactness: f32,
    labels: &mut [u32],
) {
    let mut nearest = vec![f32::INFINITY; labels.len()];
    let weight = (compactness / step as f32).powi(2);
    let reach = step as f32;
    for (k, centre) in centres.iter().enumerate() {
        let from = |c: f32| (c - reach).max(0.0) as usize;
        let to = |c: f32, end: usize| ((c + reach) as usize + 1).min(end);
        for y in from(centre.at[1])..to(centre.at[1], height) {
            let dy = (y as f32 - centre.at[1]).powi(2);
            for x in from(centre.at[0])..to(centre.at[0], width) {
                let i = y * width + x;
                let d = squared_distance(lab[i], centre.lab) + weight * ((x as f32 - centre.at[0]).powi(2) + dy);
                if d < nearest[i] {
                    nearest[i] = d;
                    labels[i] = k as u32;
                }
            }
        }
    }
}

fn update(lab: &[[f32; 3]], width: usize, labels: &[u32], centres: &mut [Centre]) {
    let mut sums = vec![([0.0_f64; 5], 0_u32); centres.len()];
    for (i, &label) in labels.iter().enumerate() {
        let Some((sum, n)) = sums.get_mut(label as usize) else { continue };
        let [l, a, b] = lab[i].map(f64::from);
        for (s, x) in sum.iter_mut().zip([l, a, b, (i % width) as f64, (i / width) as f64]) {
            *s += x;
        }
        *n += 1;
    }
    for (centre, (sum, n)) in centres.iter_mut().zip(sums).filter(|(_, (_, n))| *n > 0) {
        let mean = sum.map(|s| (s / f64::from(n)) as f32);
        *centre = Centre { lab: [mean[0], mean[1], mean[2]], at: [mean[3], mean[4]] };
    }
}

/// Numbers the 4-connected pieces; pieces below `fewest` pixels join the piece met before them.
fn connect(labels: &[u32], width: usize, height: usize, fewest: usize) -> Vec<u32> {
    let mut out = vec![NONE; labels.len()];
    let mut next = 0;
    let mut piece = Vec::new();
    for start in 0..labels.len() {
        if out[start] != NONE {
            continue;
        }
        let (x, y) = (start % width, start / width);
        let before = if x > 0 {
            out[start - 1]
        } else if y > 0 {
            out[start - width]
        } else {
            NONE
        };
        out[start] = next;
        grow(start, (width, height), &mut piece, |_, j| {
            let joins = out[j] == NONE && labels[j] == labels[start];
            if joins {
                out[j] = next;
            }
            joins
        });
        if piece.len() < fewest && before != NONE {
            piece.iter().for_each(|&i| out[i] = before);
        } else {
            next += 1;
        }
    }
    out
}

/// CIELAB of sRGB under D65.
fn to_lab(image: &RgbImage) -> Vec<[f32; 3]> {
    let linear: Vec<f32> = (0..256)
        .map(|v| {
            let c = v as f32 / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        })
        .collect();
    let f = |t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    image
        .pixels()
        .map(|p| {
            let [r, g, b] = p.0.map(|v| linear[usize::from(v)]);
            let x = f((0.412_456 * r + 0.357_576 * g + 0.180_437 * b) / 0.950_47);
            let y = f(0.212_673 * r + 0.715_152 * g + 0.072_175 * b);
            let z = f((0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83);
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn superpixels_keep_to_color_borders() {
        // A slanted border between two colours, with noise.
        let border = |x: u32, y: u32| x * 3 > 120 + y;
        let image = RgbImage::from_fn(120, 90, |x, y| {
            let n = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503)) as u8 % 12;
            image::Rgb(if border(x, y) { [200 + n, 60, 40] } else { [50, 90 + n, 180] })
        });
        let labels = slic(&image, &SlicConfig::default());
        let count = labels.iter().max().expect("pixels") + 1;
        assert!((40..120).contains(&count), "{count} superpixels");
        let mut sides = vec![[0_u32; 2]; count as usize];
        for (i, &label) in labels.iter().enumerate() {
            sides[label as usize][usize::from(border(i as u32 % 120, i as u32 / 120))] += 1;
        }
        let wrong: u32 = sides.iter().map(|s| s[0].min(s[1])).sum();
        assert!(wrong * 100 < 120 * 90, "{wrong} pixels cross the border");
    }

    #[test]
    fn colors_become_lab() {
        let image = RgbImage::from_fn(2, 1, |x, _| image::Rgb(if x == 0 { [255; 3] } else { [255, 0, 0] }));
        let lab = to_lab(&image);
        let close = |a: [f32; 3], b: [f32; 3]| assert!(squared_distance(a, b).sqrt() < 0.1, "{a:?} {b:?}");
        close(lab[0], [100.0, 0.0, 0.0]);
        close(lab[1], [53.24, 80.09, 67.20]);
    }

    proptest! {
        #[test]
        fn any_picture_is_covered(w in 0_u32..40, h in 0_u32..40, step in 0_u32..60, m in prop::num::f32::ANY, seed in any::<u32>()) {
            let image = RgbImage::from_fn(w, h, |x, y| image::Rgb([x.wrapping_mul(seed) as u8, (y ^ seed) as u8, seed as u8]));
            let labels = slic(&image, &SlicConfig { step, compactness: m, iterations: 3 });
            prop_assert_eq!(labels.len(), (w * h) as usize);
            let mut seen: Vec<u32> = labels.clone();
            seen.sort_unstable();
            seen.dedup();
            prop_assert_eq!(seen.len() as u32, seen.last().map_or(0, |l| l + 1));
        }
    }
}
