//! The surface that the voxels of one pixel make together.

use semascan_geometry::vector::{dot, unit};

/// Weighted sums over the voxels of one pixel, camera frame, metres.
#[derive(Clone, Copy, Default)]
pub(super) struct Mean {
    pub(super) weight: f32,
    point: [f32; 3],
    normal: [f32; 3],
    /// Of the scalar products of points and normals.
    along: f32,
}

impl Mean {
    /// Adds a voxel's mean point and its sum of weighted normals.
    pub(super) fn add(&mut self, weight: f32, point: [f32; 3], normal: [f32; 3]) {
        self.weight += weight;
        for i in 0..3 {
            self.point[i] += weight * point[i];
            self.normal[i] += normal[i];
        }
        self.along += dot(point, normal);
    }

    /// The surface's point and unit normal; `None` without voxels.
    ///
    /// On a surface of curvature `k` the normal turns by `k x` over a way `x`, and the surface falls by `k x^2 / 2`: half
    /// of the covariance of points and normals, whatever the direction in which it bends, and to either side. Noise of
    /// the two is independent.
    pub(super) fn surface(&self) -> Option<([f32; 3], [f32; 3])> {
        if self.weight <= 0.0 {
            return None;
        }
        let point = self.point.map(|c| c / self.weight);
        let normal = unit(self.normal, 0.0).unwrap_or_default();
        let lost = 0.5 * (self.along - dot(point, self.normal)) / self.weight;
        Some((std::array::from_fn(|i| point[i] + lost * normal[i]), normal))
    }
}
