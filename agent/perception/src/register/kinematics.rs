//! Kinematic registration: the robot's and the turntable's readings give the camera's pose ([Remanufacturing paper],
//! Eq. 1).
//!
//! [`Chain`](crate::view::Chain) computes it; or the source says where the camera was.

use super::registration::{Method, RegisterError, Registrar, Registration, RegistrationInput};
use crate::view::{PoseEvidence, View};
use nalgebra::{Isometry3, Matrix6};

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
