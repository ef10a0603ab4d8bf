//! Points of one camera in the picture of another, in single precision: the inner loop of both objectives.

use crate::view::Intrinsics;
use nalgebra::Isometry3;

/// The way from the frame of a source camera into the picture of a target camera.
pub(super) struct IntoPicture {
    rotation: [[f32; 3]; 3],
    translation: [f32; 3],
    /// Focal lengths, and the principal point with half a pixel more: truncation then rounds to the nearest pixel.
    camera: [f32; 4],
    size: [f32; 2],
    width: usize,
}

impl IntoPicture {
    pub(super) fn new(target_from_source: &Isometry3<f64>, camera: &Intrinsics) -> Self {
        let r = target_from_source.rotation.to_rotation_matrix();
        let t = target_from_source.translation.vector;
        Self {
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)] as f32)),
            translation: [t.x as f32, t.y as f32, t.z as f32],
            camera: [camera.fx as f32, camera.fy as f32, camera.cx as f32 + 0.5, camera.cy as f32 + 0.5],
            size: [camera.width as f32, camera.height as f32],
            width: camera.width as usize,
        }
    }

    /// A direction of the source in the target's frame.
    #[inline]
    pub(super) fn turn(&self, p: [f32; 3]) -> [f32; 3] {
        let r = &self.rotation;
        std::array::from_fn(|i| r[i][0] * p[0] + r[i][1] * p[1] + r[i][2] * p[2])
    }

    /// A point of the source in the target's frame, metres.
    #[inline]
    pub(super) fn place(&self, p: [f32; 3]) -> [f32; 3] {
        let turned = self.turn(p);
        std::array::from_fn(|a| turned[a] + self.translation[a])
    }

    /// The target's pixel, row-major, that shows a point of the target's frame; `None` outside of its picture.
    #[inline]
    pub(super) fn pixel(&self, p: [f32; 3]) -> Option<usize> {
        if p[2] <= 0.0 {
            return None;
        }
        let [fx, fy, cx, cy] = self.camera;
        let (u, v) = (fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy);
        let is_inside = u >= 0.0 && v >= 0.0 && u < self.size[0] && v < self.size[1];
        is_inside.then(|| v as usize * self.width + u as usize)
    }
}
