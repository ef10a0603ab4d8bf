//! How far an estimated camera pose is from the true one.

use nalgebra::Isometry3;

/// Difference of two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// Angle of the relative rotation in radians.
    pub rotation: f64,
    /// Distance of the camera centres in metres.
    pub translation: f64,
}

/// Error of `estimate` against `truth`, both `table_from_camera`.
pub fn pose_error(estimate: &Isometry3<f64>, truth: &Isometry3<f64>) -> PoseError {
    PoseError {
        rotation: estimate.rotation.angle_to(&truth.rotation),
        translation: (estimate.translation.vector - truth.translation.vector).norm(),
    }
}
