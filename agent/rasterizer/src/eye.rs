//! A camera, ready for many vertices and blocks: what of the mesh it may see, and where that lies in its picture.

use crate::camera::Camera;
use crate::scene::Block;
use crate::visibility::{Corner, Projected};
use nalgebra::{Matrix3, Point3, Vector3};
use semascan_model::SemanticCloud;

/// A camera, ready to project many vertices.
pub(crate) struct Eye {
    turn: Matrix3<f64>,
    shift: Vector3<f64>,
    /// Focal lengths and principal point, pixels.
    pub(crate) focal: [f64; 2],
    pub(crate) centre: [f64; 2],
    /// Unit normals of the planes through the camera and the edges of its picture, camera frame; they point outwards.
    edges: [Vector3<f64>; 4],
    /// Where the light comes from, table frame.
    lamp: Vector3<f32>,
}

impl Eye {
    pub(crate) fn of(camera: &Camera, lamp: &Vector3<f32>) -> Self {
        let k = &camera.intrinsics;
        let camera_from_table = camera.table_from_camera.inverse();
        let (last_x, last_y) = (f64::from(k.width) - 1.0, f64::from(k.height) - 1.0);
        let edges = [
            Vector3::new(-k.fx, 0.0, -k.cx),
            Vector3::new(k.fx, 0.0, k.cx - last_x),
            Vector3::new(0.0, -k.fy, -k.cy),
            Vector3::new(0.0, k.fy, k.cy - last_y),
        ];
        Self {
            turn: camera_from_table.rotation.to_rotation_matrix().into_inner(),
            shift: camera_from_table.translation.vector,
            focal: [k.fx, k.fy],
            centre: [k.cx, k.cy],
            edges: edges.map(|normal| normal.normalize()),
            lamp: *lamp,
        }
    }

    /// Whether a part of the block's ball lies before the camera and within the edges of its picture.
    pub(crate) fn may_see(&self, block: &Block) -> bool {
        let centre = self.place(&block.centre);
        centre.z + block.radius > 0.0 && self.edges.iter().all(|normal| normal.dot(&centre) <= block.radius)
    }

    /// Whether the block's triangles face the camera rather than not.
    pub(crate) fn is_faced_by(&self, block: &Block) -> bool {
        (self.turn * block.facing).dot(&self.place(&block.centre)) < 0.0
    }

    /// A point of the table frame in that of the camera.
    pub(crate) fn place(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.turn * point.coords + self.shift
    }

    pub(crate) fn project(&self, vertices: &SemanticCloud, vertex: usize) -> Projected {
        let q = self.turn * Vector3::from(vertices.positions[vertex].map(f64::from)) + self.shift;
        if q.z <= 1e-6 {
            return Projected::Behind;
        }
        let inverse_depth = 1.0 / q.z;
        let at = [0, 1].map(|axis| (self.focal[axis] * q[axis] * inverse_depth + self.centre[axis]) as f32);
        let normal = Vector3::from(vertices.normals[vertex]);
        // Without a normal the length is zero and the cosine none.
        let facing = normal.dot(&self.lamp) / normal.norm();
        Projected::Ahead(Corner { at, inverse_depth: inverse_depth as f32, facing })
    }
}
