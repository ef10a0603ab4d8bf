//! Kinematic registration: P0 Eq. 1, the robot's and the turntable's readings give the camera's pose.
//!
//! `table_from_camera = Rz(-phi) * tablebase_from_base * base_from_ee * ee_from_camera`. The sign of phi follows from
//! `tablebase_from_table = Rz(phi)`: the table frame turns with the part, so a point fixed in it moves by +phi.

use super::{Method, RegisterError, Registrar, Registration, RegistrationInput};
use crate::view::{Chain, PoseEvidence, View};
use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3};

impl Chain {
    /// Camera pose in the rotating table frame (P0 Eq. 1).
    pub fn table_from_camera(&self) -> Isometry3<f64> {
        let table_from_tablebase = Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -self.table_angle),
        );
        table_from_tablebase * self.base_from_tablebase.inverse() * self.base_from_ee * self.ee_from_camera
    }
}

/// What the kinematics say of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Camera pose.
    pub table_from_camera: Isometry3<f64>,
    /// Over (rotation, translation), radians and metres, camera frame.
    pub covariance: Matrix6<f64>,
}

/// The pose that `view`'s evidence gives.
///
/// # Errors
/// [`RegisterError`] if there is none, or it is no rigid transform.
pub fn prior(view: &View) -> Result<Prior, RegisterError> {
    let (pose, covariance, field) = match &view.pose {
        PoseEvidence::Chain { chain, covariance } => (chain.table_from_camera(), covariance, "chain"),
        PoseEvidence::World { table_from_camera, covariance } => (*table_from_camera, covariance, "camera pose"),
        PoseEvidence::None => return Err(RegisterError::NoEvidence),
    };
    let finite = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite());
    if !finite {
        return Err(RegisterError::BadEvidence { field, reason: "not finite".into() });
    }
    if (pose.rotation.norm() - 1.0).abs() > 1e-6 {
        return Err(RegisterError::BadEvidence { field, reason: "rotation is not a unit quaternion".into() });
    }
    Ok(Prior { table_from_camera: pose, covariance: *covariance })
}

/// Trusts the kinematics: the pose is the prior.
#[derive(Clone, Copy, Debug, Default)]
pub struct KinematicRegistrar;

impl Registrar for KinematicRegistrar {
    fn register(&mut self, input: &RegistrationInput<'_>) -> Result<Registration, RegisterError> {
        let Prior { table_from_camera, covariance } = prior(input.view)?;
        Ok(Registration { table_from_camera, prior: Some(table_from_camera), covariance, method: Method::Kinematic })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn a_point_on_the_part_stays_put_while_the_table_turns() {
        let base_from_tablebase = Isometry3::new(Vector3::new(0.7, 0.1, 0.2), Vector3::new(0.0, 0.0, 0.4));
        let ee_from_camera = Isometry3::new(Vector3::new(0.02, 0.0, 0.08), Vector3::new(0.1, -0.05, 0.3));
        let base_from_ee = Isometry3::new(Vector3::new(0.3, -0.2, 0.6), Vector3::new(2.4, 0.3, 0.1));
        let on_part = Point3::new(0.05, 0.02, 0.1);
        for table_angle in [0.0_f64, 0.5, 2.0, -1.0] {
            let chain = Chain { base_from_ee, ee_from_camera, base_from_tablebase, table_angle };
            // Where the camera sees the point, by walking the chain forwards.
            let tablebase_from_table = Isometry3::rotation(Vector3::z() * table_angle);
            let in_base = base_from_tablebase * tablebase_from_table * on_part;
            let in_camera = (base_from_ee * ee_from_camera).inverse() * in_base;
            assert!((chain.table_from_camera() * in_camera - on_part).norm() < 1e-12);
        }
    }
}
