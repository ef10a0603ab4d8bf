//! Measurements on models of unseen simulated motors against truth: distances, radii, angles and steps, measured by the viewer's
//! code as a person would click, and how many of the stated intervals (k = 2) hold the truth.
//!
//! - **Elements.** A motor is built of planes and cylinders whose parameters are known (`semascan_simulation::Datum`): truth is
//!   what it was built with, not what its mesh shows. A click is a vertex of the model, drawn at random of those that lie on such
//!   a surface and face as it does; the region grows from there and is fitted ([`semascan_geometry::fit`]). What was not seen has no
//!   such vertices and is not measured; what is refused is counted.
//! - **Points.** A click at a pixel is a line of sight that meets the model at one place and the true surface at another one.
//!   For these alone the model is first brought to the true frame by its poses, as a person sees it from the model's side.

mod clicks;
mod print;
mod script;

pub use print::print;

use super::{InspectError, inspect};
use semascan_inspection::source::SourceError;
use semascan_inspection::spec::InspectionSpec;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde::Serialize;

/// What is inspected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Seeds of the motors.
    pub motors: Vec<u64>,
    /// Views of each.
    pub views: u32,
    /// Columns and rows.
    pub size: (u32, u32),
}

impl Default for Config {
    /// Five motors that nothing was calibrated on, with voxels of 0.9 millimetres.
    fn default() -> Self {
        Self { motors: (1001..=1005).collect(), views: 12, size: (960, 720) }
    }
}

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Distance of two points.
    PointDistance,
    /// Distance of elements from each other or from a point.
    ElementDistance,
    /// Height of a step.
    Step,
    /// Radius of a cylinder.
    Radius,
    /// Radius of the rim of a hole.
    RimRadius,
    /// Angle.
    Angle,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::PointDistance, Self::ElementDistance, Self::Step, Self::Radius, Self::RimRadius, Self::Angle];

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::PointDistance => "distance of points",
            Self::ElementDistance => "distance of elements",
            Self::Step => "height of a step",
            Self::Radius => "radius of a cylinder",
            Self::RimRadius => "radius of a rim",
            Self::Angle => "angle",
        }
    }
}

/// One measurement and its truth: metres, of angles radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measurement {
    /// What was measured.
    pub kind: Kind,
    /// Of what.
    pub of: String,
    /// The figure.
    pub value: f64,
    /// Its expanded uncertainty, k = 2.
    pub expanded: f64,
    /// What it is.
    pub truth: f64,
}

impl Measurement {
    /// Figure less truth.
    pub fn error(&self) -> f64 {
        self.value - self.truth
    }

    /// Whether the stated interval holds the truth.
    pub fn is_covered(&self) -> bool {
        self.error().abs() <= self.expanded
    }
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor {
    /// Its seed.
    pub seed: u64,
    /// Voxel edge, metres.
    pub voxel: f64,
    /// What was measured.
    pub measurements: Vec<Measurement>,
    /// Elements that were clicked and refused, each with the reason.
    pub refused: Vec<String>,
    /// Elements of which nothing was seen.
    pub unseen: usize,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was inspected.
    pub config: Config,
    /// By motor.
    pub motors: Vec<Motor>,
    /// Over all motors.
    pub summary: Summary,
}

/// Figures over all motors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Measurements.
    pub measurements: usize,
    /// Those whose interval holds the truth.
    pub covered: usize,
    /// Median error of distances and steps, without sign, metres.
    pub distance_error: Option<f64>,
    /// The same as a share of the voxel.
    pub distance_error_voxels: Option<f64>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The motor cannot be simulated.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// It could not be inspected.
    #[error("motor {seed}: {source}")]
    Inspect {
        /// Its seed.
        seed: u64,
        /// Why.
        source: InspectError,
    },
}

/// Inspects and measures every motor; `on_step` gets how many are done, and of how many.
///
/// # Errors
/// [`MeasureError`] naming the motor.
pub fn run(config: &Config, on_step: &dyn Fn(usize, usize)) -> Result<Report, MeasureError> {
    let mut motors = Vec::new();
    for &seed in &config.motors {
        on_step(motors.len(), config.motors.len());
        motors.push(motor(config, seed)?);
    }
    let summary = summarize(&motors);
    Ok(Report { config: config.clone(), motors, summary })
}

fn motor(config: &Config, seed: u64) -> Result<Motor, MeasureError> {
    let (width, height) = config.size;
    let uri = format!("virtual:starter-motor?seed={seed}&views={}&size={width}x{height}", config.views);
    let cell = VirtualCellSpec::parse(&uri)?;
    let inspected = inspect(InspectionSpec::default(), Box::new(VirtualCell::open(&cell)?))
        .map_err(|source| MeasureError::Inspect { seed, source })?;
    Ok(script::measure(&inspected, &VirtualCell::open(&cell)?, seed))
}

fn summarize(motors: &[Motor]) -> Summary {
    let is_distance = |kind: Kind| matches!(kind, Kind::PointDistance | Kind::ElementDistance | Kind::Step);
    let all = || motors.iter().flat_map(|m| m.measurements.iter().map(|one| (m.voxel, one)));
    let distances = || all().filter(|(_, one)| is_distance(one.kind));
    Summary {
        measurements: all().count(),
        covered: all().filter(|(_, one)| one.is_covered()).count(),
        distance_error: median(distances().map(|(_, one)| one.error().abs())),
        distance_error_voxels: median(distances().map(|(voxel, one)| one.error().abs() / voxel)),
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
