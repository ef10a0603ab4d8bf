//! Poses that are compared with each other: an even grid over what the cell reaches ([Remanufacturing paper] draws them at
//! random from the same ranges). The part looks the same from one azimuth of the robot as from another with the table turned
//! back, so that azimuth is kept in the middle of its range where the table turns all the way.

use crate::reach::Reach;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use semascan_inspection::planning::{Viewpoint, look_at};
use std::f64::consts::TAU;

/// How fine the grid of poses is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orbit {
    /// Angles of the table.
    pub table: usize,
    /// Azimuths, where the table does not turn all the way.
    pub azimuths: usize,
    /// Polar angles.
    pub polars: usize,
    /// Distances.
    pub distances: usize,
}

impl Orbit {
    /// For views of the whole part.
    pub const OVERALL: Self = Self { table: 24, azimuths: 3, polars: 5, distances: 2 };
    /// For close looks.
    pub const CLOSE: Self = Self { table: 48, azimuths: 3, polars: 8, distances: 2 };
}

/// The poses of an even grid that the cell reaches, all of which look at the centre.
pub fn candidates(reach: &Reach, orbit: &Orbit) -> Vec<Viewpoint> {
    places(reach, orbit)
        .into_iter()
        .map(|(eye, table_angle)| Viewpoint { tablebase_from_camera: look_at(eye, reach.centre), table_angle })
        .filter(|viewpoint| reach.check(viewpoint).is_ok())
        .collect()
}

/// Places of the camera (static frame), each with an angle of the table.
pub(crate) fn places(reach: &Reach, orbit: &Orbit) -> Vec<(Point3<f64>, f64)> {
    let turns = reach.table.1 - reach.table.0 >= TAU - 1e-9;
    let azimuths = if turns { 1 } else { orbit.azimuths };
    // The last angle of a whole turn is the first one.
    let tables = if turns { orbit.table + 1 } else { orbit.table };
    let mut places = Vec::new();
    for table_angle in steps(reach.table, tables).into_iter().take(orbit.table) {
        for polar in steps(reach.polar, orbit.polars) {
            for distance in steps(reach.distance, orbit.distances) {
                for azimuth in steps(reach.azimuth, azimuths) {
                    places.push((reach.place(azimuth, polar, distance), table_angle));
                }
            }
        }
    }
    places
}

/// `count` even steps from one end of a range to the other; one is its middle.
fn steps((low, high): (f64, f64), count: usize) -> Vec<f64> {
    match count {
        0 | 1 => vec![0.5 * (low + high)],
        _ => (0..count).map(|k| low + (high - low) * k as f64 / (count - 1) as f64).collect(),
    }
}

/// A camera at `eye` that looks at `target` as far as the cell lets it turn away from the centre. All in the static frame.
pub(crate) fn aimed(reach: &Reach, eye: Point3<f64>, target: Point3<f64>) -> nalgebra::Isometry3<f64> {
    let (to_centre, to_target) = (reach.centre - eye, target - eye);
    let angle = to_centre.angle(&to_target);
    if angle <= reach.aim {
        return look_at(eye, target);
    }
    let axis = Unit::try_new(to_centre.cross(&to_target), 1e-12).unwrap_or_else(Vector3::z_axis);
    let direction = UnitQuaternion::from_axis_angle(&axis, reach.aim) * to_centre;
    look_at(eye, eye + direction)
}
