//! The kinematic chain from the robot base to the camera and to the turntable (P0 Eq. 1), and back from the model to the
//! robot (P0 step 5).
//!
//! `table_from_camera = Rz(-phi) * tablebase_from_base * base_from_ee * ee_from_camera`. The sign of phi follows from
//! `tablebase_from_table = Rz(phi)`: the table frame turns with the part, so a point fixed in it moves by +phi.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// The robot's and turntable's readings for one capture ([Remanufacturing paper], Eq. 1). Lengths are in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// End effector in the robot base.
    pub base_from_ee: Isometry3<f64>,
    /// Camera on the end effector (hand-eye calibration).
    pub ee_from_camera: Isometry3<f64>,
    /// Static turntable frame in the robot base (calibration).
    pub base_from_tablebase: Isometry3<f64>,
    /// Turntable angle in radians: `tablebase_from_table = Rz(angle)`.
    pub table_angle: f64,
}

impl Chain {
    /// Camera pose in the rotating table frame ([Remanufacturing paper], Eq. 1).
    pub fn table_from_camera(&self) -> Isometry3<f64> {
        turn(-self.table_angle) * self.base_from_tablebase.inverse() * self.base_from_ee * self.ee_from_camera
    }

    /// The table frame in the robot base while the table stands at `table_angle` (radians): where the model, which is
    /// made in the table frame, is for the robot then (P0 step 5).
    pub fn base_from_table(&self, table_angle: f64) -> Isometry3<f64> {
        self.base_from_tablebase * turn(table_angle)
    }
}

/// A turn about the z axis.
fn turn(angle: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn chain(table_angle: f64) -> Chain {
        Chain {
            base_from_ee: Isometry3::new(Vector3::new(0.3, -0.2, 0.6), Vector3::new(2.4, 0.3, 0.1)),
            ee_from_camera: Isometry3::new(Vector3::new(0.02, 0.0, 0.08), Vector3::new(0.1, -0.05, 0.3)),
            base_from_tablebase: Isometry3::new(Vector3::new(0.7, 0.1, 0.2), Vector3::new(0.0, 0.0, 0.4)),
            table_angle,
        }
    }

    #[test]
    fn a_point_on_the_part_stays_put_while_the_table_turns() {
        let on_part = Point3::new(0.05, 0.02, 0.1);
        for table_angle in [0.0_f64, 0.5, 2.0, -1.0] {
            let chain = chain(table_angle);
            // Where the camera sees the point, by walking the chain forwards.
            let tablebase_from_table = Isometry3::rotation(Vector3::z() * table_angle);
            let in_base = chain.base_from_tablebase * tablebase_from_table * on_part;
            let in_camera = (chain.base_from_ee * chain.ee_from_camera).inverse() * in_base;
            assert!((chain.table_from_camera() * in_camera - on_part).norm() < 1e-12);
        }
    }

    #[test]
    fn the_model_lies_where_the_robot_saw_it() {
        let chain = chain(1.1);
        let in_camera = Point3::new(0.03, -0.02, 0.5);
        let by_robot = chain.base_from_ee * chain.ee_from_camera * in_camera;
        let by_model = chain.base_from_table(chain.table_angle) * (chain.table_from_camera() * in_camera);
        assert!((by_robot - by_model).norm() < 1e-12);
    }
}
