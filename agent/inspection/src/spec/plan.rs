//! How views are planned: the strategy, the budget, what the cell can reach, and how closely regions of interest are looked at.
//! The limits that are not said are those of [Remanufacturing paper]: azimuth and polar angle 45 to 90 degrees, 400 to 600 mm
//! from the centre.

use super::SpecError;
use semascan_model::record::PlanStrategy;
use serde::{Deserialize, Serialize};

/// How views are planned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanSpec {
    /// How the next view is chosen; where it is absent, views come as the source has them.
    pub strategy: Option<PlanStrategy>,
    /// Most views of the whole surface.
    pub views: u32,
    /// Least gain that is worth a view, as a share of the known surface; 0 takes all views.
    pub least_gain: f64,
    /// Whether regions of interest are looked at closely afterwards.
    pub refine: bool,
    /// Most views of that second stage.
    pub refine_views: u32,
    /// Seed of everything random in it.
    pub seed: u64,
    /// What the cell can reach.
    pub reach: ReachSpec,
    /// How closely regions of interest are looked at.
    pub target: TargetSpec,
}

/// Poses that a cell can reach, in its static turntable frame: the camera's place by azimuth and polar angle about the centre of the
/// measuring volume on the table's axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReachSpec {
    /// Least and largest azimuth in degrees.
    pub azimuth_deg: [f64; 2],
    /// Least and largest polar angle in degrees: 0 is above the part, 90 beside it.
    pub polar_deg: [f64; 2],
    /// Least and largest distance of the camera from the centre in millimetres.
    pub distance_mm: [f64; 2],
    /// Least and largest angle of the table in degrees.
    pub table_deg: [f64; 2],
    /// Least and largest depth at which the camera measures, in millimetres.
    pub working_mm: [f64; 2],
    /// Largest angle between the optical axis and the direction to the centre in degrees.
    pub aim_deg: f64,
    /// Height of the centre above the table in millimetres; the middle of the measuring volume if absent.
    pub centre_mm: Option<f64>,
    /// Radius of a sphere around the camera and what it hangs from, in millimetres: it touches neither an obstacle nor the
    /// measuring volume.
    pub camera_radius_mm: f64,
    /// Spheres that the camera keeps away from: x, y, z of the centre and the radius in millimetres, static frame.
    pub obstacles_mm: Vec<[f64; 4]>,
}

/// How closely a region of interest is looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TargetSpec {
    /// Millimetres of the surface that a pixel covers, at most.
    pub pixel_mm: f64,
    /// Largest angle of incidence in degrees.
    pub incidence_deg: f64,
    /// Regions that are smaller are passed over, in millimetres.
    pub least_mm: f64,
}

impl Default for PlanSpec {
    fn default() -> Self {
        Self {
            strategy: None,
            views: 12,
            least_gain: 0.01,
            refine: false,
            refine_views: 12,
            seed: 7,
            reach: ReachSpec::default(),
            target: TargetSpec::default(),
        }
    }
}

impl Default for ReachSpec {
    fn default() -> Self {
        Self {
            azimuth_deg: [45.0, 90.0],
            polar_deg: [45.0, 90.0],
            distance_mm: [400.0, 600.0],
            table_deg: [0.0, 360.0],
            working_mm: [250.0, 800.0],
            aim_deg: 15.0,
            centre_mm: None,
            camera_radius_mm: 80.0,
            obstacles_mm: Vec::new(),
        }
    }
}

impl Default for TargetSpec {
    fn default() -> Self {
        Self { pixel_mm: 0.1, incidence_deg: 45.0, least_mm: 5.0 }
    }
}

impl PlanSpec {
    /// Checks every number.
    ///
    /// # Errors
    /// [`SpecError`] naming the field that holds what it must not.
    pub fn check(&self) -> Result<(), SpecError> {
        let fail = |field: &str, reason: String| Err(SpecError { field: format!("plan.{field}"), reason });
        let ReachSpec { azimuth_deg, polar_deg, distance_mm, table_deg, working_mm, .. } = &self.reach;
        let ranges = [
            ("reach.azimuth_deg", azimuth_deg, (-360.0, 360.0)),
            ("reach.polar_deg", polar_deg, (0.0, 180.0)),
            ("reach.distance_mm", distance_mm, (1.0, 1e5)),
            ("reach.table_deg", table_deg, (-720.0, 720.0)),
            ("reach.working_mm", working_mm, (1.0, 1e5)),
        ];
        for (field, [low, high], (least, most)) in ranges {
            if !(least..=most).contains(low) || !(least..=most).contains(high) || low > high {
                return fail(field, format!("[{low}, {high}] is no range from {least} to {most}"));
            }
        }
        let numbers = [
            ("reach.aim_deg", self.reach.aim_deg, (0.0, 90.0)),
            ("reach.camera_radius_mm", self.reach.camera_radius_mm, (0.0, 1e4)),
            ("reach.centre_mm", self.reach.centre_mm.unwrap_or(0.0), (-1e4, 1e4)),
            ("target.pixel_mm", self.target.pixel_mm, (1e-3, 100.0)),
            ("target.incidence_deg", self.target.incidence_deg, (1.0, 89.0)),
            ("target.least_mm", self.target.least_mm, (0.0, 1e4)),
            ("least_gain", self.least_gain, (0.0, 1.0)),
            ("views", self.views.into(), (1.0, 1000.0)),
            ("refine_views", self.refine_views.into(), (0.0, 1000.0)),
        ];
        for (field, value, (least, most)) in numbers {
            if !(least..=most).contains(&value) {
                return fail(field, format!("{value} is not {least} to {most}"));
            }
        }
        let sphere = |s: &&[f64; 4]| s.iter().all(|x| x.is_finite()) && s[3] > 0.0;
        match self.reach.obstacles_mm.iter().find(|s| !sphere(s)) {
            Some(none) => fail("reach.obstacles_mm", format!("{none:?} is no sphere: x, y, z, radius")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_refused_by_its_name() {
        assert_eq!(PlanSpec::default().check(), Ok(()));
        for (text, field) in [
            ("[reach]\npolar_deg = [90, 45]", "plan.reach.polar_deg"),
            ("[reach]\ndistance_mm = [0, 45]", "plan.reach.distance_mm"),
            ("[reach]\naim_deg = nan", "plan.reach.aim_deg"),
            ("[reach]\nobstacles_mm = [[0, 0, 0, -1]]", "plan.reach.obstacles_mm"),
            ("views = 0", "plan.views"),
            ("least_gain = 2.0", "plan.least_gain"),
            ("[target]\npixel_mm = 0.0", "plan.target.pixel_mm"),
        ] {
            let spec: PlanSpec = toml::from_str(text).expect("plain data");
            assert_eq!(spec.check().expect_err(text).field, field);
        }
    }
}
