//! The camera on the robot's end effector in closed form: `A X = X B` for the motions between two captures, rotation before
//! translation ([Park and Martin 1994]).

use crate::capture::Capture;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use semascan_perception::register::rigid::nearest_rotation;

/// Smallest rotation between two captures that says anything, radians.
const LEAST_ROTATION: f64 = 0.02;

/// The motions of end effector and camera between two captures, the board at rest: `ee * X == X * camera`.
pub(crate) struct Motion {
    pub(crate) ee: Isometry3<f64>,
    pub(crate) camera: Isometry3<f64>,
}

/// The motions between all pairs of captures.
pub(crate) fn motions(captures: &[&Capture]) -> Vec<Motion> {
    let mut motions = Vec::new();
    for (k, first) in captures.iter().enumerate() {
        for second in &captures[k + 1..] {
            let ee = first.base_from_ee().inverse() * second.base_from_ee();
            let camera = first.camera_from_board * second.camera_from_board.inverse();
            if ee.rotation.angle() > LEAST_ROTATION {
                motions.push(Motion { ee, camera });
            }
        }
    }
    motions
}

/// `ee_from_camera`; `None` if the motions leave it open.
pub(crate) fn closed_form(motions: &[Motion]) -> Option<Isometry3<f64>> {
    // The rotation takes the axes of the camera's motions to those of the end effector's.
    let products = motions.iter().map(|m| m.ee.rotation.scaled_axis() * m.camera.rotation.scaled_axis().transpose());
    let rotation = UnitQuaternion::from_rotation_matrix(&nearest_rotation(&products.sum::<Matrix3<f64>>())?);
    // (R_A - I) t_X = R_X t_B - t_A, for all motions at once.
    let mut left = DMatrix::zeros(3 * motions.len(), 3);
    let mut right = DVector::zeros(3 * motions.len());
    for (k, motion) in motions.iter().enumerate() {
        let turned = motion.ee.rotation.to_rotation_matrix().matrix() - Matrix3::identity();
        left.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&turned);
        let offset = rotation * motion.camera.translation.vector - motion.ee.translation.vector;
        right.fixed_rows_mut::<3>(3 * k).copy_from(&offset);
    }
    let translation = left.svd(true, true).solve(&right, 1e-9).ok()?;
    let translation = Vector3::new(translation[0], translation[1], translation[2]);
    translation.iter().all(|c| c.is_finite()).then(|| Isometry3::from_parts(Translation3::from(translation), rotation))
}
