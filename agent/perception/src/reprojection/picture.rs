//! What the judge keeps of a view: its grey picture as a pyramid, corners with their places on the surface, and a coarse
//! depth picture that says what hides what.

use super::corners;
use crate::organized::OrganizedCloud;
use crate::view::{Intrinsics, luma_rounded};
use image::RgbImage;
use semascan_geometry::vector::dot;

/// Halvings go on until a picture has at most this many columns: matches are searched for there first.
const COARSEST_COLUMNS: usize = 400;
/// Corners are looked for in a picture of at most this many columns.
const CORNER_COLUMNS: usize = 700;
/// Edge of a cell of the coarse depth picture, pixels.
pub(super) const DEPTH_CELL: usize = 4;
/// Most corners that are kept of a view.
const MOST_CORNERS: usize = 160;
/// Corners are spread over a grid of this many columns of cells; each cell keeps its best.
const CELLS_ACROSS: usize = 32;
/// Half the square around a corner whose border is looked at for an edge of the surface, pixels of the coarsest picture.
const SUPPORT: f64 = 4.0;
/// Fewest labelled pixels by which a part on a turntable is told from what stands still around it.
const FEWEST_OF_PART: usize = 2000;
/// Farthest that the surface may stray from its tangent plane there, as a share of the distance.
const FLAT: f64 = 0.02;
/// How many of the eight places around a corner must be measured and lie so.
const FLAT_PLACES: usize = 5;
/// Least cosine between the line of sight and the normal: a surface seen more obliquely has no reliable depth.
const OBLIQUE: f64 = 0.3;

/// One grey picture of a pyramid.
#[derive(Clone, Debug)]
pub(super) struct Grey {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Row-major, 0 to 255.
    pub(super) values: Vec<u8>,
}

impl Grey {
    fn of(rgb: &RgbImage) -> Self {
        let values = rgb.pixels().map(|p| luma_rounded(p.0)).collect();
        Self { width: rgb.width() as usize, height: rgb.height() as usize, values }
    }

    /// Half the size: squares of four pixels averaged; an odd last column or row is cut.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut values = Vec::with_capacity(width * height);
        for rows in self.values.chunks_exact(2 * self.width.max(1)).take(height) {
            let (upper, lower) = rows.split_at(self.width);
            for (a, b) in upper.chunks_exact(2).zip(lower.chunks_exact(2)) {
                let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                values.push(((sum + 2) / 4) as u8);
            }
        }
        Self { width, height, values }
    }

    /// The value between pixels, interpolated bilinearly; `None` outside of the picture.
    #[inline]
    pub(super) fn at(&self, u: f64, v: f64) -> Option<f32> {
        if !(u >= 0.0 && v >= 0.0 && u < self.width as f64 - 1.0 && v < self.height as f64 - 1.0) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        let (a, b) = ((u - column as f64) as f32, (v - row as f64) as f32);
        let i = row * self.width + column;
        let [p, q, r, s] = [i, i + 1, i + self.width, i + self.width + 1].map(|i| f32::from(self.values[i]));
        let (upper, lower) = (p + a * (q - p), r + a * (s - r));
        Some(upper + b * (lower - upper))
    }
}

/// A corner of a view, where the picture changes in two directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Column and row in the full picture.
    pub(super) pixel: [f64; 2],
    /// Its point, camera frame, metres.
    pub(super) point: [f64; 3],
    /// Unit normal of the surface there, camera frame.
    pub(super) normal: [f64; 3],
}

/// What the judge keeps of a view.
#[derive(Clone, Debug)]
pub struct JudgedPicture {
    pub(super) camera: Intrinsics,
    /// From the full picture to the coarsest.
    pub(super) levels: Vec<Grey>,
    pub(super) corners: Vec<Corner>,
    /// Nearest depth in each cell of `DEPTH_CELL` pixels, metres; infinite where nothing was measured.
    pub(super) nearest: Vec<f32>,
    /// Farthest depth in each cell; 0 where nothing was measured.
    pub(super) farthest: Vec<f32>,
}

impl JudgedPicture {
    /// Of a view's colours and points, which are of one size. Before a turntable only the part turns as the poses say:
    /// `part` then tells which pixels (row-major) are labelled, and where these are enough, corners are looked for there
    /// alone. What other views show is looked for in the whole picture.
    pub fn new(rgb: &RgbImage, cloud: &OrganizedCloud, part: Option<&dyn Fn(usize) -> bool>) -> Self {
        let part = part.filter(|part| (0..cloud.depth.len()).filter(|&i| part(i)).nth(FEWEST_OF_PART).is_some());
        let wanted = |i: usize| part.is_none_or(|part| part(i));
        let mut levels = vec![Grey::of(rgb)];
        while let Some(last) = levels.last().filter(|last| last.width > COARSEST_COLUMNS) {
            levels.push(last.halved());
        }
        let level = levels.iter().position(|l| l.width <= CORNER_COLUMNS / 2).unwrap_or(levels.len() - 1);
        let corners = select(&levels[level], 1 << level, 1 << (levels.len() - 1), cloud, wanted);
        let (nearest, farthest) = depth_range(cloud);
        Self { camera: cloud.intrinsics, levels, corners, nearest, farthest }
    }

    /// Corners that were found.
    pub fn corners(&self) -> usize {
        self.corners.len()
    }

    /// Nearest and farthest depth measured around the image point (`u`, `v`), metres; `None` where nothing was measured or
    /// outside of the picture.
    pub(super) fn depth_around(&self, u: f64, v: f64) -> Option<(f32, f32)> {
        let pixel = self.camera.pixel(u, v)?;
        let width = self.camera.width as usize;
        let (row, column) = (pixel / width / DEPTH_CELL, pixel % width / DEPTH_CELL);
        let columns = width.div_ceil(DEPTH_CELL);
        let at = row * columns + column;
        (self.farthest[at] > 0.0).then(|| (self.nearest[at], self.farthest[at]))
    }
}

/// The best corner of each cell of a grid, the strongest first.
fn select(
    grey: &Grey,
    factor: usize,
    coarsest: usize,
    cloud: &OrganizedCloud,
    wanted: impl Fn(usize) -> bool,
) -> Vec<Corner> {
    let camera = &cloud.intrinsics;
    let cell = grey.width.div_ceil(CELLS_ACROSS).max(4);
    let columns = grey.width.div_ceil(cell);
    let mut best: Vec<Option<(f32, Corner)>> = vec![None; columns * grey.height.div_ceil(cell)];
    let scale = factor as f64;
    for (score, column, row) in corners::detect(grey) {
        let place = &mut best[row / cell * columns + column / cell];
        if place.is_some_and(|(strongest, _)| strongest >= score) {
            continue;
        }
        // The middle of the small picture's pixel, in the full picture.
        let pixel = [(column as f64 + 0.5) * scale - 0.5, (row as f64 + 0.5) * scale - 0.5];
        let Some(i) = camera.pixel(pixel[0], pixel[1]) else { continue };
        if cloud.normals[i] == [0.0; 3] || cloud.flying[i] || !wanted(i) {
            continue;
        }
        let normal = cloud.normals[i].map(f64::from);
        let Some(seen) = cloud.smooth_point(i) else { continue };
        // The tangent plane at the pixel's own point, met by the ray through the corner.
        let seen = [seen.x, seen.y, seen.z];
        let Some(point) = on_plane(camera, pixel, dot(seen, normal), normal) else { continue };
        if dot(point, normal).abs() < OBLIQUE * dot(point, point).sqrt() {
            continue;
        }
        let reach = SUPPORT * coarsest as f64;
        let around =
            [(-1.0, -1.0), (0.0, -1.0), (1.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (-1.0, 1.0), (0.0, 1.0), (1.0, 1.0)];
        let on_surface = around.iter().filter(|(x, y)| {
            let i = camera.pixel(pixel[0] + reach * x, pixel[1] + reach * y);
            let near = i.filter(|&i| !cloud.flying[i]).and_then(|i| cloud.point(i));
            near.is_some_and(|p| (dot([p.x, p.y, p.z], normal) - dot(point, normal)).abs() < FLAT * point[2])
        });
        if on_surface.count() >= FLAT_PLACES {
            *place = Some((score, Corner { pixel, point, normal }));
        }
    }
    let mut found: Vec<(f32, Corner)> = best.into_iter().flatten().collect();
    // A stable sort: equal scores stay in the order of the grid.
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MOST_CORNERS);
    found.into_iter().map(|(_, corner)| corner).collect()
}

/// Where the ray through a pixel meets the plane `x . normal = offset`, camera frame; `None` where it does not.
pub(super) fn on_plane(camera: &Intrinsics, pixel: [f64; 2], offset: f64, normal: [f64; 3]) -> Option<[f64; 3]> {
    let ray = [(pixel[0] - camera.cx) / camera.fx, (pixel[1] - camera.cy) / camera.fy, 1.0];
    let z = offset / dot(ray, normal);
    (z.is_finite() && z > 0.0).then(|| ray.map(|r| r * z))
}

/// Nearest and farthest depth in each cell, flying pixels left out.
fn depth_range(cloud: &OrganizedCloud) -> (Vec<f32>, Vec<f32>) {
    let (width, height) = (cloud.intrinsics.width as usize, cloud.intrinsics.height as usize);
    let (columns, rows) = (width.div_ceil(DEPTH_CELL), height.div_ceil(DEPTH_CELL));
    let (mut nearest, mut farthest) = (vec![f32::INFINITY; columns * rows], vec![0.0_f32; columns * rows]);
    for (i, &z) in cloud.depth.iter().enumerate().filter(|(i, z)| **z > 0.0 && !cloud.flying[*i]) {
        let at = i / width / DEPTH_CELL * columns + i % width / DEPTH_CELL;
        nearest[at] = nearest[at].min(z);
        farthest[at] = farthest[at].max(z);
    }
    (nearest, farthest)
}
