//! From the rotating table frame, where the model is made, to the robot base, where the robot can use it
//! ([Remanufacturing paper], step 5, postprocessing).

use crate::view::Chain;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

impl Chain {
    /// The table frame in the robot base while the table stands at `table_angle` (radians): where the model is then.
    pub fn base_from_table(&self, table_angle: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), table_angle);
        self.base_from_tablebase * Isometry3::from_parts(Translation3::identity(), turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn the_model_lies_where_the_robot_saw_it() {
        let chain = Chain {
            base_from_ee: Isometry3::new(Vector3::new(0.3, -0.2, 0.6), Vector3::new(2.4, 0.3, 0.1)),
            ee_from_camera: Isometry3::new(Vector3::new(0.02, 0.0, 0.08), Vector3::new(0.1, -0.05, 0.3)),
            base_from_tablebase: Isometry3::new(Vector3::new(0.7, 0.1, 0.2), Vector3::new(0.0, 0.0, 0.4)),
            table_angle: 1.1,
        };
        let in_camera = Point3::new(0.03, -0.02, 0.5);
        let by_robot = chain.base_from_ee * chain.ee_from_camera * in_camera;
        let by_model = chain.base_from_table(chain.table_angle) * (chain.table_from_camera() * in_camera);
        assert!((by_robot - by_model).norm() < 1e-12);
    }
}
