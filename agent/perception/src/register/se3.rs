//! Rigid motions near a pose as six numbers (a twist): rotation vector in radians, then translation in metres.
//!
//! [`exp`] and [`log`] are those of SO(3) x R^3, the chart that pose covariances use: `moved = pose * (R(omega), t)`,
//! expressed in the frame that the pose maps from (the camera). Rotation and translation are separate, unlike in the
//! exponential map of SE(3) proper, so it needs no series and inverts exactly.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

/// The rigid motion of a twist.
pub fn exp(twist: &Vector6<f64>) -> Isometry3<f64> {
    let (rotation, translation) = halves(twist);
    Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::from_scaled_axis(rotation))
}

/// `pose * exp(twist)`, its rotation of unit length: a quaternion that is off by rounding is off by twice as much once it is
/// inverted and multiplied, so that poses that are found one from the other would lose it within a few hundred steps.
pub fn advance(pose: &Isometry3<f64>, twist: &Vector6<f64>) -> Isometry3<f64> {
    let mut advanced = pose * exp(twist);
    advanced.rotation.renormalize();
    advanced
}

/// The twist that carries `from` to `to`: `from * exp(twist) == to`.
pub fn log(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let between = from.inverse() * to;
    let (w, t) = (between.rotation.scaled_axis(), between.translation.vector);
    Vector6::new(w.x, w.y, w.z, t.x, t.y, t.z)
}

/// Rotation and translation part.
pub fn halves(twist: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned())
}

/// Takes a twist about the origin of a frame to the twist about `centre` in that frame: the same motion to first
/// order, its translation that of the centre.
pub fn about(centre: &Point3<f64>) -> Matrix6<f64> {
    let mut out = Matrix6::identity();
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&-centre.coords.cross_matrix());
    out
}

/// Carries a twist of frame `b` to frame `a`, and a covariance by `A C A'`.
pub fn adjoint(a_from_b: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation = *a_from_b.rotation.to_rotation_matrix().matrix();
    let mut out = turned(&rotation);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&(a_from_b.translation.vector.cross_matrix() * rotation));
    out
}

/// Turns both halves of a twist.
pub fn turned(rotation: &Matrix3<f64>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_keep_their_length_where_each_pose_is_found_from_the_one_before() {
        let twist = Vector6::new(0.3, -0.2, 0.25, 0.1, 0.0, 0.0);
        let (mut last, mut pose) = (Isometry3::identity(), Isometry3::identity());
        for _ in 0..2000 {
            let next = advance(&(pose * (last.inverse() * pose)), &twist);
            (last, pose) = (pose, next);
        }
        assert!((pose.rotation.quaternion().norm() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn log_undoes_exp() {
        let from = Isometry3::new(Vector3::new(0.1, -0.2, 0.5), Vector3::new(0.3, 1.0, -0.4));
        let twist = Vector6::new(0.02, -0.01, 0.03, 1e-3, -2e-3, 5e-4);
        assert!((log(&from, &(from * exp(&twist))) - twist).norm() < 1e-12);
    }

    #[test]
    fn the_adjoint_carries_a_small_motion_to_another_frame() {
        let a_from_b = Isometry3::new(Vector3::new(0.4, -0.2, 0.5), Vector3::new(0.3, 1.0, -0.4));
        let twist = Vector6::new(1e-6, -2e-6, 3e-6, 1e-6, 2e-6, -1e-6);
        let carried = exp(&(adjoint(&a_from_b) * twist));
        let expected = a_from_b * exp(&twist) * a_from_b.inverse();
        assert!(log(&carried, &expected).norm() < 1e-11);
    }

    #[test]
    fn a_twist_about_a_centre_moves_points_alike() {
        let centre = Point3::new(0.1, 0.2, 0.5);
        let twist = Vector6::new(1e-6, -2e-6, 3e-6, 1e-6, 2e-6, -1e-6);
        let p = Point3::new(-0.05, 0.1, 0.6);
        let (w, v) = halves(&(about(&centre) * twist));
        let moved = exp(&twist) * p;
        assert!((p + w.cross(&(p - centre)) + v - moved).norm() < 1e-11);
    }
}
