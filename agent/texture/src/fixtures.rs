//! Small surfaces and photographs of them.

use crate::Photograph;
use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use semascan_model::{SemanticMesh, SemanticPoint};
use semascan_perception::view::Intrinsics;
use std::borrow::Cow;
use std::sync::Arc;

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 400.0, fy: 400.0, cx: 159.5, cy: 119.5 };

/// Adds a square of 20 x 20 cells at height `z`, facing upwards, between two corners.
pub(crate) fn quad(mesh: &mut SemanticMesh, low: [f32; 2], high: [f32; 2], z: f32) {
    const CELLS: u32 = 20;
    let first = mesh.len() as u32;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let share = |axis: usize, n: u32| low[axis] + (high[axis] - low[axis]) * n as f32 / CELLS as f32;
            let position = [share(0, i), share(1, j), z];
            mesh.push(SemanticPoint { position, normal: [0.0, 0.0, 1.0], ..SemanticPoint::UNKNOWN }, false);
        }
    }
    for j in 0..CELLS {
        for i in 0..CELLS {
            let a = first + j * (CELLS + 1) + i;
            let (b, c, d) = (a + 1, a + CELLS + 1, a + CELLS + 2);
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
}

/// A photograph from `height` metres above the point (`x`, `y`), straight down, of a plane at height 0 that has the colour
/// `color` of its places (metres). No depth was measured.
pub(crate) fn camera_above([x, y]: [f64; 2], height: f64, color: impl Fn(f64, f64) -> [u8; 3]) -> Photograph<'static> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let table_from_camera = Isometry3::from_parts(Translation3::new(x, y, height), down);
    let pixel = |u: u32, v: u32| {
        let p = table_from_camera * CAMERA.unproject(f64::from(u), f64::from(v), height);
        Rgb(color(p.x, p.y))
    };
    Photograph {
        rgb: Arc::new(RgbImage::from_fn(CAMERA.width, CAMERA.height, pixel)),
        depth: Cow::Owned(vec![0.0; (CAMERA.width * CAMERA.height) as usize]),
        intrinsics: CAMERA,
        table_from_camera,
    }
}
