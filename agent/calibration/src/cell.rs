//! What is estimated of a cell, and where it says that the camera sees the board.

use crate::capture::Capture;
use crate::turntable::Axis;
use nalgebra::{DVector, Isometry3, UnitQuaternion, UnitVector3};
use semascan_perception::register::se3::{exp, log};

/// Everything between the robot's readings and the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cell {
    /// Camera on the end effector; held where the camera does not move.
    pub(crate) ee_from_camera: Isometry3<f64>,
    /// Axis of the table; held where it does not turn.
    pub(crate) axis: Option<Axis>,
    /// The board in the base while the table stands at 0.
    pub(crate) base_from_board: Isometry3<f64>,
    /// Whether the camera on the end effector is to be found.
    pub(crate) is_moved: bool,
}

impl Cell {
    /// Number of unknowns: those of the camera, of the axis (two turns, two shifts), of the board.
    pub(crate) fn unknowns(&self) -> usize {
        self.camera_unknowns() + self.axis_unknowns() + 6
    }

    pub(crate) fn camera_unknowns(&self) -> usize {
        if self.is_moved { 6 } else { 0 }
    }

    pub(crate) fn axis_unknowns(&self) -> usize {
        if self.axis.is_some() { 4 } else { 0 }
    }

    /// The board in the camera, by the readings of a capture.
    pub(crate) fn camera_from_board(&self, capture: &Capture) -> Isometry3<f64> {
        let base_from_camera = capture.base_from_ee() * self.ee_from_camera;
        let turned = self.axis.map_or_else(Isometry3::identity, |axis| axis.turn(capture.table_angle()));
        base_from_camera.inverse() * turned * self.base_from_board
    }

    /// The cell moved by a step of its unknowns.
    pub(crate) fn moved(&self, step: &DVector<f64>) -> Self {
        let mut moved = *self;
        if self.is_moved {
            moved.ee_from_camera *= exp(&step.fixed_rows::<6>(0).into_owned());
        }
        let at = self.camera_unknowns();
        if let Some(axis) = self.axis {
            let [u, v] = axis.across();
            let turn = UnitQuaternion::from_scaled_axis(step[at] * u + step[at + 1] * v);
            moved.axis = Some(Axis {
                direction: UnitVector3::new_normalize(turn * axis.direction.into_inner()),
                point: axis.point + step[at + 2] * u + step[at + 3] * v,
            });
        }
        moved.base_from_board *= exp(&step.fixed_rows::<6>(at + self.axis_unknowns()).into_owned());
        moved
    }

    /// The step of the unknowns that leads to another cell nearby.
    pub(crate) fn step_to(&self, other: &Self) -> DVector<f64> {
        let mut step = DVector::zeros(self.unknowns());
        if self.is_moved {
            step.fixed_rows_mut::<6>(0).copy_from(&log(&self.ee_from_camera, &other.ee_from_camera));
        }
        let at = self.camera_unknowns();
        if let (Some(axis), Some(there)) = (self.axis, other.axis) {
            let turn = axis.direction.cross(&there.direction);
            let shift = there.nearest_to(&axis.point).point - axis.point;
            for (k, across) in axis.across().iter().enumerate() {
                step[at + k] = turn.dot(across);
                step[at + 2 + k] = shift.dot(across);
            }
        }
        let board = log(&self.base_from_board, &other.base_from_board);
        step.fixed_rows_mut::<6>(at + self.axis_unknowns()).copy_from(&board);
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn a_step_leads_to_where_it_is_said_to() {
        let cell = Cell {
            ee_from_camera: Isometry3::new(Vector3::new(0.1, 0.0, 0.2), Vector3::new(0.3, 0.1, 0.0)),
            axis: Some(Axis {
                direction: UnitVector3::new_normalize(Vector3::new(0.1, -0.2, 1.0)),
                point: Point3::new(0.5, 0.1, 0.2),
            }),
            base_from_board: Isometry3::translation(0.4, 0.1, 0.2),
            is_moved: true,
        };
        let step = DVector::from_fn(cell.unknowns(), |k, _| 1e-5 * (k as f64 - 6.0));
        let back = cell.step_to(&cell.moved(&step));
        assert!((back - &step).norm() < 1e-8);
    }
}
