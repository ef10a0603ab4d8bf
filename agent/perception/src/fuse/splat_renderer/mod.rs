//! The map as a camera sees it: a z-buffered splat of the voxels, what registration aligns a view against.
//!
//! Each voxel that faces the camera covers a square of its own size; the nearest surface wins a pixel, so that the far
//! side of the part does not shine through the gaps between voxels ([Zwicker 2001] gives the footprint). A noisy
//! surface is a shell of voxels of which the front ones are the worst: taking the nearest would bias the picture
//! towards the camera by the noise. So of the voxels of the nearest shell the one with the most evidence close to the
//! pixel's centre names the surface, and the pixel shows the weighted mean of the voxels about it that lie in the
//! pixel. Of a curved surface the mean lies inside; by how much, their normals tell, and it is given back.
//!
//! Rows are split into bands, and each band sees its bricks in the order of the map, so the picture does not depend on
//! the number of threads.

mod eye;
mod mean;

use super::brick::Voxel;
use super::keys::{BRICK_EDGE, within_brick};
use super::map::SemanticMap;
use crate::register::{ModelSurface, ModelView, OrientedPoints};
use crate::view::Intrinsics;
use eye::{Eye, LARGEST_SPLAT};
use mean::Mean;
use nalgebra::Isometry3;
use rayon::prelude::*;
use semascan_geometry::grid::{ceil, floor};
use semascan_geometry::vector::unit;
use semascan_model::PointFlags;
use std::ops::Range;

/// Rows that one job draws.
const BAND: usize = 64;
/// Half edge of a voxel's splat in voxels: mean points of neighbouring voxels may be nearly two voxels apart.
const SPLAT: f32 = 1.0;
/// Voxels within this depth of the nearest one, in voxels, may belong to the same surface.
const SHELL: f32 = 4.0;
/// Voxels within this depth of the one with the most evidence, in voxels, do.
const SAME_SURFACE: f32 = 1.5;
/// No brick.
const NONE: u32 = u32::MAX;

/// What a pixel of the picture shows so far.
#[derive(Clone, Copy)]
struct Shown {
    /// Depth of the nearest splat, metres.
    nearest: f32,
    /// Depth of the kept voxel.
    depth: f32,
    /// Evidence of the kept voxel, less the farther its image lies from the pixel's centre.
    merit: f32,
    brick: u32,
    slot: u16,
}

impl ModelSurface for SemanticMap {
    fn view(&self, intrinsics: &Intrinsics, table_from_camera: &Isometry3<f64>) -> ModelView {
        self.render(*intrinsics, table_from_camera)
    }

    fn spacing(&self) -> f64 {
        self.config().voxel
    }

    fn points(&self, wanted: &dyn Fn(u16) -> bool) -> OrientedPoints {
        self.oriented_points(wanted)
    }
}

impl SemanticMap {
    /// `intrinsics` made coarser until a pixel is about a voxel wide at `depth` metres; never finer than it was.
    pub fn model_camera(&self, intrinsics: &Intrinsics, depth: f64) -> Intrinsics {
        let factor = intrinsics.footprint(depth) / self.config.voxel;
        if factor.is_finite() && factor > 0.0 && factor < 1.0 { intrinsics.scaled(factor) } else { *intrinsics }
    }

    /// The model as a pinhole camera at `table_from_camera` sees it. Outliers and voxels that turn away are not shown.
    pub fn render(&self, intrinsics: Intrinsics, table_from_camera: &Isometry3<f64>) -> ModelView {
        let (width, height) = (intrinsics.width as usize, intrinsics.height as usize);
        let pixels = width * height;
        let mut picture = ModelView {
            intrinsics,
            table_from_camera: *table_from_camera,
            points: vec![[0.0; 3]; pixels],
            normals: vec![[0.0; 3]; pixels],
            labels: vec![0; pixels],
            instances: vec![0; pixels],
        };
        if pixels == 0 {
            return picture;
        }
        let eye = Eye::new(intrinsics, self.config.voxel, table_from_camera);
        let bands = self.bricks_by_band(&eye);
        picture
            .points
            .par_chunks_mut(BAND * width)
            .zip(picture.normals.par_chunks_mut(BAND * width))
            .zip(picture.labels.par_chunks_mut(BAND * width))
            .zip(picture.instances.par_chunks_mut(BAND * width))
            .enumerate()
            .for_each(|(band, (((points, normals), labels), instances))| {
                let rows = (band * BAND) as i32..(band * BAND + points.len() / width) as i32;
                let (shown, splats) = self.draw(&eye, &bands[band], &rows);
                let means = self.average(&eye, &splats, &shown);
                for (i, shown) in shown.iter().enumerate().filter(|(_, s)| s.brick != NONE) {
                    let brick = &self.bricks[shown.brick as usize];
                    let voxel = &brick.voxels[usize::from(shown.slot)];
                    (points[i], normals[i]) = means[i].surface().unwrap_or_else(|| {
                        let corner = eye.corner(self.keys[shown.brick as usize]);
                        (eye.point(corner, within(voxel)), unit(eye.turned(voxel.normal), 0.0).unwrap_or_default())
                    });
                    labels[i] = voxel.label;
                    instances[i] = voxel.instance;
                }
            });
        picture
    }

    /// For each band of rows the bricks that may show in it, in the order of the map.
    fn bricks_by_band(&self, eye: &Eye) -> Vec<Vec<u32>> {
        let bands = (eye.k.height as usize).div_ceil(BAND);
        let spans: Vec<Option<(usize, usize)>> = self.keys.par_iter().map(|key| eye.rows(*key)).collect();
        let mut lists = vec![Vec::new(); bands];
        for (i, span) in spans.into_iter().enumerate() {
            let Some((first, last)) = span else { continue };
            for list in &mut lists[first / BAND..=last / BAND] {
                list.push(i as u32);
            }
        }
        lists
    }

    /// Splats the voxels of `bricks` onto the pixels of `rows`; also those whose own pixel is among them.
    fn draw(&self, eye: &Eye, bricks: &[u32], rows: &Range<i32>) -> (Vec<Shown>, Vec<Splat>) {
        let width = eye.k.width as usize;
        let empty = Shown { nearest: f32::INFINITY, depth: f32::INFINITY, merit: 0.0, brick: NONE, slot: 0 };
        let mut shown = vec![empty; rows.len() * width];
        let mut splats = Vec::new();
        let [fx, fy, cx, cy] = [eye.k.fx, eye.k.fy, eye.k.cx, eye.k.cy].map(|k| k as f32);
        let (last_column, first_row, last_row) = (eye.k.width as i32 - 1, rows.start, rows.end - 1);
        let edge = eye.edge as f32;
        let (spread_u, spread_v, shell) = (SPLAT * edge * fx, SPLAT * edge * fy, SHELL * edge);
        for &b in bricks {
            let key = self.keys[b as usize];
            let corner = eye.corner(key);
            let lowest = key.0.map(|c| f64::from(c * BRICK_EDGE));
            let centre: [f32; 3] = std::array::from_fn(|i| (eye.centre[i] / eye.edge - lowest[i]) as f32);
            for (slot, voxel) in self.bricks[b as usize].voxels.iter().enumerate().step_by(eye.step(corner)) {
                let q = within(voxel);
                let facing: f32 = (0..3).map(|i| voxel.normal[i] * (q[i] - centre[i])).sum();
                if facing >= 0.0 || voxel.flags.has(PointFlags::OUTLIER) {
                    continue;
                }
                let [x, y, z] = eye.point(corner, q);
                if z < edge {
                    continue;
                }
                let near = 1.0 / z;
                let (u, v) = (fx * x * near + cx, fy * y * near + cy);
                let half_u = (spread_u * near).clamp(0.5, LARGEST_SPLAT);
                let half_v = (spread_v * near).clamp(0.5, LARGEST_SPLAT);
                let (left, right) = (ceil(u - half_u).max(0), floor(u + half_u).min(last_column));
                let own = (floor(u + 0.5), floor(v + 0.5));
                if (0..=last_column).contains(&own.0) && rows.contains(&own.1) {
                    let at = (own.1 - first_row) as u32 * eye.k.width + own.0 as u32;
                    splats.push(Splat { at, point: [x, y, z], brick: b, slot: slot as u16 });
                }
                let (top, bottom) = (ceil(v - half_v).max(first_row), floor(v + half_v).min(last_row));
                for row in top..=bottom {
                    let start = (row - first_row) as usize * width;
                    let dv = row as f32 - v;
                    for column in left..=right {
                        let pixel = &mut shown[start + column as usize];
                        if z > pixel.nearest + shell {
                            continue;
                        }
                        pixel.nearest = pixel.nearest.min(z);
                        let du = column as f32 - u;
                        let merit = voxel.weight / (0.25 + du * du + dv * dv);
                        if merit > pixel.merit || pixel.depth > pixel.nearest + shell {
                            (pixel.depth, pixel.merit, pixel.brick, pixel.slot) = (z, merit, b, slot as u16);
                        }
                    }
                }
            }
        }
        (shown, splats)
    }

    /// Weighted means of the voxels that lie in a pixel and belong to the surface that is `shown` there.
    fn average(&self, eye: &Eye, splats: &[Splat], shown: &[Shown]) -> Vec<Mean> {
        let same = SAME_SURFACE * eye.edge as f32;
        let mut means = vec![Mean::default(); shown.len()];
        for splat in splats {
            if (splat.point[2] - shown[splat.at as usize].depth).abs() > same {
                continue;
            }
            let voxel = &self.bricks[splat.brick as usize].voxels[usize::from(splat.slot)];
            means[splat.at as usize].add(voxel.weight, splat.point, eye.turned(voxel.normal));
        }
        means
    }
}

/// A voxel that turns to the camera, in the pixel that its mean point falls into.
struct Splat {
    at: u32,
    /// Camera frame, metres.
    point: [f32; 3],
    brick: u32,
    slot: u16,
}

/// The voxel's mean point in voxels from its brick's lowest corner.
fn within(voxel: &Voxel) -> [f32; 3] {
    let inverse = 1.0 / voxel.weight;
    let cell = within_brick(voxel.local);
    std::array::from_fn(|i| f32::from(cell[i]) + voxel.offset[i] * inverse)
}

#[cfg(test)]
mod tests;
