//! Which triangle is seen at each sample, and how deep: a z-buffer in perspective.

use crate::camera::Camera;
use crate::curtain::Curtain;
use crate::eye::Eye;
use crate::scene::{Block, Scene};
use crate::shading::lamp;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::RangeInclusive;

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
    /// Cosine between the vertex's normal and the lamp; NaN without a normal.
    pub(crate) facing: f32,
}

/// What a sample shows.
pub(crate) struct Hit {
    /// The vertices of the triangle.
    pub(crate) triangle: [u32; 3],
    /// Weights of its corners on the surface.
    pub(crate) weights: [f32; 3],
    /// [`Corner::facing`] there.
    pub(crate) facing: f32,
    /// Whether it is the outside that is seen.
    pub(crate) is_outside: bool,
}

/// A vertex in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Projected {
    /// No triangle that the picture may show has it.
    NotAsked,
    /// It lies behind the camera.
    Behind,
    /// It is there, or beside the picture.
    Ahead(Corner),
}

/// What is seen at each sample.
pub(crate) struct Samples {
    pub(crate) depth: DepthBuffer,
    /// Place of the triangle in [`Scene::triangles`].
    triangles: Vec<u32>,
    /// Where the light comes from: a unit vector in the table frame.
    pub(crate) lamp: Vector3<f32>,
    /// Each vertex of the mesh in the picture.
    corners: Vec<Projected>,
}

impl Samples {
    /// Draws the triangles of `scene` as `camera` sees them. Those that reach behind it are left out.
    pub(crate) fn of(scene: &Scene<'_>, camera: &Camera) -> Self {
        let (width, height) = (camera.intrinsics.width as usize, camera.intrinsics.height as usize);
        let lamp = lamp(camera);
        let eye = Eye::of(camera, &lamp);
        let mut canvas = Canvas::new(scene, &eye, (width, height));
        // Only what the picture may show is looked at: a picture of one place needs little of the mesh. What faces the camera
        // comes first, because it hides most of the rest.
        let seen = scene.blocks.iter().filter(|block| eye.may_see(block));
        let (front, back): (Vec<&Block>, Vec<&Block>) = seen.partition(|block| eye.is_faced_by(block));
        canvas.draw(&front);
        let curtain = Curtain::of(&canvas.inverse_depths, (width, height));
        canvas.draw(&back.into_iter().filter(|block| !curtain.hides(&eye, block)).collect::<Vec<_>>());
        let Canvas { corners, inverse_depths: mut depths, triangles, .. } = canvas;
        depths.par_iter_mut().for_each(|depth| *depth = 1.0 / *depth);
        Self { depth: DepthBuffer { width, height, depths, camera: *camera }, triangles, lamp, corners }
    }

    /// Place of the triangle at a sample in the scene's list; `None` where nothing is seen.
    pub(crate) fn triangle(&self, x: usize, y: usize) -> Option<u32> {
        Some(self.triangles[y * self.depth.width + x]).filter(|number| *number != NOTHING)
    }

    /// What is seen at a sample; `None` where that is nothing.
    pub(crate) fn hit(&self, scene: &Scene<'_>, x: usize, y: usize) -> Option<Hit> {
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
        let weights = weighted.map(|w| w / sum);
        let facing = (0..3).map(|k| weights[k] * corners[k].facing).sum();
        Some(Hit { triangle, weights, facing, is_outside: is_outside(corners) })
    }

    /// Whether what lies on the surface at a sample can be seen: its outside is, or a rim runs beside it.
    pub(crate) fn may_show(&self, scene: &Scene<'_>, sample: usize) -> bool {
        self.triangles.get(sample).is_none_or(|number| *number == NOTHING) || self.shows_outside(scene, sample)
    }

    /// Whether the surface at a sample shows its outside.
    fn shows_outside(&self, scene: &Scene<'_>, sample: usize) -> bool {
        let number = self.triangles.get(sample).copied().unwrap_or(NOTHING);
        let triangle = scene.triangles.get(number as usize).filter(|_| number != NOTHING);
        triangle.and_then(|t| whole(&self.corners, *t)).is_some_and(is_outside)
    }
}

/// A picture while triangles are drawn into it.
struct Canvas<'a> {
    scene: &'a Scene<'a>,
    eye: &'a Eye,
    /// Columns and rows.
    size: (usize, usize),
    corners: Vec<Projected>,
    /// 1 / depth of each sample, because that is linear along a row; 0 is infinitely far.
    inverse_depths: Vec<f32>,
    triangles: Vec<u32>,
}

impl<'a> Canvas<'a> {
    fn new(scene: &'a Scene<'a>, eye: &'a Eye, size: (usize, usize)) -> Self {
        let samples = size.0 * size.1;
        Self {
            scene,
            eye,
            size,
            corners: vec![Projected::NotAsked; scene.mesh.len()],
            inverse_depths: vec![0.0; samples],
            triangles: vec![NOTHING; samples],
        }
    }

    /// Draws the triangles of `blocks`, those that reach behind the camera left out.
    fn draw(&mut self, blocks: &[&Block]) {
        let Self { scene, eye, size: (width, height), corners, inverse_depths, triangles } = self;
        let (width, height) = (*width, *height);
        let mut of_band: Vec<Vec<u32>> = vec![Vec::new(); height.div_ceil(BAND)];
        for number in blocks.iter().flat_map(|block| block.triangles.clone()) {
            let triangle = scene.triangles[number as usize];
            for vertex in triangle.map(|v| v as usize) {
                if let Projected::NotAsked = corners[vertex] {
                    corners[vertex] = eye.project(&scene.mesh.vertices, vertex);
                }
            }
            let Some(corners) = whole(corners, triangle) else { continue };
            if let Some(rows) = rows_with_samples(corners, (width, height)) {
                of_band[rows.start() / BAND..=rows.end() / BAND].iter_mut().for_each(|band| band.push(number));
            }
        }
        let corners = &*corners;
        inverse_depths
            .par_chunks_mut(BAND * width)
            .zip(triangles.par_chunks_mut(BAND * width))
            .zip(of_band.par_iter().enumerate())
            .for_each(|((depths, triangles), (band, numbers))| {
                for number in numbers {
                    if let Some(corners) = whole(corners, scene.triangles[*number as usize]) {
                        fill(depths, triangles, width, band * BAND, *number, corners);
                    }
                }
            });
    }
}

/// The least whole number that is no smaller than a value of 0 or more. The baseline of x86-64 has no instruction for `ceil`.
fn round_up(value: f32) -> usize {
    let cut = value as usize;
    cut + usize::from(value > cut as f32)
}

fn whole(corners: &[Projected], triangle: [u32; 3]) -> Option<[Corner; 3]> {
    match triangle.map(|v| corners[v as usize]) {
        [Projected::Ahead(a), Projected::Ahead(b), Projected::Ahead(c)] => Some([a, b, c]),
        _ => None,
    }
}

/// The rows of samples that a triangle may cover; `None` where it lies outside of the picture, or between two rows or two
/// columns of samples.
fn rows_with_samples(corners: [Corner; 3], (width, height): (usize, usize)) -> Option<RangeInclusive<usize>> {
    let span = |axis: usize, size: usize| {
        let [a, b, c] = corners.map(|corner| corner.at[axis]);
        let (first, last) = (a.min(b).min(c), a.max(b).max(c));
        let end = (size - 1) as f32;
        if last < 0.0 || first > end {
            return None;
        }
        let (first, last) = (round_up(first.max(0.0)), last.min(end) as usize);
        (first <= last).then_some(first..=last)
    };
    span(0, width)?;
    span(1, height)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Direction;
    use semascan_model::{SemanticMesh, SemanticPoint};
    use std::f32::consts::{PI, TAU};

    /// A ball of radius 0.05 m, 200 by 100 cells, with a hole around its top: its inside is seen through it.
    fn ball_with_a_hole() -> SemanticMesh {
        const AROUND: u32 = 200;
        const DOWN: u32 = 100;
        let mut mesh = SemanticMesh::default();
        for j in 0..=DOWN {
            for i in 0..AROUND {
                let (turn, tilt) = (TAU * i as f32 / AROUND as f32, 0.5 + (PI - 0.5) * j as f32 / DOWN as f32);
                let normal = [tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos()];
                let position = normal.map(|c| 0.05 * c);
                mesh.push(SemanticPoint { position, normal, label: 1, ..SemanticPoint::UNKNOWN }, false);
            }
        }
        // Place by place, as the mesher does.
        let mut cells: Vec<(u32, u32)> = (0..DOWN).flat_map(|j| (0..AROUND).map(move |i| (j, i))).collect();
        cells.sort_by_key(|(j, i)| (j / 8, i / 8));
        for (j, i) in cells {
            let at = |j: u32, i: u32| j * AROUND + i % AROUND;
            let [a, b, c, d] = [at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        mesh
    }

    #[test]
    fn what_the_curtain_hides_would_not_be_seen() {
        let mesh = ball_with_a_hole();
        let scene = Scene::of_shape(&mesh);
        let mut hidden = 0;
        for direction in [Direction::Top, Direction::Isometric, Direction::Front] {
            let camera = Camera::of_all(scene.positions(), direction.axes(), (800, 640)).expect("points");
            let samples = Samples::of(&scene, &camera);
            // All of it at once.
            let eye = Eye::of(&camera, &samples.lamp);
            let (width, height) = (800, 640);
            let mut canvas = Canvas::new(&scene, &eye, (width, height));
            canvas.draw(&scene.blocks.iter().collect::<Vec<_>>());
            let depths: Vec<f32> = canvas.inverse_depths.iter().map(|inverse| 1.0 / inverse).collect();
            assert_eq!(samples.depth.depths, depths, "{direction:?}");
            let curtain = Curtain::of(&canvas.inverse_depths, (width, height));
            hidden += scene.blocks.iter().filter(|block| curtain.hides(&eye, block)).count();
        }
        assert!(hidden > scene.blocks.len() / 4, "{hidden} of three times {}", scene.blocks.len());
    }
}
