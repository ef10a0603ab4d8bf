//! Marks the depth pixels that belong to no surface, before they bend supervoxels: [Eye-in-hand 2020], section 4.2,
//! names distorted points at the rims of round objects as the limit of its method.
//!
//! Two filters on the pixel grid: pixels with few neighbours at their depth, as they hang between two surfaces at a depth
//! step, and speckles, islands of a few pixels. They mark; the caller decides what becomes of a marked pixel. (The map's
//! own test for flying pixels, by lines of inverse depth, is in `organized::edges`.)

use super::flood::grow;

/// Which pixels count as noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFilter {
    /// Neighbours within this share of the depth stand on the same surface.
    pub same_surface: f32,
    /// Of the eight neighbours, fewer than this on the same surface make a flying pixel.
    pub fewest_neighbours: u32,
    /// Connected islands of fewer pixels are speckles.
    pub smallest_island: usize,
}

impl Default for NoiseFilter {
    fn default() -> Self {
        Self { same_surface: 0.01, fewest_neighbours: 3, smallest_island: 30 }
    }
}

impl NoiseFilter {
    /// True for every noisy pixel of a row-major depth image of `width` columns (metres, 0 = nothing measured).
    pub fn mark(&self, depth: &[f32], width: usize) -> Vec<bool> {
        let mut noisy = vec![false; depth.len()];
        if width == 0 {
            return noisy;
        }
        let height = depth.len() / width;
        for y in 0..height {
            for x in 0..width {
                let z = depth[y * width + x];
                if z > 0.0 {
                    let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
                    let near =
                        rows.flat_map(|v| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |u| v * width + u));
                    // The pixel itself is on its surface.
                    let count = near.filter(|&j| depth[j] > 0.0 && self.is_same_surface(z, depth[j])).count() as u32;
                    noisy[y * width + x] = count < self.fewest_neighbours + 1;
                }
            }
        }
        self.mark_islands(depth, width, height, &mut noisy);
        noisy
    }

    /// Whether neighbouring pixels of depths `a` and `b` may stand on one surface.
    fn is_same_surface(&self, a: f32, b: f32) -> bool {
        (a - b).abs() <= self.same_surface * a.min(b)
    }

    /// Marks 4-connected islands of unmarked pixels that are too small.
    fn mark_islands(&self, depth: &[f32], width: usize, height: usize, noisy: &mut [bool]) {
        let mut seen: Vec<bool> = depth.iter().zip(noisy.iter()).map(|(z, &n)| n || z.is_nan() || *z <= 0.0).collect();
        let mut island = Vec::new();
        for start in 0..width * height {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            grow(start, (width, height), &mut island, |i, j| {
                let joins = !seen[j] && self.is_same_surface(depth[i], depth[j]);
                seen[j] |= joins;
                joins
            });
            if island.len() < self.smallest_island {
                island.iter().for_each(|&i| noisy[i] = true);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn flying_pixels_and_speckles_are_marked_and_surfaces_are_not() {
        // A near square before a far wall, a pixel between the two at the step, and an island of four.
        let (width, height) = (40, 30);
        let mut depth = vec![1.0_f32; width * height];
        for y in 8..22 {
            for x in 8..22 {
                depth[y * width + x] = 0.6;
            }
        }
        let flying = 15 * width + 22;
        depth[flying] = 0.8;
        let island = [5 * width + 33, 5 * width + 34, 6 * width + 33, 6 * width + 34];
        island.iter().for_each(|&i| depth[i] = 0.7);
        depth[3] = 0.0;
        let noisy = NoiseFilter::default().mark(&depth, width);
        let marked: Vec<usize> = (0..noisy.len()).filter(|&i| noisy[i]).collect();
        let mut expected = vec![flying];
        expected.extend(island);
        expected.sort_unstable();
        assert_eq!(marked, expected);
    }

    proptest! {
        #[test]
        fn any_depth_is_accepted(depth in prop::collection::vec(prop::num::f32::ANY, 0..200), width in 0_usize..30) {
            prop_assert_eq!(NoiseFilter::default().mark(&depth, width).len(), depth.len());
        }
    }
}
