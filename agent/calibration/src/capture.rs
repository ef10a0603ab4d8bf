//! One capture: the readings of robot and table, and the board that the camera saw.

use nalgebra::{Isometry3, Matrix6};

/// What was read and seen at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capture {
    /// End effector in the robot's base; `None` where the camera does not move.
    pub base_from_ee: Option<Isometry3<f64>>,
    /// Angle of the turntable, radians; `None` where the board does not stand on one.
    pub table_angle: Option<f64>,
    /// The board in the camera.
    pub camera_from_board: Isometry3<f64>,
    /// Covariance of that pose: a twist in the board's frame. Where it is `None` for one capture, the noise is estimated from the
    /// residuals of all.
    pub covariance: Option<Matrix6<f64>>,
}

impl Capture {
    /// The end effector in the base; of a camera that does not move they are the same frame.
    pub(crate) fn base_from_ee(&self) -> Isometry3<f64> {
        self.base_from_ee.unwrap_or_else(Isometry3::identity)
    }

    /// The angle of the table; without one it does not turn.
    pub(crate) fn table_angle(&self) -> f64 {
        self.table_angle.unwrap_or(0.0)
    }
}
