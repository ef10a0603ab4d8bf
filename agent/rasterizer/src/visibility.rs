//! Which triangle is seen at each sample, and how deep: a z-buffer in perspective.

use crate::camera::Camera;
use crate::scene::Scene;
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
pub(crate) struct Corner {
    /// Sample coordinates.
    pub(crate) at: [f32; 2],
    /// 1 / depth, which is linear in the picture.
    pub(crate) inverse_depth: f32,
}

/// What is seen at each sample.
pub(crate) struct Samples {
    pub(crate) depth: DepthBuffer,
    /// Place of the triangle in [`Scene::triangles`].
    triangles: Vec<u32>,
    /// Corners of each vertex of the mesh; `None` behind the camera.
    corners: Vec<Option<Corner>>,
}

impl Samples {
    /// Draws the triangles of `scene` as `camera` sees them. Those that reach behind it are left out.
    pub(crate) fn of(scene: &Scene<'_>, camera: &Camera) -> Self {
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
            let span =
                |values: [f32; 3]| (values[0].min(values[1]).min(values[2]), values[0].max(values[1]).max(values[2]));
            let ((first, last), (left, right)) = (span(rows), span(columns));
            if last < 0.0 || right < 0.0 || first > (height - 1) as f32 || left > (width - 1) as f32 {
                continue;
            }
            // Between two rows or two columns of samples it is not seen.
            let (first, last) = (first.max(0.0), last.min((height - 1) as f32));
            if round_up(first) > last as usize || round_up(left.max(0.0)) > right.min((width - 1) as f32) as usize {
                continue;
            }
            let (first, last) = (round_up(first) / BAND, last as usize / BAND);
            for band in &mut of_band[first..=last] {
                band.push(number);
            }
        }
        // The buffer holds 1 / depth while triangles are drawn, because that is linear along a row; 0 is infinitely far.
        let mut depths = vec![0.0_f32; width * height];
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
        depths.par_iter_mut().for_each(|depth| *depth = 1.0 / *depth);
        Self { depth: DepthBuffer { width, height, depths, camera: *camera }, triangles, corners }
    }

    /// Place of the triangle at a sample in the scene's list; `None` where nothing is seen.
    pub(crate) fn triangle(&self, x: usize, y: usize) -> Option<u32> {
        Some(self.triangles[y * self.depth.width + x]).filter(|number| *number != NOTHING)
    }

    /// The triangle at a sample with the weights of its corners on the surface; `None` where nothing is seen.
    pub(crate) fn hit(&self, scene: &Scene<'_>, x: usize, y: usize) -> Option<([u32; 3], [f32; 3])> {
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
    pub(crate) fn may_show(&self, scene: &Scene<'_>, sample: usize) -> bool {
        self.triangles.get(sample).is_none_or(|number| *number == NOTHING) || self.shows_outside(scene, sample)
    }

    /// Whether the surface at a sample shows its outside.
    pub(crate) fn shows_outside(&self, scene: &Scene<'_>, sample: usize) -> bool {
        let number = self.triangles.get(sample).copied().unwrap_or(NOTHING);
        let triangle = scene.triangles.get(number as usize).filter(|_| number != NOTHING);
        triangle.and_then(|t| whole(&self.corners, *t)).is_some_and(is_outside)
    }
}

/// The least whole number that is no smaller than a value of 0 or more. The baseline of x86-64 has no instruction for `ceil`.
fn round_up(value: f32) -> usize {
    let cut = value as usize;
    cut + usize::from(value > cut as f32)
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

/// Edge functions of a triangle: the weights of its corners are linear in the picture. Coordinates are those from its first
/// corner, so that single precision does for small triangles far from the picture's origin.
struct Edges {
    /// The first corner.
    origin: [f32; 2],
    /// `weight = a x + b y + c` of each corner.
    rows: [[f32; 3]; 3],
}

impl Edges {
    /// `None` where the triangle has no area in the picture.
    fn of(corners: [Corner; 3]) -> Option<Self> {
        let origin = corners[0].at;
        let [a, b, c] = corners.map(|corner| [0, 1].map(|axis| f64::from(corner.at[axis]) - f64::from(origin[axis])));
        let area = doubled_area(corners);
        if area.abs() < 1e-12 {
            return None;
        }
        let edge = |p: [f64; 2], q: [f64; 2]| {
            [p[1] - q[1], q[0] - p[0], p[0] * q[1] - q[0] * p[1]].map(|value| (value / area) as f32)
        };
        Some(Self { origin, rows: [edge(b, c), edge(c, a), edge(a, b)] })
    }

    /// The columns of row `y` in which no weight is negative, as far as single precision tells: a sample on the common edge
    /// of two triangles belongs to both, and none is left open.
    fn columns(&self, y: f32) -> (f32, f32) {
        const SLACK: f32 = 1e-5;
        let [left, top] = self.origin;
        let (mut first, mut last) = (f32::NEG_INFINITY, f32::INFINITY);
        for [a, b, c] in self.rows {
            let rest = -SLACK - (b * (y - top) + c);
            if a > 0.0 {
                first = first.max(rest / a);
            } else if a < 0.0 {
                last = last.min(rest / a);
            } else if rest > 0.0 {
                return (f32::INFINITY, f32::NEG_INFINITY);
            }
        }
        (left + first, left + last)
    }

    /// Value at the first corner, and its growth by column and row, of what is linear in the picture and has these values at
    /// the corners.
    fn linear(&self, values: [f32; 3]) -> [f32; 3] {
        let growth = |axis: usize| (1..3).map(|corner| self.rows[corner][axis] * (values[corner] - values[0])).sum();
        [values[0], growth(0), growth(1)]
    }
}

/// Draws one triangle into a band that begins with row `top`.
fn fill(depths: &mut [f32], triangles: &mut [u32], width: usize, top: usize, number: u32, corners: [Corner; 3]) {
    let Some(edges) = Edges::of(corners) else { return };
    let rows = depths.len() / width;
    let y = corners.map(|corner| corner.at[1]);
    let (low, high) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
    let first = (low.max(top as f32) as usize).max(top);
    let last = if high < 0.0 { 0 } else { (high as usize + 1).min(top + rows) };
    let x = corners.map(|corner| corner.at[0]);
    let (least, most) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
    let [at_origin, across, down] = edges.linear(corners.map(|corner| corner.inverse_depth));
    let origin = edges.origin;
    for y in first..last {
        let (left, right) = edges.columns(y as f32);
        // Rounded outwards by less than the slack of the edges.
        let (left, right) = (left.max(least - 1e-3).max(0.0), right.min(most + 1e-3));
        if right < left {
            continue;
        }
        let (left, right) = (round_up(left), (right as usize + 1).min(width));
        if right <= left {
            continue;
        }
        let start = (y - top) * width;
        let at_column = at_origin + down * (y as f32 - origin[1]);
        let row = depths[start + left..start + right].iter_mut().zip(&mut triangles[start + left..start + right]);
        for (x, (inverse, triangle)) in (left..right).zip(row) {
            let value = at_column + across * (x as f32 - origin[0]);
            // Of equally deep ones the first stays.
            if value > *inverse {
                (*inverse, *triangle) = (value, number);
            }
        }
    }
}
