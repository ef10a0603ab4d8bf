//! The port of view planning: a [`ViewPlanner`] is asked between two views where the next one shall be taken from, and a
//! [`SteeredCamera`] is a source that goes there. P0's cell chooses its views so ([Remanufacturing paper], step 2: the view
//! planning problem); what plans is in `semascan-planning`.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use semascan_model::record::{ExpectedGain, PlanCoverage, PlanPurpose, PlanStop, PlanStrategy};
use semascan_perception::fuse::SemanticMap;
use semascan_perception::view::Intrinsics;

use crate::source::SourceError;

/// Where the camera stands and how the table is turned.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewpoint {
    /// The camera in the static frame of the turntable.
    pub tablebase_from_camera: Isometry3<f64>,
    /// Radians: `tablebase_from_table = Rz(angle)`.
    pub table_angle: f64,
}

impl Viewpoint {
    /// The camera in the frame that turns with the part.
    pub fn table_from_camera(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -self.table_angle);
        Isometry3::from_parts(Translation3::identity(), turn) * self.tablebase_from_camera
    }
}

/// A camera at `eye` that looks at `target`, in the frame of both (metres), with the picture's top towards +z.
pub fn look_at(eye: Point3<f64>, target: Point3<f64>) -> Isometry3<f64> {
    let forward = (target - eye).normalize();
    let right = forward.cross(&Vector3::z());
    let right = if right.norm() < 1e-6 { Vector3::x() } else { right.normalize() };
    let down = forward.cross(&right);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// A camera that goes where it is sent.
pub trait SteeredCamera {
    /// Its pictures.
    fn intrinsics(&self) -> Intrinsics;

    /// The next view is taken from `viewpoint`.
    ///
    /// # Errors
    /// [`SourceError`] where the cell cannot go there: that view is left out.
    fn move_to(&mut self, viewpoint: &Viewpoint) -> Result<(), SourceError>;
}

/// Chooses where views are taken from.
pub trait ViewPlanner: Send {
    /// How it chooses.
    fn strategy(&self) -> PlanStrategy;

    /// Seed of everything random in it.
    fn seed(&self) -> u64;

    /// Most views that it will ask for.
    fn most_views(&self) -> u32;

    /// Where the next view shall be taken from, with the model as the views until now have made it; `None` while no view is
    /// in a model.
    fn next(&mut self, model: Option<&SemanticMap>) -> Decision;
}

/// What a planner decides.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// Another view.
    Capture(Box<NextView>),
    /// No more views.
    Stop {
        /// Why.
        why: PlanStop,
        /// What was covered; `None` where the planner does not look at the model.
        coverage: Option<Box<PlanCoverage>>,
    },
}

/// The view that a planner asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct NextView {
    /// From where.
    pub viewpoint: Viewpoint,
    /// What for.
    pub purpose: PlanPurpose,
    /// What it is expected to add; `None` where the planner does not look at the model.
    pub expected: Option<ExpectedGain>,
    /// Poses that it was chosen from.
    pub candidates: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_viewpoint_looks_at_its_target_and_turns_with_the_table() {
        let (eye, target) = (Point3::new(0.1, 0.4, 0.3), Point3::new(0.0, 0.02, 0.1));
        for angle in [0.0_f64, 0.7, -2.0] {
            let viewpoint = Viewpoint { tablebase_from_camera: look_at(eye, target), table_angle: angle };
            let seen = viewpoint.tablebase_from_camera.inverse() * target;
            assert!(seen.x.abs() < 1e-12 && seen.y.abs() < 1e-12 && seen.z > 0.4, "{seen}");
            // A mark on the table that stands at the target while the table is turned.
            let mark = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -angle) * target;
            assert!((viewpoint.table_from_camera().inverse() * mark - seen).norm() < 1e-12);
            let above = viewpoint.tablebase_from_camera.inverse() * (target + Vector3::z() * 0.01);
            assert!(above.y < seen.y, "the picture's top is up");
        }
    }
}
