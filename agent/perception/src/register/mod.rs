//! View -> pose: where the camera was when it took a view, in the table frame, with covariance.
//!
//! The steps in the order of a view's way: [`KinematicRegistrar`] gives the prior, [`SourcePoints`] the points of the
//! object with their normals (segment ICP, [Eye-in-hand 2020], section 3.2), `projective_icp` aligns them with a
//! [`ModelView`] of the model so far, `degeneracy` projects out the directions that the data leave unconstrained, and
//! `joint_refinement` moves all views at once when the turn is complete (of long recordings those of a
//! `refinement_set`). [`IcpRegistrar`] puts them together.
//!
//! Clouds that are not organized take another way: [`SurfelCloud`] thins them and fits normals, [`gicp`] aligns them from
//! a guess, and [`global`] without one. A view without a prior is found in the model by the latter (`relocalization`).

mod correspondences;
mod degeneracy;
pub mod gicp;
pub mod global;
mod icp_registrar;
mod into_picture;
mod joint_equations;
mod joint_refinement;
mod kinematics;
mod model_view;
mod normal_equations;
mod photometric;
mod projective_icp;
mod refinement_set;
mod registration;
mod relocalization;
pub mod rigid;
pub mod se3;
mod selection;
mod source_points;
mod surfels;
mod texture;
pub mod tracking;
pub mod turntable;
mod visibility;

pub use correspondences::{Gate, linearise};
pub use degeneracy::{Degeneracy, FrozenDirection};
pub use icp_registrar::IcpRegistrar;
pub use joint_refinement::{JointRefinement, RefinedView};
pub use kinematics::{KinematicRegistrar, Prior, prior};
pub use model_view::{ModelSurface, ModelView, OrientedPoints};
pub use normal_equations::Linearised;
pub use projective_icp::{Aligned, IcpConfig, IcpReport, NotAligned, align};
pub use registration::{Method, RegisterError, Registrar, Registration, RegistrationInput, Relocalization};
pub use selection::Selection;
pub use source_points::SourcePoints;
pub use surfels::{CloudError, Facing, SurfelCloud};
pub use texture::ViewTexture;
