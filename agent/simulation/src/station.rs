//! The inspection station as a kinematic chain: where the camera is, and where the robot believes it is.
//!
//! [Remanufacturing paper], Eq. 1:
//! `table_from_camera = Rz(-phi) * tablebase_from_base * base_from_ee * ee_from_camera`. Views are planned in the
//! reported chain; the true pose follows from the true chain, which differs by constant calibration errors (hand-eye,
//! turntable axis) and by a new error for every view (robot repeatability, table angle). The chain is private to the
//! generator: the registration has its own, and truth must not come from the code that it checks.

use nalgebra::{Isometry3, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

use super::random::Stream;
use semascan_inspection::planning::Viewpoint;
use semascan_perception::view::Chain;

/// Standard deviations of the station's errors, in radians and metres for each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorModel {
    /// Hand-eye calibration: rotation, translation. Constant.
    pub hand_eye: (f64, f64),
    /// Turntable calibration: rotation, translation. Constant.
    pub table: (f64, f64),
    /// Robot: rotation, translation. New for every view.
    pub robot: (f64, f64),
    /// Whether the robot's error fills a ball evenly, with a hard limit of sqrt(5) standard deviations, instead of being
    /// normally distributed.
    pub robot_limited: bool,
    /// Table angle. New for every view.
    pub table_angle: f64,
}

impl ErrorModel {
    /// A calibrated cell of ordinary quality: 0.1 to 0.2 degrees and some tenths of a millimetre in all.
    pub const DEFAULT: Self = Self {
        hand_eye: (1.2e-3, 2.5e-4),
        table: (8e-4, 2.0e-4),
        robot: (3e-4, 5e-5),
        robot_limited: false,
        table_angle: 4e-4,
    };
    /// A perfect cell.
    pub const NONE: Self =
        Self { hand_eye: (0.0, 0.0), table: (0.0, 0.0), robot: (0.0, 0.0), robot_limited: false, table_angle: 0.0 };
    /// A worn or badly calibrated robot: every view is off by up to 1 degree and 3 mm, evenly.
    pub const ROUGH: Self = Self { robot: (0.007_805_4, 1.341_641e-3), robot_limited: true, ..Self::DEFAULT };
}

/// Standard deviation that even a perfect cell states: a microradian and a micrometre.
const FLOOR: f64 = 1e-6;

/// One capture: what the station reports, how sure it is, and what is true.
#[derive(Clone, Debug)]
pub(super) struct StationPose {
    pub(super) chain: Chain,
    /// Over (rotation, translation) of the camera in its own frame: `true = reported * exp(xi)`.
    pub(super) covariance: Matrix6<f64>,
    pub(super) table_from_camera: Isometry3<f64>,
    /// The true angle of the table.
    pub(super) table_angle: f64,
}

/// Robot, camera mount and turntable.
#[derive(Clone, Debug)]
pub(super) struct Station {
    base_from_tablebase: Isometry3<f64>,
    ee_from_camera: Isometry3<f64>,
    true_base_from_tablebase: Isometry3<f64>,
    true_ee_from_camera: Isometry3<f64>,
    errors: ErrorModel,
    seed: u64,
}

impl Station {
    /// A station of `seed`; its calibration errors are drawn once.
    pub(super) fn new(seed: u64, errors: ErrorModel) -> Self {
        let mut s = Stream::new(seed, "station");
        let turn = f64::from(s.range(-0.2, 0.2));
        let base_from_tablebase = Isometry3::from_parts(
            Translation3::new(0.62, -0.08, 0.11),
            UnitQuaternion::from_euler_angles(0.0, 0.0, turn),
        );
        // The camera hangs beside the flange and looks along the tool axis.
        let ee_from_camera = Isometry3::from_parts(
            Translation3::new(-0.05, 0.075, 0.06),
            UnitQuaternion::from_euler_angles(0.03, -0.02, 1.571),
        );
        let mut draw = |(rotation, translation)| small(&mut s, rotation, translation);
        let (hand_eye, table) = (draw(errors.hand_eye), draw(errors.table));
        Self {
            base_from_tablebase,
            ee_from_camera,
            true_base_from_tablebase: base_from_tablebase * table,
            true_ee_from_camera: ee_from_camera * hand_eye,
            errors,
            seed,
        }
    }

    /// Moves robot and table to a planned viewpoint.
    pub(super) fn move_to(&self, viewpoint: &Viewpoint, index: u32) -> StationPose {
        let phi = viewpoint.table_angle;
        let base_from_ee = self.base_from_tablebase * viewpoint.tablebase_from_camera * self.ee_from_camera.inverse();
        let chain = Chain {
            base_from_ee,
            ee_from_camera: self.ee_from_camera,
            base_from_tablebase: self.base_from_tablebase,
            table_angle: phi,
        };
        let mut s = Stream::new(self.seed, &format!("view {index}"));
        let (rotation, translation) = self.errors.robot;
        let robot = if self.errors.robot_limited {
            within(&mut s, rotation, translation)
        } else {
            small(&mut s, rotation, translation)
        };
        let table_angle = phi + s.normal(self.errors.table_angle);
        let table_from_camera = camera_pose(
            &(base_from_ee * robot),
            &self.true_ee_from_camera,
            &self.true_base_from_tablebase,
            table_angle,
        );
        StationPose { chain, covariance: self.covariance(viewpoint), table_from_camera, table_angle }
    }

    /// First-order sum of all errors, each carried from the frame it arises in to the camera; never quite zero, so that
    /// it can be inverted.
    fn covariance(&self, viewpoint: &Viewpoint) -> Matrix6<f64> {
        let e = &self.errors;
        let camera_from_tablebase = viewpoint.tablebase_from_camera.inverse();
        let camera_from_ee = self.ee_from_camera.inverse();
        let spread = |(rotation, translation): (f64, f64)| {
            let (r, t) = (rotation * rotation, translation * translation);
            Matrix6::from_diagonal(&Vector6::new(r, r, r, t, t, t))
        };
        let carried = |a: Matrix6<f64>, c: Matrix6<f64>| a * c * a.transpose();
        let angle = Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, e.table_angle.powi(2), 0.0, 0.0, 0.0));
        let at_table = adjoint(&camera_from_tablebase);
        Matrix6::identity() * FLOOR.powi(2)
            + spread(e.hand_eye)
            + carried(adjoint(&camera_from_ee), spread(e.robot))
            + carried(at_table, spread(e.table))
            + carried(at_table, angle)
    }
}

/// The camera's pose in the table frame ([Remanufacturing paper], Eq. 1).
fn camera_pose(
    base_from_ee: &Isometry3<f64>,
    ee_from_camera: &Isometry3<f64>,
    base_from_tablebase: &Isometry3<f64>,
    table_angle: f64,
) -> Isometry3<f64> {
    let table_from_tablebase = Rotation3::from_axis_angle(&Vector3::z_axis(), -table_angle);
    Isometry3::from_parts(Translation3::identity(), table_from_tablebase.into())
        * base_from_tablebase.inverse()
        * base_from_ee
        * ee_from_camera
}

fn small(s: &mut Stream, rotation: f64, translation: f64) -> Isometry3<f64> {
    let mut draw = |sigma| Vector3::new(s.normal(sigma), s.normal(sigma), s.normal(sigma));
    let (w, t) = (draw(rotation), draw(translation));
    Isometry3::from_parts(Translation3::from(t), UnitQuaternion::from_scaled_axis(w))
}

/// Rotation and translation vectors spread evenly over balls whose standard deviation on each axis is as given.
fn within(s: &mut Stream, rotation: f64, translation: f64) -> Isometry3<f64> {
    let mut ball = |sigma: f64| {
        let direction = Vector3::new(s.normal(1.0), s.normal(1.0), s.normal(1.0));
        let length = f64::from(s.range(0.0, 1.0)).cbrt() * sigma * 5.0_f64.sqrt();
        direction.try_normalize(1e-9).unwrap_or_else(Vector3::x) * length
    };
    let (w, t) = (ball(rotation), ball(translation));
    Isometry3::from_parts(Translation3::from(t), UnitQuaternion::from_scaled_axis(w))
}

/// Carries a twist (rotation, translation) from frame `b` to frame `a`.
fn adjoint(a_from_b: &Isometry3<f64>) -> Matrix6<f64> {
    let r = *a_from_b.rotation.to_rotation_matrix().matrix();
    let t = a_from_b.translation.vector.cross_matrix();
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&r);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&(t * r));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use semascan_inspection::planning::look_at;

    fn viewpoint(angle: f64) -> Viewpoint {
        let eye = Point3::new(0.2, 0.4, 0.3);
        Viewpoint { tablebase_from_camera: look_at(eye, Point3::new(0.0, 0.0, 0.1)), table_angle: angle }
    }

    #[test]
    fn turning_the_table_moves_the_camera_the_other_way_in_its_frame() {
        // A mark at +x of the table, turned by +90 degrees, stands at +y of the static frame.
        let quarter = std::f64::consts::FRAC_PI_2;
        let pose = Station::new(1, ErrorModel::NONE).move_to(&viewpoint(quarter), 0);
        let mark = Point3::new(0.1, 0.0, 0.05);
        let in_camera = pose.table_from_camera.inverse() * mark;
        let expected = viewpoint(0.0).tablebase_from_camera.inverse() * Point3::new(0.0, 0.1, 0.05);
        assert!((in_camera - expected).norm() < 1e-12);
    }

    #[test]
    fn without_errors_the_reported_chain_is_true() {
        let pose = Station::new(5, ErrorModel::NONE).move_to(&viewpoint(1.2), 3);
        let c = &pose.chain;
        let reported = camera_pose(&c.base_from_ee, &c.ee_from_camera, &c.base_from_tablebase, c.table_angle);
        assert!((reported.inverse() * pose.table_from_camera).translation.vector.norm() < 1e-12);
        assert!(pose.covariance.try_inverse().is_some() && pose.covariance.trace() < 1e-11);
    }

    #[test]
    fn errors_have_the_size_that_the_covariance_states() {
        let (n, mut rotation, mut translation, mut mahalanobis) = (400, 0.0, 0.0, 0.0);
        for seed in 0..n {
            let pose = Station::new(seed, ErrorModel::DEFAULT).move_to(&viewpoint(0.7), 2);
            let c = &pose.chain;
            let reported = camera_pose(&c.base_from_ee, &c.ee_from_camera, &c.base_from_tablebase, c.table_angle);
            let off = reported.inverse() * pose.table_from_camera;
            let (w, t) = (off.rotation.scaled_axis(), off.translation.vector);
            let xi = Vector6::new(w.x, w.y, w.z, t.x, t.y, t.z);
            let inverse = pose.covariance.try_inverse().expect("a full covariance");
            mahalanobis += (xi.transpose() * inverse * xi).x / n as f64;
            rotation += w.norm().to_degrees() / n as f64;
            translation += t.norm() * 1e3 / n as f64;
        }
        assert!((0.08..0.3).contains(&rotation), "{rotation} degrees");
        assert!((0.3..1.5).contains(&translation), "{translation} mm");
        assert!((5.0..7.0).contains(&mahalanobis), "six degrees of freedom, got {mahalanobis}");
    }
}
