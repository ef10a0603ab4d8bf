//! What the record says of the views that were planned: which poses were asked for and what was expected of them, why no more
//! were, and what of the part no pose of the cell can see. Metres, radians, square metres; poses in the table frame.

use super::view::PoseRecord;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How the next view is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum PlanStrategy {
    /// By what it is expected to add to the model, less the way to it.
    #[default]
    NextBest,
    /// By the number of frontier voxels that it would see.
    Greedy,
    /// Regular steps of the table.
    Uniform,
    /// Anywhere within the limits of the cell.
    Random,
}

impl PlanStrategy {
    /// As it stands in specifications and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::NextBest => "next-best",
            Self::Greedy => "greedy",
            Self::Uniform => "uniform",
            Self::Random => "random",
        }
    }
}

/// The views that were planned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlanRecord {
    /// How they were chosen.
    pub strategy: PlanStrategy,
    /// Seed of everything random in it.
    pub seed: u64,
    /// The views, in the order in which they were asked for.
    pub views: Vec<PlannedView>,
    /// Why no more were asked for; absent while the inspection runs, and where it was cut off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stopped: Option<PlanStop>,
    /// What was covered in the end, as the planner knows it; absent where the planner does not look at the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<PlanCoverage>,
}

/// A view that was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedView {
    /// Position in the capture order, from 0.
    pub view: u32,
    /// What it is for.
    pub purpose: PlanPurpose,
    /// The camera in the table frame.
    pub table_from_camera: PoseRecord,
    /// How far the table is turned, radians.
    pub table_angle: f64,
    /// What it was expected to add; absent where the strategy does not look at the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<ExpectedGain>,
    /// Poses that it was chosen from.
    pub candidates: u32,
    /// Time that planning it took.
    pub seconds: f64,
}

/// What a view is for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "stage", rename_all = "snake_case")]
pub enum PlanPurpose {
    /// To see the whole surface.
    Overall,
    /// To see regions of interest closely.
    Targeted {
        /// What is looked at, for people.
        regions: Vec<String>,
    },
}

/// What a view was expected to add.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ExpectedGain {
    /// Surface that nothing is known of yet, square metres, weighted by how well it would be seen.
    pub frontier: f64,
    /// Surface that is known, times how much better it would be seen.
    pub quality: f64,
    /// Surface whose labels are uncertain, times how much the view would tell of them.
    pub labels: f64,
    /// Share of what it would see that is known already.
    pub overlap: f64,
    /// Time that the cell takes to get there, seconds.
    pub motion: f64,
    /// What it was chosen by: the sum of the gains less the price of the way, square metres.
    pub score: f64,
}

/// Why no more views were asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum PlanStop {
    /// As many were taken as are allowed.
    ViewLimit,
    /// No pose promises enough.
    LittleGain {
        /// Gain of the best pose as a share of the surface that is known.
        expected: f64,
        /// The least share that is worth a view.
        least: f64,
    },
    /// The cell reaches no other pose.
    NoPose,
}

impl fmt::Display for PlanStop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ViewLimit => f.write_str("as many views were taken as are allowed"),
            Self::LittleGain { expected, least } => {
                let (expected, least) = (100.0 * expected, 100.0 * least);
                write!(f, "the best pose would add {expected:.2} % of the surface, less than {least:.2} %")
            }
            Self::NoPose => f.write_str("the cell reaches no other pose"),
        }
    }
}

/// What planned views have covered, as the planner knows it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlanCoverage {
    /// How the figures are to be read.
    pub convention: String,
    /// Surface that was measured.
    pub measured: f64,
    /// Of it: seen well, within the largest incidence.
    pub well_seen: f64,
    /// Surface that is expected behind what is not known, and that some pose of the cell would see.
    pub frontier: f64,
    /// The same that no pose of the cell sees.
    pub unreachable: f64,
    /// The largest connected pieces of what no pose sees.
    pub unreachable_regions: Vec<UnreachableRegion>,
}

/// A piece of expected surface that no pose of the cell sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct UnreachableRegion {
    /// Its centre, metres in the table frame.
    pub centre: [f64; 3],
    /// Its area.
    pub area: f64,
}
