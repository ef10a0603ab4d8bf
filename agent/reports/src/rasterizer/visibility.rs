//! Which triangle is seen at each sample, and how deep: a z-buffer in perspective.

use super::camera::Camera;
use super::scene::Scene;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Rows of a band, the unit of work.
const BAND: usize = 32;
/// Marks a sample without a triangle.
const NOTHING: u32 = u32::MAX;

/// Depth along the optical axis of each sample, metres; infinite where nothing is seen.
#[derive(Clone, Debug)]
pub struct DepthBuffer {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` depths.
    pub depths: Vec<f32>,
    /// The camera whose pixels the samples are.
    pub camera: Camera,
}

impl DepthBuffer {
    /// Where a point of the table frame lies in the buffer; `None` outside of it.
    pub fn sample(&self, point: &[f64; 3]) -> Option<(usize, f64)> {
        let (u, v, z) = self.camera.project(point)?;
        Some((self.camera.intrinsics.pixel(u, v)?, z))
    }

    /// Whether nothing lies more than `tolerance` metres before a point of the table frame.
    pub fn shows(&self, point: &[f64; 3], tolerance: f64) -> bool {
        self.sample(point).is_some_and(|(at, z)| z <= f64::from(self.depths[at]) + tolerance)
    }
}

/// A corner of a triangle in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Sample coordinates.
    pub(super) at: [f32; 2],
    /// 1 / depth, which is linear in the picture.
    pub(super) inverse_depth: f32,
}

/// What is seen at each sample.
pub(super) struct Samples {
    pub(super) depth: DepthBuffer,
    /// Place of the triangle in [`Scene::triangles`].
    triangles: Vec<u32>,
    /// Corners of each vertex of the mesh; `None` behind the camera.
    corners: Vec<Option<Corner>>,
}

impl Samples {
    /// Draws the triangles of `scene` as `camera` sees them. Those that reach behind it are left out.
    pub(super) fn of(scene: &Scene<'_>, camera: &Camera) -> Self {
        let k = &camera.intrinsics;
        let (width, height) = (k.width as usize, k.height as usize);
        let camera_from_table = camera.table_from_camera.inverse();
        let (turn, shift) =
            (camera_from_table.rotation.to_rotation_matrix().into_inner(), camera_from_table.translation);
        let project = |p: &[f32; 3]| {
            let q = turn * Vector3::from(p.map(f64::from)) + shift.vector;
            if q.z <= 1e-6 {
                return None;
            }
            let inverse_depth = 1.0 / q.z;
            let at = [k.fx * q.x * inverse_depth + k.cx, k.fy * q.y * inverse_depth + k.cy];
            Some(Corner { at: at.map(|c| c as f32), inverse_depth: inverse_depth as f32 })
        };
        let corners: Vec<Option<Corner>> = scene.mesh.vertices.positions.par_iter().map(project).collect();
        let bands = height.div_ceil(BAND);
        let mut of_band: Vec<Vec<u32>> = vec![Vec::new(); bands];
        for (number, triangle) in (0..).zip(&scene.triangles) {
            let Some([a, b, c]) = whole(&corners, *triangle) else { continue };
            let rows = [a.at[1], b.at[1], c.at[1]];
            let columns = [a.at[0], b.at[0], c.at[0]];
            let span = |values: [f32; 3]| {
                (values[0].min(values[1]).min(values[2]).ceil(), values[0].max(values[1]).max(values[2]).floor())
            };
            let ((first, last), (left, right)) = (span(rows), span(columns));
            if first > last || left > right || last < 0.0 || right < 0.0 {
                continue;
            }
            if first >= height as f32 || left >= width as f32 {
                continue;
            }
            let (first, last) = (first.max(0.0) as usize / BAND, (last as usize).min(height - 1) / BAND);
            for band in &mut of_band[first..=last] {
                band.push(number);
            }
        }
        let mut depths = vec![f32::INFINITY; width * height];
        let mut triangles = vec![NOTHING; width * height];
        depths
            .par_chunks_mut(BAND * width)
            .zip(triangles.par_chunks_mut(BAND * width))
            .zip(of_band.par_iter().enumerate())
            .for_each(|((depths, triangles), (band, numbers))| {
                for number in numbers {
                    if let Some(corners) = whole(&corners, scene.triangles[*number as usize]) {
                        fill(depths, triangles, width, band * BAND, *number, corners);
                    }
                }
            });
        Self { depth: DepthBuffer { width, height, depths, camera: *camera }, triangles, corners }
    }

    /// The triangle at a sample with the weights of its corners on the surface; `None` where nothing is seen.
    pub(super) fn hit(&self, scene: &Scene<'_>, x: usize, y: usize) -> Option<([u32; 3], [f32; 3])> {
        let number = self.triangles[y * self.depth.width + x];
        let triangle = *scene.triangles.get(number as usize).filter(|_| number != NOTHING)?;
        let corners = whole(&self.corners, triangle)?;
        // The areas of the triangles that the sample makes with two corners each, as seen from the sample: small numbers.
        let [a, b, c] = corners.map(|corner| [corner.at[0] - x as f32, corner.at[1] - y as f32]);
        let area = |p: [f32; 2], q: [f32; 2]| p[0] * q[1] - p[1] * q[0];
        let flat = [area(b, c), area(c, a), area(a, b)];
        // Weights in the picture become those on the surface by the depths (perspective correction).
        let weighted = [0, 1, 2].map(|k| flat[k] * corners[k].inverse_depth);
        let sum: f32 = weighted.iter().sum();
        Some((triangle, weighted.map(|w| w / sum)))
    }

    /// Whether what lies on the surface at a sample can be seen: its outside is, or a rim runs beside it.
    pub(super) fn may_show(&self, scene: &Scene<'_>, sample: usize) -> bool {
        self.triangles.get(sample).is_none_or(|number| *number == NOTHING) || self.shows_outside(scene, sample)
    }

    /// Whether the surface at a sample shows its outside.
    pub(super) fn shows_outside(&self, scene: &Scene<'_>, sample: usize) -> bool {
        let number = self.triangles.get(sample).copied().unwrap_or(NOTHING);
        let triangle = scene.triangles.get(number as usize).filter(|_| number != NOTHING);
        triangle.and_then(|t| whole(&self.corners, *t)).is_some_and(is_outside)
    }
}

fn whole(corners: &[Option<Corner>], triangle: [u32; 3]) -> Option<[Corner; 3]> {
    let of = |v: u32| corners.get(v as usize).copied().flatten();
    Some([of(triangle[0])?, of(triangle[1])?, of(triangle[2])?])
}

/// Whether a triangle is seen from outside: its corners are counter-clockwise there, and rows count downwards.
fn is_outside(corners: [Corner; 3]) -> bool {
    doubled_area(corners) < 0.0
}

fn doubled_area(corners: [Corner; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.at.map(f64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Edge functions of a triangle: the weights of its corners are linear in the picture.
struct Edges {
    /// `weight = a x + b y + c` of each corner.
    rows: [[f32; 3]; 3],
}

impl Edges {
    /// `None` where the triangle has no area in the picture.
    fn of(corners: [Corner; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| corner.at.map(f64::from));
        let area = doubled_area(corners);
        if area.abs() < 1e-12 {
            return None;
        }
        let edge = |p: [f64; 2], q: [f64; 2]| {
            [p[1] - q[1], q[0] - p[0], p[0] * q[1] - q[0] * p[1]].map(|value| (value / area) as f32)
        };
        Some(Self { rows: [edge(b, c), edge(c, a), edge(a, b)] })
    }

    fn weights(&self, x: f32, y: f32) -> [f32; 3] {
        self.rows.map(|[a, b, c]| a * x + b * y + c)
    }
}

/// Draws one triangle into a band that begins with row `top`.
fn fill(depths: &mut [f32], triangles: &mut [u32], width: usize, top: usize, number: u32, corners: [Corner; 3]) {
    let Some(edges) = Edges::of(corners) else { return };
    let rows = depths.len() / width;
    let span = |axis: usize, first: usize, count: usize| {
        let values = corners.map(|corner| corner.at[axis]);
        let low = values[0].min(values[1]).min(values[2]).ceil().max(first as f32) as usize;
        let high = values[0].max(values[1]).max(values[2]).floor();
        (low, if high < 0.0 { low } else { (high as usize + 1).min(first + count) })
    };
    let (left, right) = span(0, 0, width);
    let (first, last) = span(1, top, rows);
    for y in first..last {
        for x in left..right {
            let weights = edges.weights(x as f32, y as f32);
            // A sample on the common edge of two triangles belongs to both: none is left open.
            if weights.iter().any(|w| *w < -1e-5) {
                continue;
            }
            let inverse: f32 = (0..3).map(|k| weights[k] * corners[k].inverse_depth).sum();
            let depth = 1.0 / inverse;
            let at = (y - top) * width + x;
            // Of equally deep ones the first stays.
            if depth > 0.0 && depth < depths[at] {
                (depths[at], triangles[at]) = (depth, number);
            }
        }
    }
}
