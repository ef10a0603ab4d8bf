//! What the tracker takes of a view: its surface and its picture on a grid of about 320 columns.
//!
//! Half the resolution of a VGA camera loses nothing that counts: the noise of neighbouring pixels is alike, and a quarter
//! of the pixels is a quarter of the time ([Newcombe 2011] and [Whelan 2016] end at the full picture on a GPU).

use super::super::model_view::ModelView;
use super::super::source_points::SourcePoints;
use super::super::texture::{Texture, ViewTexture};
use super::thumbnail::Thumbnail;
use crate::organized::OrganizedCloud;
use crate::view::{DepthImage, Intrinsics, View};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

/// Columns of the grid, at most.
const COLUMNS: usize = 320;
/// Depths within a block of pixels that differ by less, as a share, are of one surface.
const SAME_SURFACE: f32 = 0.02;
/// Half the window over which depth is smoothed, pixels of the grid.
const HALF_WINDOW: usize = 2;
/// Every so many columns and rows of the grid are aligned.
const STRIDE: usize = 2;
/// Points of its picture that are aligned, at most.
const TEXTURED_POINTS: usize = 5_000;
/// How certain the depth of near and far points is at most and at least, relative to those in the middle.
const MOST_CERTAIN: f32 = 3.0;
const LEAST_CERTAIN: f32 = 0.1;
/// Fewest points that can be aligned.
const FEWEST_POINTS: usize = 300;

/// A view, ready to be tracked.
pub(super) struct Frame {
    /// Points and normals of the grid, camera frame.
    pub(super) surface: ModelView,
    /// The points that are aligned.
    pub(super) points: SourcePoints,
    /// Their centre and radius, metres, camera frame.
    pub(super) centre: Point3<f64>,
    pub(super) radius: f64,
    /// Its picture; `None` where it shows too little.
    pub(super) texture: Option<ViewTexture>,
    /// What it looks like from afar.
    pub(super) thumbnail: Thumbnail,
}

impl Frame {
    /// Prepares `view`; `None` where it has too little depth.
    pub(super) fn new(view: &View) -> Option<Self> {
        let stride = (view.intrinsics.width as usize).div_ceil(COLUMNS).max(1);
        let (intrinsics, depth) = shrunk(&view.intrinsics, &view.depth, stride);
        let depth = smoothed(&depth);
        let (cloud, picture) = rayon::join(
            || OrganizedCloud::new(intrinsics, &depth, None),
            || Texture::new(&view.rgb, &view.intrinsics, stride),
        );
        let mut points = SourcePoints::select(&cloud, STRIDE, |_| 0, |_| true);
        if points.len() < FEWEST_POINTS {
            return None;
        }
        let centre = points.centroid()?;
        // The noise of cameras that triangulate grows with the square of the distance.
        let certainty = |p: &[f32; 3]| (centre.z as f32 / p[2]).powi(2).clamp(LEAST_CERTAIN, MOST_CERTAIN);
        points.certainty = points.points.iter().map(certainty).collect();
        Some(Self {
            surface: ModelView::of(&cloud, Isometry3::identity(), 1, |_| 0, |_| true),
            radius: points.radius(&centre),
            centre,
            points,
            thumbnail: Thumbnail::new(&view.rgb, &view.depth),
            texture: ViewTexture::on(picture, &cloud, TEXTURED_POINTS),
        })
    }
}

/// The depth picture with blocks of `factor` by `factor` pixels averaged, those of the nearest surface in a block; what does
/// not fill a block is cut.
fn shrunk(camera: &Intrinsics, depth: &DepthImage, factor: usize) -> (Intrinsics, DepthImage) {
    let (width, height) = (depth.width as usize / factor, depth.height as usize / factor);
    let mut metres = vec![0.0; width * height];
    for (row, out) in metres.chunks_mut(width.max(1)).enumerate() {
        for (column, out) in out.iter_mut().enumerate() {
            let block = |line: usize| {
                let start = (row * factor + line) * depth.width as usize + column * factor;
                &depth.metres[start..start + factor]
            };
            let values = || (0..factor).flat_map(block).copied().filter(|z| *z > 0.0);
            let limit = values().fold(f32::INFINITY, f32::min) * (1.0 + SAME_SURFACE);
            let (sum, count) = values().filter(|z| *z <= limit).fold((0.0, 0.0), |(s, n), z| (s + z, n + 1.0));
            if count > 0.0 {
                *out = sum / count;
            }
        }
    }
    let (width, height) = (width as u32, height as u32);
    let intrinsics = Intrinsics { width, height, ..camera.scaled(1.0 / factor as f64) };
    (intrinsics, DepthImage { width, height, metres })
}

/// The depth picture with each value the mean of its surface around it ([Newcombe 2011], section 3.1): cameras whose depth comes in
/// steps show a plane as a staircase, on which no normal can be fitted. Inverse depths are averaged, in which planes are planes.
fn smoothed(depth: &DepthImage) -> DepthImage {
    let (width, height) = (depth.width as usize, depth.height as usize);
    let mut metres = vec![0.0; width * height];
    metres.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, out)| {
        let rows = row.saturating_sub(HALF_WINDOW)..(row + HALF_WINDOW + 1).min(height);
        for (column, out) in out.iter_mut().enumerate() {
            let own = depth.metres[row * width + column];
            if own <= 0.0 {
                continue;
            }
            let columns = column.saturating_sub(HALF_WINDOW)..(column + HALF_WINDOW + 1).min(width);
            let (mut sum, mut count) = (0.0, 0.0);
            for line in rows.clone() {
                for z in &depth.metres[line * width + columns.start..line * width + columns.end] {
                    if (z - own).abs() < SAME_SURFACE * own {
                        sum += 1.0 / z;
                        count += 1.0;
                    }
                }
            }
            *out = count / sum;
        }
    });
    DepthImage { width: depth.width, height: depth.height, metres }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_the_mean_of_its_nearest_surface() {
        let camera = Intrinsics { width: 5, height: 2, fx: 4.0, fy: 4.0, cx: 2.0, cy: 0.5 };
        let metres = vec![1.0, 1.01, 0.0, 0.0, 9.0, 1.0, 2.0, 0.0, 0.0, 9.0];
        let (small, depth) = shrunk(&camera, &DepthImage { width: 5, height: 2, metres }, 2);
        assert_eq!((small.width, small.height), (2, 1));
        assert!((depth.metres[0] - 3.01 / 3.0).abs() < 1e-6 && depth.metres[1] == 0.0, "{:?}", depth.metres);
    }
}
