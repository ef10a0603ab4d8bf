//! The points of a view that take part in its registration: those of the object, thinned (segment ICP,
//! [Eye-in-hand 2020], section 3.2).

use super::model_view::ModelView;
use crate::organized::OrganizedCloud;
use crate::view::Intrinsics;
use nalgebra::{Isometry3, Point3};

/// Points with normals and labels in the camera frame, metres.
#[derive(Clone, Debug)]
pub struct SourcePoints {
    /// Positions.
    pub points: Vec<[f32; 3]>,
    /// Unit normals towards the camera.
    pub normals: Vec<[f32; 3]>,
    /// Component classes, 0 = none or unknown.
    pub labels: Vec<u16>,
    /// How certain each point's depth is, relative to the others: the inverse of its standard deviation. Empty where all are
    /// alike. Distances are scaled by it before they are compared with gates and squared.
    pub certainty: Vec<f32>,
    /// Pixels of the picture that a point stands for.
    pub pixels_per_point: f64,
}

impl Default for SourcePoints {
    fn default() -> Self {
        let (points, normals, labels, certainty) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { points, normals, labels, certainty, pixels_per_point: 1.0 }
    }
}

impl SourcePoints {
    /// Every `stride`-th column and row of `cloud` where a normal is known and `wanted` (row-major pixel index) agrees.
    pub fn select(
        cloud: &OrganizedCloud,
        stride: usize,
        label: impl Fn(usize) -> u16,
        wanted: impl Fn(usize) -> bool,
    ) -> Self {
        let (width, height) = (cloud.intrinsics.width as usize, cloud.intrinsics.height as usize);
        let stride = stride.max(1);
        let mut out = Self { pixels_per_point: (stride * stride) as f64, ..Self::default() };
        for v in (0..height).step_by(stride) {
            for i in (v * width..(v + 1) * width).step_by(stride) {
                if cloud.normals[i] == [0.0; 3] || !wanted(i) {
                    continue;
                }
                let Some(p) = cloud.smooth_point(i) else { continue };
                out.points.push([p.x as f32, p.y as f32, p.z as f32]);
                out.normals.push(cloud.normals[i]);
                out.labels.push(label(i));
            }
        }
        out
    }

    /// Every `step`-th of these points.
    pub fn thinned(&self, step: usize) -> Self {
        let step = step.max(1);
        Self {
            points: self.points.iter().copied().step_by(step).collect(),
            normals: self.normals.iter().copied().step_by(step).collect(),
            labels: self.labels.iter().copied().step_by(step).collect(),
            certainty: self.certainty.iter().copied().step_by(step).collect(),
            pixels_per_point: self.pixels_per_point * step as f64,
        }
    }

    /// The part of `camera`'s picture in which these points lie, with a margin of `reach` metres around them.
    pub(super) fn window(&self, camera: &Intrinsics, reach: f64) -> Intrinsics {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in &self.points {
            let Some((u, v)) = camera.project(&Point3::from(*p).cast()) else { continue };
            let margin = reach / camera.footprint(f64::from(p[2]));
            low = [low[0].min(u - margin), low[1].min(v - margin)];
            high = [high[0].max(u + margin), high[1].max(v + margin)];
        }
        // A picture beyond whose edge points lie counts for nothing: casts saturate, and NaN is 0.
        let edge = |i: usize| (low[i].max(0.0) as u32, (high[i].max(0.0).ceil() as u32).saturating_add(1));
        let ((left, right), (top, bottom)) = (edge(0), edge(1));
        camera.cropped(left, top, right.saturating_sub(left), bottom.saturating_sub(top))
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Mean position; `None` if empty.
    pub fn centroid(&self) -> Option<Point3<f64>> {
        if self.is_empty() {
            return None;
        }
        let mut sum = [0.0_f64; 3];
        for p in &self.points {
            for (s, x) in sum.iter_mut().zip(p) {
                *s += f64::from(*x);
            }
        }
        Some(Point3::from(sum.map(|s| s / self.points.len() as f64)))
    }

    /// Root mean square distance from `centre`, metres.
    pub fn radius(&self, centre: &Point3<f64>) -> f64 {
        let squares: f64 =
            self.points.iter().map(|p| (0..3).map(|i| (f64::from(p[i]) - centre[i]).powi(2)).sum::<f64>()).sum();
        (squares / self.points.len().max(1) as f64).sqrt()
    }
}

impl ModelView {
    /// A view's own surface as something to register against: every `stride`-th column and row of `cloud` where
    /// `wanted` agrees, as a picture `stride` times coarser.
    pub fn of(
        cloud: &OrganizedCloud,
        table_from_camera: Isometry3<f64>,
        stride: usize,
        label: impl Fn(usize) -> u16,
        wanted: impl Fn(usize) -> bool,
    ) -> Self {
        let stride = stride.max(1);
        let full = cloud.intrinsics;
        let (columns, rows) = ((full.width as usize).div_ceil(stride), (full.height as usize).div_ceil(stride));
        let mut intrinsics = full;
        let shrink = stride as f64;
        // Pixel k of the coarse picture is pixel k * stride of the full one.
        intrinsics.width = columns as u32;
        intrinsics.height = rows as u32;
        intrinsics.fx /= shrink;
        intrinsics.fy /= shrink;
        intrinsics.cx /= shrink;
        intrinsics.cy /= shrink;
        let n = columns * rows;
        let mut out = Self {
            intrinsics,
            table_from_camera,
            points: vec![[0.0; 3]; n],
            normals: vec![[0.0; 3]; n],
            labels: vec![0; n],
            instances: vec![0; n],
        };
        for k in 0..n {
            let i = (k / columns) * stride * full.width as usize + (k % columns) * stride;
            if cloud.normals[i] == [0.0; 3] || !wanted(i) {
                continue;
            }
            let Some(p) = cloud.smooth_point(i) else { continue };
            out.points[k] = [p.x as f32, p.y as f32, p.z as f32];
            out.normals[k] = cloud.normals[i];
            out.labels[k] = label(i);
        }
        out
    }
}
