//! A planned capture: where the camera stands and how the table is turned.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A planned capture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Viewpoint {
    /// Camera in the static turntable frame.
    pub(super) tablebase_from_camera: Isometry3<f64>,
    /// Radians.
    pub(super) table_angle: f64,
}

/// Camera at `eye` that looks at `target` with the picture's top towards +z.
pub(super) fn look_at(eye: Point3<f64>, target: Point3<f64>) -> Isometry3<f64> {
    let forward = (target - eye).normalize();
    let right = forward.cross(&Vector3::z());
    let right = if right.norm() < 1e-6 { Vector3::x() } else { right.normalize() };
    let down = forward.cross(&right);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&rotation))
}
