//! A reconstruction against the true surface, after the alignment that [Eye-in-hand 2020] makes first ("we made the ICP
//! match with the ground truth").

use super::methods::Reconstruction;
use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use semascan_geometry::measure::SurfaceIndex;
use serde::Serialize;

/// Most points that the alignment uses.
const ALIGNED_POINTS: usize = 8000;
/// Rounds of the alignment.
const ROUNDS: u32 = 30;
/// The paper's 3D IoU counts points within this distance, metres.
const NEAR: f64 = 1e-3;

/// Figures of one method in one run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MethodScore {
    /// Mean distance of the object's points from its true surface, millimetres.
    pub c2c_mm: f64,
    /// Share of its points within 1 mm of the true surface (the paper's "3D reconstruction IoU").
    pub precision_1mm: f64,
    /// Mean IoU of the masks over views and classes.
    pub mask_iou: f64,
    /// Points of the reconstruction.
    pub points: u64,
    /// Views that the gravity-centre test refused.
    pub misidentified: u32,
    /// Views whose pose ICP changed.
    pub aligned: u32,
    /// CPU milliseconds a view of the geometric part of the segmentation (there is no network).
    pub segmentation_ms: f64,
    /// CPU milliseconds a view of normals, registration, fusion and stitching.
    pub mapping_ms: f64,
}

/// The true surface.
pub(super) struct TrueSurface {
    index: SurfaceIndex,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl TrueSurface {
    pub(super) fn new(vertices: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { index: SurfaceIndex::new(&vertices, &triangles), vertices, triangles }
    }

    /// Judges what a method made.
    pub(super) fn judge(&self, made: &Reconstruction) -> MethodScore {
        let pose = self.align(&made.points);
        let distances: Vec<f64> = made
            .points
            .iter()
            .filter_map(|&p| self.index.closest(moved(&pose, p)))
            .map(|n| f64::from(n.distance))
            .collect();
        let n = distances.len() as f64;
        MethodScore {
            c2c_mm: distances.iter().sum::<f64>() / n * 1e3,
            precision_1mm: distances.iter().filter(|&&d| d <= NEAR).count() as f64 / n,
            mask_iou: made.mask_iou,
            points: distances.len() as u64,
            misidentified: made.misidentified,
            aligned: made.aligned,
            segmentation_ms: made.segmentation_ms,
            mapping_ms: made.mapping_ms,
        }
    }

    /// Rigid motion that brings `points` onto the surface: point-to-plane ICP from where they are, far points weighing
    /// little. Directions that the shape leaves open stay as they are.
    fn align(&self, points: &[[f32; 3]]) -> Isometry3<f64> {
        let step = points.len().div_ceil(ALIGNED_POINTS).max(1);
        let used: Vec<[f32; 3]> = points.iter().copied().step_by(step).collect();
        let mut pose = Isometry3::identity();
        let Some(centre) = mean(&used) else { return pose };
        for _ in 0..ROUNDS {
            let pairs: Vec<(Vector3<f64>, Vector3<f64>, f64)> = used
                .iter()
                .filter_map(|&p| {
                    let at = moved(&pose, p);
                    let nearest = self.index.closest(at)?;
                    let normal = self.normal(nearest.triangle)?;
                    let error = vector(at) - vector(nearest.point);
                    Some((vector(at) - centre.coords, normal, error.dot(&normal)))
                })
                .collect();
            let mut sizes: Vec<f64> = pairs.iter().map(|p| p.2.abs()).collect();
            if sizes.is_empty() {
                return pose;
            }
            let middle = sizes.len() / 2;
            let width = 3.0 * sizes.select_nth_unstable_by(middle, f64::total_cmp).1.max(1e-5);
            let (mut hessian, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
            for (arm, normal, error) in &pairs {
                let turn = arm.cross(normal);
                let row = Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
                // Geman-McClure.
                let weight = (1.0 + (error / width).powi(2)).powi(-2);
                hessian += weight * row * row.transpose();
                gradient += weight * error * row;
            }
            // A little stiffness holds what the shape does not: radians are brought to metres by the object's size.
            let n = pairs.len() as f64;
            let size = (pairs.iter().map(|p| p.0.norm_squared()).sum::<f64>() / n).max(1e-8);
            for k in 0..6 {
                hessian[(k, k)] += 1e-3 * n * if k < 3 { size } else { 1.0 };
            }
            let Some(update) = hessian.cholesky().map(|c| -c.solve(&gradient)) else { return pose };
            let (w, t) = (Vector3::new(update[0], update[1], update[2]), Vector3::new(update[3], update[4], update[5]));
            let about = Translation3::from(centre.coords);
            let motion = Isometry3::from_parts(Translation3::from(t), UnitQuaternion::from_scaled_axis(w));
            pose = about * motion * about.inverse() * pose;
            if w.norm() * size.sqrt() + t.norm() < 1e-6 {
                break;
            }
        }
        pose
    }

    fn normal(&self, triangle: u32) -> Option<Vector3<f64>> {
        let corner = |k: usize| Some(vector(*self.vertices.get(self.triangles.get(triangle as usize)?[k] as usize)?));
        let (a, b, c) = (corner(0)?, corner(1)?, corner(2)?);
        (b - a).cross(&(c - a)).try_normalize(1e-20)
    }
}

fn vector(p: [f32; 3]) -> Vector3<f64> {
    Vector3::new(p[0].into(), p[1].into(), p[2].into())
}

fn mean(points: &[[f32; 3]]) -> Option<Point3<f64>> {
    let sum: Vector3<f64> = points.iter().map(|&p| vector(p)).sum();
    (!points.is_empty()).then(|| Point3::from(sum / points.len() as f64))
}

fn moved(by: &Isometry3<f64>, p: [f32; 3]) -> [f32; 3] {
    (by * Point3::from(vector(p))).coords.cast::<f32>().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 40 x 30 x 20 mm.
    fn surface() -> TrueSurface {
        let corner = |i: usize| [(i & 1) as f32 * 0.04, (i >> 1 & 1) as f32 * 0.03, (i >> 2) as f32 * 0.02];
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        TrueSurface::new((0..8).map(corner).collect(), triangles)
    }

    /// Points on the box, `off` metres outside of it.
    fn points(off: f32) -> Vec<[f32; 3]> {
        let mut points = Vec::new();
        for i in 0..=20 {
            for j in 0..=20 {
                let (s, t) = (i as f32 / 20.0, j as f32 / 20.0);
                points.push([s * 0.04, t * 0.03, 0.02 + off]);
                points.push([s * 0.04, -off, t * 0.02]);
                points.push([0.04 + off, s * 0.03, t * 0.02]);
                points.push([-off, s * 0.03, t * 0.02]);
            }
        }
        points
    }

    #[test]
    fn a_displaced_cloud_is_brought_back_before_it_is_judged() {
        let off = Isometry3::new(Vector3::new(2e-3, -1e-3, 1.5e-3), Vector3::new(0.02, -0.03, 0.04));
        let made =
            Reconstruction { points: points(0.0).iter().map(|&p| moved(&off, p)).collect(), ..Default::default() };
        let score = surface().judge(&made);
        assert!(score.c2c_mm < 0.02, "{score:?}");
        assert!(score.precision_1mm > 0.999);
    }

    #[test]
    fn figures_follow_p1() {
        // Far points stay far: the alignment does not follow them.
        let mut made = Reconstruction { points: points(0.0), ..Default::default() };
        let good = made.points.len() as f64;
        made.points.extend((0..100).map(|i| [0.1, 0.1 + i as f32 * 1e-4, 0.01]));
        let score = surface().judge(&made);
        assert!((score.precision_1mm - good / (good + 100.0)).abs() < 1e-9, "{score:?}");
        assert!(score.c2c_mm > 5.0);
        assert_eq!(score.points as f64, good + 100.0);
    }
}
