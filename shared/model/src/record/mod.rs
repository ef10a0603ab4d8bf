//! `inspection.json`, schema 2: what was inspected, how each view went, what was found, and how true it is where truth is
//! known.
//!
//! | file | what |
//! |---|---|
//! | `mod.rs` | the record of an inspection |
//! | `view.rs` | one view: pose, registration, timings |
//! | `files.rs` | the files that belong to the record |
//! | `run.rs` | how many views were used, what the region of interest left out |
//! | `stage.rs` | the stages of a view, and how an inspection ends |
//! | `networks.rs` | the networks, and what they said of a view |
//! | `plan.rs` | the views that were planned, and why no more were |
//! | `photometric.rs` | the poses against the pictures |
//! | `truth.rs` | the model against truth |
//! | `reader.rs` | reading it back; version 1 is upgraded |

mod files;
mod networks;
mod photometric;
mod plan;
mod reader;
mod run;
mod stage;
mod truth;
mod view;

pub use files::FilesRecord;
pub use networks::{
    Augmentation, DomainRecord, EngineDescription, Fusion, ModelReport, NetworkFile, NetworkReport, NetworksRecord,
    Provider, Region, Statistic, Task, Uncertain, UncertaintyFigures, ViewNetworksRecord, WeightsFile, WindowRecord,
};
pub use photometric::PhotometricRecord;
pub use plan::{
    ExpectedGain, PlanCoverage, PlanPurpose, PlanRecord, PlanStop, PlanStrategy, PlannedView, UnreachableRegion,
};
pub use reader::RecordError;
pub use run::{RegionRecord, RunRecord};
pub use stage::{Outcome, Stage};
pub use truth::{AlignedTruth, ClassTruth, Convention, PoseErrorRecord, TruthAtTruePoses, TruthRecord};
pub use view::{
    GlobalRecord, IcpRecord, MisidentificationRecord, PoseRecord, QuaternionRecord, RefinementRecord,
    RegistrationRecord, StageTime, ViewPose, ViewRecord,
};

use crate::finding::FindingsRecord;
use crate::verdict::Verdict;
use crate::{ClassDef, FeatureFigures, InspectionId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

/// Grows when a field changes its meaning or goes away.
pub const SCHEMA_VERSION: u32 = 2;

/// The record of one inspection. Metres, radians, seconds, square metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InspectionRecord {
    /// Version of this layout: 2.
    pub schema_version: u32,
    /// UUID of version 7, unique to the run.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub id: InspectionId,
    /// When it began (RFC 3339, UTC).
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub began: Timestamp,
    /// When it ended; absent in records that did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub ended: Option<Timestamp>,
    /// How it ended.
    pub outcome: Outcome,
    /// The files that were written with the record; absent in records that did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files: Option<FilesRecord>,
    /// What wrote the record.
    pub software: SoftwareRecord,
    /// The part, for people.
    pub part: String,
    /// The source's URI or path.
    pub source: String,
    /// Where the labels came from.
    pub labels: LabelSource,
    /// The networks that labelled the views; absent where the labels came from elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub networks: Option<NetworksRecord>,
    /// Seeds and settings of the source that make the run repeatable.
    pub settings: Vec<Setting>,
    /// Voxel edge in metres; `null` if no view could be used.
    pub voxel: Option<f64>,
    /// Points of the model, flagged ones included.
    pub points: u64,
    /// The table frame, at table angle 0, in the robot base; absent without a robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_from_table: Option<PoseRecord>,
    /// The refinement of all poses together; absent if they were not refined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refinement: Option<RefinementRecord>,
    /// How well the poses agree with the pictures; absent in records that did not keep it, and while it runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photometric: Option<PhotometricRecord>,
    /// The views that were planned; absent where they came as they came.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanRecord>,
    /// How the run went; absent in records that did not keep it, and while it runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<RunRecord>,
    /// Every view, in capture order.
    pub views: Vec<ViewRecord>,
    /// Every component class.
    pub components: Vec<ClassSummary>,
    /// Every defect class.
    pub defects: Vec<ClassSummary>,
    /// What was found: defects with their place and size. Absent in records that did not keep it, and where no labels were
    /// used or there is no mesh: that is no sign that there is nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub findings: Option<FindingsRecord>,
    /// What follows from criteria; absent where it was not judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// The model against truth, where the source knows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthRecord>,
}

/// What wrote a record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SoftwareRecord {
    /// Program.
    pub name: String,
    /// Version.
    pub version: String,
}

/// A seed or setting of the source.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Setting {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
}

impl InspectionRecord {
    /// Mean confidence of the components over their points, 0 to 1; `None` where nothing is labelled, which is no sign that labels
    /// are bad.
    pub fn component_confidence(&self) -> Option<f64> {
        let components = || self.components.iter().filter(|summary| summary.class != 0);
        let points: u64 = components().map(|summary| summary.points).sum();
        let share: f64 = components().map(|summary| summary.points as f64 * summary.confidence).sum();
        let is_known = self.labels != LabelSource::None && points > 0;
        is_known.then(|| share / points as f64).filter(|mean| (0.0..=1.0).contains(mean))
    }

    /// The JSON Schema of `inspection.json`.
    #[cfg(feature = "schema")]
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(Self).into()
    }
}

/// Where labels come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum LabelSource {
    /// Recorded masks or simulated truth that come with the views.
    #[default]
    Source,
    /// Trained networks.
    Network,
    /// Geometry only.
    None,
}

impl LabelSource {
    /// As it stands in specifications and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Source => "source",
            Self::Network => "network",
            Self::None => "none",
        }
    }
}

/// Figures of one class, over the points that are part of the surface: neither outliers nor background nor dropped for
/// their uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ClassSummary {
    /// Class.
    pub class: u16,
    /// Its name.
    pub name: String,
    /// Points that carry it.
    pub points: u64,
    /// Area of the surface that was seen, measured on the mesh, square metres; `null` where there is no mesh. Records that
    /// an earlier version wrote state an estimate from the number of points.
    pub area: Option<f64>,
    /// Mean share of the evidence.
    pub confidence: f64,
    /// Mean standard uncertainty of the label, 0 to 1; absent in records that did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

impl ClassSummary {
    /// The summary of `class` with its figures.
    pub fn new(class: &ClassDef, figures: FeatureFigures) -> Self {
        let FeatureFigures { points, area, confidence, sigma, .. } = figures;
        Self { class: class.id, name: class.name.clone(), points, area, confidence, sigma: Some(sigma) }
    }
}
