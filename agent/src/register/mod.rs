//! View -> pose: where the camera was when it took a view, in the table frame, with covariance.

mod kinematics;
mod model_view;
mod organized;

pub use kinematics::KinematicRegistrar;
pub use model_view::ModelView;
pub use organized::OrganizedCloud;

use crate::acquire::View;
use nalgebra::{Isometry3, Matrix6};

/// Where a view was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    /// Estimated camera pose.
    pub table_from_camera: Isometry3<f64>,
    /// Pose from kinematics alone.
    pub prior: Isometry3<f64>,
    /// Covariance over (rotation, translation), radians and metres, camera frame.
    pub covariance: Matrix6<f64>,
}

/// Why a view's pose could not be had.
#[derive(Debug, thiserror::Error)]
pub enum RegisterError {
    /// The view came without any pose evidence and there is nothing to align it to.
    #[error("no pose evidence: the view carries neither robot readings nor a camera pose")]
    NoEvidence,
    /// A reading is not a rigid transform or not finite.
    #[error("pose evidence {field}: {reason}")]
    BadEvidence {
        /// The reading at fault.
        field: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// Gives a view its pose.
pub trait Registrar: Send {
    /// Pose of `view`, whose organized points are `cloud`.
    ///
    /// # Errors
    /// [`RegisterError`] if no pose can be given; the view is then reported and left out.
    fn register(&mut self, view: &View, cloud: &OrganizedCloud) -> Result<Registration, RegisterError>;
}
