//! The camera that looks at the map.

use crate::fuse::keys::{BRICK_EDGE, BrickKey};
use crate::view::Intrinsics;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Largest half edge of a splat, pixels: bounds the cost of a camera very close to the surface.
pub(super) const LARGEST_SPLAT: f32 = 12.0;
/// Where the picture is coarser than the map, so many voxels a pixel are enough.
const VOXELS_A_PIXEL: f32 = 4.0;

/// The camera, ready for points in voxel units relative to a brick's lowest corner.
pub(super) struct Eye {
    /// Camera from table, times the voxel edge.
    pub(super) turn: [[f32; 3]; 3],
    pub(super) edge: f64,
    pub(super) camera_from_table: Isometry3<f64>,
    /// Camera centre in the table frame, metres.
    pub(super) centre: Point3<f64>,
    pub(super) k: Intrinsics,
}

impl Eye {
    pub(super) fn new(k: Intrinsics, edge: f64, table_from_camera: &Isometry3<f64>) -> Self {
        let camera_from_table = table_from_camera.inverse();
        let turn: Matrix3<f64> = camera_from_table.rotation.to_rotation_matrix().into_inner() * edge;
        Self {
            turn: std::array::from_fn(|r| std::array::from_fn(|c| turn[(r, c)] as f32)),
            edge,
            camera_from_table,
            centre: table_from_camera * Point3::origin(),
            k,
        }
    }

    /// Where many voxels fall into one pixel, every so many of a brick (its corner in the camera frame) are enough.
    pub(super) fn step(&self, corner: [f32; 3]) -> usize {
        let pixels = self.k.fx as f32 * self.edge as f32 / corner[2].max(self.edge as f32);
        (1.0 / (VOXELS_A_PIXEL * pixels * pixels)).clamp(1.0, 64.0) as usize
    }

    /// Lowest corner of a brick in the camera frame.
    pub(super) fn corner(&self, key: BrickKey) -> [f32; 3] {
        let [x, y, z] = key.0.map(|c| f64::from(c * BRICK_EDGE) * self.edge);
        (self.camera_from_table * Point3::new(x, y, z)).cast::<f32>().into()
    }

    /// Camera frame point `q` voxels from `corner`.
    pub(super) fn point(&self, corner: [f32; 3], q: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|r| corner[r] + (self.turn[r][0] * q[0] + self.turn[r][1] * q[1] + self.turn[r][2] * q[2]))
    }

    /// A voxel's sum of weighted normals in the camera frame: the map keeps it in voxels a metre, as it keeps points.
    pub(super) fn turned(&self, normals: [f32; 3]) -> [f32; 3] {
        self.point([0.0; 3], normals)
    }

    /// First and last row in which a brick may show; `None` if it is out of sight.
    pub(super) fn rows(&self, key: BrickKey) -> Option<(usize, usize)> {
        let half = 0.5 * f64::from(BRICK_EDGE);
        let centre = Vector3::from_iterator(key.0.iter().map(|&c| (f64::from(c * BRICK_EDGE) + half) * self.edge));
        let p = self.camera_from_table * Point3::from(centre);
        // The brick's circumscribed sphere and the splats that stick out of it.
        let radius = (half * 3.0_f64.sqrt() + 1.0) * self.edge;
        let (width, height) = (f64::from(self.k.width), f64::from(self.k.height));
        let near = p.z - radius;
        if p.z + radius <= 0.0 {
            return None;
        }
        if near <= radius {
            return Some((0, self.k.height as usize - 1));
        }
        // A sphere's points at depth d >= near: |x / d - p.x / p.z| <= radius (1 + |p.x / p.z|) / near.
        let span = |f: f64, c: f64, x: f64, size: f64| {
            let middle = f * x / p.z + c;
            let reach =
                f * radius * (1.0 + (x / p.z).abs()) / near + f64::from(LARGEST_SPLAT).min(1.0 + f * self.edge / near);
            let (low, high) = ((middle - reach).floor(), (middle + reach).ceil());
            (high >= 0.0 && low <= size - 1.0).then(|| (low.max(0.0) as usize, high.min(size - 1.0) as usize))
        };
        span(self.k.fx, self.k.cx, p.x, width)?;
        span(self.k.fy, self.k.cy, p.y, height)
    }
}
