//! Where a view was taken and how that was estimated, and the seam that registrars plug into.

use super::global::{GlobalError, GlobalMatch};
use super::joint_refinement::JointRefinement;
use super::model_view::ModelSurface;
use super::projective_icp::{IcpReport, NotAligned};
use crate::organized::OrganizedCloud;
use crate::segment::Segmentation;
use crate::view::View;
use nalgebra::{Isometry3, Matrix6};

/// How a pose was estimated.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// From the robot's and turntable's readings alone.
    Kinematic,
    /// Aligned with the model.
    Icp(Box<IcpReport>),
    /// Alignment was tried and would have been no better: the kinematic pose stands.
    KeptPrior(NotAligned),
    /// Nothing was known of the first view: the frame of its camera is the table frame.
    CameraIsFrame,
    /// Nothing was known, and the view was found in the model.
    Relocalized(Box<Relocalization>),
}

/// How a view without a prior got its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Relocalization {
    /// The global registration.
    pub found: GlobalMatch,
    /// The seed of everything random in it.
    pub seed: u64,
    /// Share of what the model shows from there that the view confirms.
    pub confirmed: f64,
    /// Share of what it can speak of that it contradicts.
    pub contradicted: f64,
    /// The alignment from there; `None` where it would fit no better.
    pub icp: Option<IcpReport>,
}

/// Where a view was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    /// Estimated camera pose.
    pub table_from_camera: Isometry3<f64>,
    /// Pose from kinematics alone; `None` where nothing was known in the model's frame.
    pub prior: Option<Isometry3<f64>>,
    /// Covariance over (rotation, translation), radians and metres, camera frame.
    pub covariance: Matrix6<f64>,
    /// How the pose was estimated.
    pub method: Method,
}

/// Why a view's pose could not be had.
#[derive(Debug, thiserror::Error)]
pub enum RegisterError {
    /// The view came without any pose evidence.
    #[error("no pose evidence: the view carries neither robot readings nor a camera pose")]
    NoEvidence,
    /// The view came without evidence and is not to be found in the model.
    #[error("no pose evidence, and not found in the model: {0}")]
    NotFound(#[from] GlobalError),
    /// The view came without evidence, and wherever it lies on the model it would have seen through it.
    #[error(
        "no pose evidence, and no pose holds: {overlap:.0} % of the surface agree with the model, but {contradicted:.0} % \
         of what the model shows there is not in the view"
    )]
    Contradicted {
        /// Per cent, of the best pose.
        overlap: f64,
        /// Per cent, of the best pose.
        contradicted: f64,
    },
    /// The view came without evidence, and where its surface lies on the model its picture is another.
    #[error(
        "no pose evidence, and no pose holds: the surface fits, but the pictures correlate by {correlation:.2} only"
    )]
    Unlike {
        /// Correlation of the pictures at the best pose, -1 to 1.
        correlation: f64,
    },
    /// The view came without evidence and fits the model in more than one pose.
    #[error(
        "no pose evidence, and ambiguous: the view confirms {best:.0} % of the model in one pose, {next:.0} % in another"
    )]
    Ambiguous {
        /// Per cent.
        best: f64,
        /// Per cent.
        next: f64,
    },
    /// The view came without evidence, and the pose that was found does not stand a closer look.
    #[error("no pose evidence, and the pose found in the model does not hold: {0}")]
    NotConfirmed(NotAligned),
    /// A reading is not a rigid transform or not finite.
    #[error("pose evidence {field}: {reason}")]
    BadEvidence {
        /// The reading at fault.
        field: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// What a registrar gets to estimate the pose of a view from.
#[derive(Clone, Copy)]
pub struct RegistrationInput<'a> {
    /// The view.
    pub view: &'a View,
    /// Its points with normals.
    pub cloud: &'a OrganizedCloud,
    /// Its labels.
    pub segmentation: &'a Segmentation,
    /// The model so far; `None` for the first view.
    pub model: Option<&'a dyn ModelSurface>,
}

/// Gives a view its pose.
pub trait Registrar: Send {
    /// Pose of a view.
    ///
    /// # Errors
    /// [`RegisterError`] if no pose can be given; the view is then reported and left out.
    fn register(&mut self, input: &RegistrationInput<'_>) -> Result<Registration, RegisterError>;

    /// The view that was registered last has become part of the model.
    fn accepted(&mut self) {}

    /// Better poses of all accepted views, in order, now that the last one is in; `None` if there are none.
    fn refine(&mut self) -> Option<JointRefinement> {
        None
    }
}
