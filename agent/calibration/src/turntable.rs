//! The axis of a turntable in closed form: the motions of a board that stands on it are turns about the axis, so it is the mean of
//! their rotation axes, through the point that they leave in place.

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};

/// A line about which the table turns, in the robot's base (or the camera, if that does not move).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    /// The direction about which a positive angle is a right-handed turn.
    pub(crate) direction: UnitVector3<f64>,
    /// A point of the line.
    pub(crate) point: Point3<f64>,
}

impl Axis {
    /// The turn about the line by an angle.
    pub(crate) fn turn(&self, angle: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_axis_angle(&self.direction, angle);
        Isometry3::from_parts(Translation3::from(self.point - rotation * self.point), rotation)
    }

    /// The same line by its point nearest to another point.
    pub(crate) fn nearest_to(&self, other: &Point3<f64>) -> Self {
        let along = (other - self.point).dot(&self.direction);
        Self { point: self.point + along * self.direction.into_inner(), ..*self }
    }

    /// Two directions at right angles to the line and to each other.
    pub(crate) fn across(&self) -> [Vector3<f64>; 2] {
        let d = self.direction.into_inner();
        let helper = if d.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
        let first = (helper - d * d.dot(&helper)).normalize();
        [first, d.cross(&first)]
    }

    /// The frame of the table at angle 0: z along the line, the origin at the line's point, x as nearly that of the base as can be.
    pub(crate) fn base_from_tablebase(&self) -> Isometry3<f64> {
        let [x, y] = self.across();
        let rotation = Matrix3::from_columns(&[x, y, self.direction.into_inner()]);
        Isometry3::from_parts(Translation3::from(self.point), UnitQuaternion::from_matrix(&rotation))
    }
}

/// The axis, from poses of the board in the base by the angle of the table; `None` if the angles leave it open.
pub(crate) fn closed_form(boards: &[(f64, Isometry3<f64>)]) -> Option<Axis> {
    let (mut direction, mut left, mut right) = (Vector3::zeros(), Matrix3::zeros(), Vector3::zeros());
    for (k, (first_angle, first)) in boards.iter().enumerate() {
        for (second_angle, second) in &boards[k + 1..] {
            let motion = second * first.inverse();
            // Half a turn has two axes, and a small one a bad axis.
            direction += motion.rotation.scaled_axis() * (second_angle - first_angle).sin();
            // Points of the axis stay where they are: (I - R) p = t.
            let change = Matrix3::identity() - motion.rotation.to_rotation_matrix().matrix();
            left += change.transpose() * change;
            right += change.transpose() * motion.translation.vector;
        }
    }
    let direction = UnitVector3::try_new(direction, 1e-9)?;
    // Along the axis nothing is said: the point nearest to the origin of the base.
    let along = direction.into_inner() * direction.into_inner().transpose() * left.trace().max(1e-12);
    let point = (left + along).try_inverse()? * right;
    point.iter().all(|c| c.is_finite()).then(|| Axis { direction, point: Point3::from(point) })
}
