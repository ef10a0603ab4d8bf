//! What of the known and the expected surface a camera would see: patches are splatted into a small z-buffer, and those are seen
//! that lie no deeper than it at their own pixel. It costs a fraction of a ray through the grid for each pixel, and needs no order.

use crate::coverage::Patch;
use nalgebra::Isometry3;
use semascan_perception::view::Intrinsics;

/// Pixels along the edge of a patch: of fewer neighbours would leave gaps to look through.
const PIXELS_A_PATCH: f64 = 2.0;
/// Depth behind the z-buffer up to which a patch is seen, in patches: the next one of an oblique surface is so much nearer.
const SAME_SURFACE: f32 = 1.4;

/// A camera that is as fine as patches need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glance {
    k: Intrinsics,
    edge: f32,
}

/// A patch that a camera would see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenPatch {
    /// Its place among the patches.
    pub(crate) patch: usize,
    /// Cosine of incidence; 0 for a patch without a normal.
    pub(crate) cosine: f32,
    /// Along the optical axis, metres.
    pub(crate) depth: f32,
}

impl Glance {
    /// The camera `k` made as coarse as patches of `edge` metres at `depth` metres allow.
    pub(crate) fn new(k: &Intrinsics, edge: f64, depth: f64) -> Self {
        let factor = PIXELS_A_PATCH * k.footprint(depth) / edge;
        let k = if factor < 1.0 { k.scaled(factor) } else { *k };
        Self { k, edge: edge as f32 }
    }

    /// The patches that are seen from `table_from_camera`, those that face away left out.
    pub(crate) fn see(&self, patches: &[Patch], table_from_camera: &Isometry3<f64>) -> Vec<SeenPatch> {
        let camera_from_table = table_from_camera.inverse();
        let turn = camera_from_table.rotation.to_rotation_matrix().into_inner().cast::<f32>();
        let shift = camera_from_table.translation.vector.cast::<f32>();
        let eye = table_from_camera.translation.vector.cast::<f32>();
        let (width, height) = (self.k.width as usize, self.k.height as usize);
        let [fx, fy, cx, cy] = [self.k.fx, self.k.fy, self.k.cx, self.k.cy].map(|k| k as f32);
        let mut nearest = vec![f32::INFINITY; width * height];
        let mut projected = Vec::with_capacity(patches.len());
        for (i, patch) in patches.iter().enumerate() {
            let p = turn * nalgebra::Vector3::from(patch.centre) + shift;
            if p.z < self.edge {
                continue;
            }
            let (u, v) = (fx * p.x / p.z + cx, fy * p.y / p.z + cy);
            let (half_u, half_v) = (0.5 * self.edge * fx / p.z, 0.5 * self.edge * fy / p.z);
            let (left, right) = (((u - half_u).ceil()).max(0.0), (u + half_u).floor().min(width as f32 - 1.0));
            let (top, bottom) = (((v - half_v).ceil()).max(0.0), (v + half_v).floor().min(height as f32 - 1.0));
            if left > right || top > bottom {
                continue;
            }
            for row in top as usize..=bottom as usize {
                for pixel in &mut nearest[row * width + left as usize..=row * width + right as usize] {
                    *pixel = pixel.min(p.z);
                }
            }
            if let Some(pixel) = self.k.pixel(u.into(), v.into()) {
                projected.push((i, pixel, p.z));
            }
        }
        let tolerance = SAME_SURFACE * self.edge;
        let seen = |(i, pixel, depth): (usize, usize, f32)| {
            let patch = &patches[i];
            if depth > nearest[pixel] + tolerance {
                return None;
            }
            let way = eye - nalgebra::Vector3::from(patch.centre);
            let cosine = way.dot(&nalgebra::Vector3::from(patch.normal)) / way.norm();
            (cosine >= 0.0).then_some(SeenPatch { patch: i, cosine, depth })
        };
        projected.into_iter().filter_map(seen).collect()
    }
}
