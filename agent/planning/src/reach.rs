//! Poses that a cell reaches: the camera's place by azimuth, polar angle and distance about the centre of the measuring volume,
//! the direction that it looks in, the table's angle, and spheres that must not touch.

use nalgebra::{Point3, Vector3};
use semascan_inspection::planning::Viewpoint;
use semascan_inspection::spec::ReachSpec;
use std::f64::consts::TAU;
use std::fmt;

/// Slack of every limit: radians and metres. A pose on a limit is within it.
const SLACK: f64 = 1e-6;

/// What a cell reaches. Metres, radians; the static frame of the turntable.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// What the camera goes around, on the table's axis.
    pub centre: Point3<f64>,
    /// Least and largest azimuth of the camera.
    pub azimuth: (f64, f64),
    /// Least and largest polar angle.
    pub polar: (f64, f64),
    /// Least and largest distance from the centre.
    pub distance: (f64, f64),
    /// Least and largest angle of the table.
    pub table: (f64, f64),
    /// Least and largest depth at which the camera measures.
    pub working: (f64, f64),
    /// Largest angle between the optical axis and the direction to the centre.
    pub aim: f64,
    /// Radius of the sphere around the camera.
    pub camera_radius: f64,
    /// Spheres that the camera keeps away from.
    pub obstacles: Vec<(Point3<f64>, f64)>,
    /// Radius about the axis, lowest and highest point of what turns with the table.
    turning: (f64, f64, f64),
}

/// Which limit a pose breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutOfReach {
    /// Azimuth of the camera.
    Azimuth,
    /// Polar angle of the camera.
    Polar,
    /// Distance from the centre.
    Distance,
    /// Angle of the table.
    Table,
    /// Direction of the optical axis.
    Aim,
    /// An obstacle, or what stands on the table.
    Collision,
}

impl fmt::Display for OutOfReach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Azimuth => "azimuth",
            Self::Polar => "polar angle",
            Self::Distance => "distance",
            Self::Table => "table angle",
            Self::Aim => "direction of the optical axis",
            Self::Collision => "collision",
        })
    }
}

impl Reach {
    /// The limits of `spec` for a measuring volume between two corners (metres, table frame).
    pub fn new(spec: &ReachSpec, (low, high): (Point3<f64>, Point3<f64>)) -> Self {
        let radians = |[low, high]: [f64; 2]| (low.to_radians(), high.to_radians());
        let metres = |[low, high]: [f64; 2]| (low * 1e-3, high * 1e-3);
        let height = spec.centre_mm.map_or(0.5 * (low.z + high.z), |mm| mm * 1e-3);
        let radius = low.x.abs().max(high.x.abs()).hypot(low.y.abs().max(high.y.abs()));
        Self {
            centre: Point3::new(0.0, 0.0, height),
            azimuth: radians(spec.azimuth_deg),
            polar: radians(spec.polar_deg),
            distance: metres(spec.distance_mm),
            table: radians(spec.table_deg),
            working: metres(spec.working_mm),
            aim: spec.aim_deg.to_radians(),
            camera_radius: spec.camera_radius_mm * 1e-3,
            obstacles: spec
                .obstacles_mm
                .iter()
                .map(|[x, y, z, r]| (Point3::new(x * 1e-3, y * 1e-3, z * 1e-3), r * 1e-3))
                .collect(),
            turning: (radius, low.z, high.z),
        }
    }

    /// The place at azimuth, polar angle and distance.
    pub fn place(&self, azimuth: f64, polar: f64, distance: f64) -> Point3<f64> {
        self.centre + Vector3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()) * distance
    }

    /// Radius of the sphere around the centre that holds the measuring volume.
    pub fn radius(&self) -> f64 {
        let (radius, low, high) = self.turning;
        radius.hypot((self.centre.z - low).abs().max((high - self.centre.z).abs()))
    }

    /// Whether the cell reaches `viewpoint`.
    ///
    /// # Errors
    /// [`OutOfReach`]: the first limit that it breaks.
    pub fn check(&self, viewpoint: &Viewpoint) -> Result<(), OutOfReach> {
        let eye = Point3::from(viewpoint.tablebase_from_camera.translation.vector);
        let out = eye - self.centre;
        let distance = out.norm();
        let within = |value: f64, (low, high): (f64, f64)| value >= low - SLACK && value <= high + SLACK;
        // Azimuths are the same after a whole turn.
        let turned = |angle: f64, (low, high): (f64, f64)| {
            let from_low = (angle - low).rem_euclid(TAU);
            from_low <= high - low + SLACK || from_low >= TAU - SLACK
        };
        let polar = (out.z / distance).clamp(-1.0, 1.0).acos();
        let axis = viewpoint.tablebase_from_camera.rotation * Vector3::z();
        let checks = [
            (within(distance, self.distance), OutOfReach::Distance),
            (within(polar, self.polar), OutOfReach::Polar),
            (polar < SLACK || turned(out.y.atan2(out.x), self.azimuth), OutOfReach::Azimuth),
            (turned(viewpoint.table_angle, self.table), OutOfReach::Table),
            (axis.angle(&-out) <= self.aim + SLACK, OutOfReach::Aim),
            (!self.collides(&eye), OutOfReach::Collision),
        ];
        checks.into_iter().find(|(holds, _)| !holds).map_or(Ok(()), |(_, limit)| Err(limit))
    }

    /// Whether the camera's sphere at `eye` touches an obstacle or the cylinder in which the part turns.
    fn collides(&self, eye: &Point3<f64>) -> bool {
        let touches = |(centre, radius): &(Point3<f64>, f64)| (eye - centre).norm() < radius + self.camera_radius;
        let (radius, low, high) = self.turning;
        let beside = (eye.x.hypot(eye.y) - radius).max(0.0);
        let above = (eye.z - high).max(low - eye.z).max(0.0);
        self.obstacles.iter().any(touches) || beside.hypot(above) < self.camera_radius
    }
}
