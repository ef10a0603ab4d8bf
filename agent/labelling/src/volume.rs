//! The measuring volume: where the part can be. A line of sight that does not enter it ends on background, measured or not: that
//! is what the volume says, and no conclusion from a missing depth.

use nalgebra::{Isometry3, Point3, Vector3};
use semascan_perception::view::Intrinsics;

/// A box in the table frame outside of which nothing of the part is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuringVolume {
    /// Corner with the least coordinates, metres.
    pub least: Point3<f64>,
    /// Corner with the greatest.
    pub greatest: Point3<f64>,
}

impl MeasuringVolume {
    /// The box with `margin` metres more on each side.
    pub(crate) fn widened(&self, margin: f64) -> Self {
        Self { least: self.least.map(|c| c - margin), greatest: self.greatest.map(|c| c + margin) }
    }

    /// Whether the line of sight of the pixel in column `u` and row `v` enters the box before the camera.
    pub(crate) fn is_entered(
        &self,
        intrinsics: &Intrinsics,
        table_from_camera: &Isometry3<f64>,
        u: f64,
        v: f64,
    ) -> bool {
        let direction = table_from_camera.rotation * intrinsics.unproject(u, v, 1.0).coords;
        self.passage(&table_from_camera.translation.vector, &direction).is_some()
    }

    /// Where a line enters the box and leaves it, in lengths of `direction` from its origin on (slab method); `None` where it
    /// passes.
    pub(crate) fn passage(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (low, high) = (self.least[axis] - origin[axis], self.greatest[axis] - origin[axis]);
            if direction[axis].abs() < 1e-12 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (near, far) = (low / direction[axis], high / direction[axis]);
            (enter, leave) = (enter.max(near.min(far)), leave.min(near.max(far)));
        }
        (enter <= leave).then_some((enter, leave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn a_line_of_sight_enters_the_box_or_passes_it() {
        let camera = Intrinsics { width: 100, height: 100, fx: 100.0, fy: 100.0, cx: 50.0, cy: 50.0 };
        let volume = MeasuringVolume { least: Point3::new(-0.1, -0.2, 0.0), greatest: Point3::new(0.1, 0.2, 0.3) };
        // A metre above the floor of the box, looking down.
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let above = Isometry3::from_parts(Translation3::new(0.0, 0.0, 1.0), down);
        let entered = |volume: &MeasuringVolume, u: f64, v: f64| volume.is_entered(&camera, &above, u, v);
        // The top of the box, 0.7 m away, is 28.6 by 57.1 pixels large.
        assert!(entered(&volume, 50.0, 50.0) && entered(&volume, 64.0, 50.0) && entered(&volume, 50.0, 22.0));
        assert!(!entered(&volume, 65.0, 50.0) && !entered(&volume, 50.0, 21.0));
        assert!(entered(&volume.widened(0.01), 65.0, 50.0), "0.11 / 0.69 are 15.9 pixels");
        // Looking away from it; and from within.
        let away = Isometry3::from_parts(Translation3::new(0.0, 0.0, 1.0), UnitQuaternion::identity());
        assert!(!volume.is_entered(&camera, &away, 50.0, 50.0));
        let within = Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.1), UnitQuaternion::identity());
        assert!(volume.is_entered(&camera, &within, 0.0, 99.0));
    }
}
