//! What of a true surface poses see: points of it, spread evenly, by ray casting. A point is seen that lies in the picture and in
//! the working distance, under 75 degrees of incidence at most, with nothing before it: whatever the sensor makes of it, which
//! is not the planner's.

use crate::sampling::{Sample, sample};
use glam::Vec3;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use semascan_inspection::planning::Viewpoint;
use semascan_inspection::source::TrueMesh;
use semascan_perception::view::Intrinsics;
use semascan_planning::Reach;
use semascan_simulation::raycast::RayScene;

/// Cosine of the largest incidence (75 degrees).
const GRAZING: f64 = 0.258_819;

/// A true surface, and who looks at it.
pub(super) struct Looked<'a> {
    pub(super) samples: Vec<Sample>,
    obstacles: RayScene,
    camera: &'a Intrinsics,
    reach: &'a Reach,
}

/// How a pose sees a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) cosine: f64,
    /// Along the optical axis, metres.
    pub(super) depth: f64,
}

impl<'a> Looked<'a> {
    /// `count` points of `truth` within the measuring volume, drawn with `seed`.
    pub(super) fn new(
        truth: &TrueMesh,
        (low, high): (Point3<f64>, Point3<f64>),
        (camera, reach): (&'a Intrinsics, &'a Reach),
        count: usize,
        seed: u64,
    ) -> Self {
        let positions: Vec<[f64; 3]> = truth.vertices.iter().map(|p| p.map(f64::from)).collect();
        let inside = |s: &Sample| (0..3).all(|k| (low[k]..=high[k]).contains(&s.position[k]));
        let samples = sample(&positions, &truth.triangles, count, seed).into_iter().filter(inside).collect();
        Self { samples, obstacles: RayScene::new(&truth.vertices, &truth.triangles), camera, reach }
    }

    /// Who looks.
    pub(super) fn camera(&self) -> &Intrinsics {
        self.camera
    }

    /// The points that some of `poses` see.
    pub(super) fn seen_from_any(&self, poses: &[Viewpoint]) -> Vec<bool> {
        let poses: Vec<Isometry3<f64>> = poses.iter().map(Viewpoint::table_from_camera).collect();
        self.samples.par_iter().map(|s| poses.iter().any(|pose| self.is_seen(pose, s))).collect()
    }

    /// The points that a pose sees.
    pub(super) fn seen_from(&self, table_from_camera: &Isometry3<f64>) -> Vec<bool> {
        self.samples.par_iter().map(|s| self.is_seen(table_from_camera, s)).collect()
    }

    fn is_seen(&self, pose: &Isometry3<f64>, s: &Sample) -> bool {
        self.look(pose, self.camera, s).is_some_and(|look| look.cosine >= GRAZING)
    }

    /// How a camera at a pose sees a point; `None` where it does not.
    pub(super) fn look(&self, pose: &Isometry3<f64>, camera: &Intrinsics, s: &Sample) -> Option<Look> {
        let point = Point3::from(s.position);
        let in_camera = pose.inverse_transform_point(&point);
        let (u, v) = camera.project(&in_camera)?;
        camera.pixel(u, v)?;
        let (nearest, farthest) = self.reach.working;
        let towards = Point3::from(pose.translation.vector) - point;
        let cosine = towards.dot(&Vector3::from(s.normal.map(f64::from))) / towards.norm();
        let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        let free = cosine > 0.0
            && (nearest..=farthest).contains(&in_camera.z)
            // On the last thousandth of the way a surface is its own obstacle.
            && !self.obstacles.is_blocked(single(pose.translation.vector), single(-towards), 1.0 - 1e-3);
        free.then_some(Look { cosine, depth: in_camera.z })
    }
}

/// Share of the `reachable` points that the first views have seen, view by view.
pub(super) fn curve(looked: &Looked<'_>, reachable: &[bool], poses: &[Isometry3<f64>]) -> Vec<f64> {
    let all = reachable.iter().filter(|r| **r).count().max(1) as f64;
    let mut covered = vec![false; reachable.len()];
    let add = |pose: &Isometry3<f64>| {
        covered.iter_mut().zip(looked.seen_from(pose)).for_each(|(covered, seen)| *covered |= seen);
        covered.iter().zip(reachable).filter(|(c, r)| **c && **r).count() as f64 / all
    };
    poses.iter().map(add).collect()
}

/// The curve of who knows the part: of `poses` always the one that adds most true surface.
pub(super) fn best_curve(looked: &Looked<'_>, reachable: &[bool], poses: &[Viewpoint], views: u32) -> Vec<f64> {
    let seen: Vec<Vec<bool>> = poses.par_iter().map(|pose| looked.seen_from(&pose.table_from_camera())).collect();
    let mut left: Vec<bool> = reachable.to_vec();
    let all = reachable.iter().filter(|r| **r).count().max(1) as f64;
    let mut curve = Vec::new();
    for _ in 0..views {
        let gain = |seen: &Vec<bool>| seen.iter().zip(&left).filter(|(s, l)| **s && **l).count();
        let gains: Vec<usize> = seen.par_iter().map(gain).collect();
        let Some(best) = (0..poses.len()).reduce(|best, i| if gains[i] > gains[best] { i } else { best }) else {
            break;
        };
        left.iter_mut().zip(&seen[best]).for_each(|(left, seen)| *left &= !seen);
        curve.push(1.0 - left.iter().filter(|l| **l).count() as f64 / all);
    }
    curve
}
