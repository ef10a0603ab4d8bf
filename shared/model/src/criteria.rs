//! `criteria.toml`: what is acceptable on a part, by component and defect, and what follows where it is not. Plain data;
//! lengths in millimetres and areas in square millimetres, because people write them.
//!
//! `semascan_inspection::criteria` reads and checks it, `semascan_inspection::verdict` judges by it.

use crate::LengthUnit;
use crate::verdict::Decision;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Version of the layout of `criteria.toml` that this program reads.
pub const CRITERIA_VERSION: u32 = 1;

/// The contents of `criteria.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Criteria {
    /// Version of this layout: 1.
    pub version: u32,
    /// Name of the criteria, for people.
    pub name: String,
    /// Their own version, as whoever is responsible for them counts.
    pub revision: String,
    /// What follows from a finding that no rule covers.
    #[serde(default)]
    pub unlisted: Decision,
    /// Largest share of a component's seen surface of which nobody knows whether it has a defect, 0 to 1. Where it is larger a
    /// person decides.
    #[serde(default = "largest_unjudged_share")]
    pub largest_unjudged_share: f64,
    /// The shape that the part should have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceRule>,
    /// What is expected of components.
    #[serde(default, rename = "component", skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<ComponentRule>,
    /// What is tolerated of defects.
    #[serde(default, rename = "defect", skip_serializing_if = "Vec::is_empty")]
    pub defects: Vec<DefectRule>,
}

/// A hundredth: less than what a rim of labels without evidence makes up on small components.
fn largest_unjudged_share() -> f64 {
    0.01
}

/// The shape that the part should have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ReferenceRule {
    /// A mesh in the table frame (PLY, OBJ, STL, glTF, GLB); relative to the folder of `criteria.toml`.
    pub file: PathBuf,
    /// Unit of its lengths.
    pub unit: LengthUnit,
    /// Largest tolerated distance of the surface from it, millimetres.
    pub tolerance_mm: f64,
    /// What follows from a larger one.
    pub then: Decision,
}

/// What is expected of a component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ComponentRule {
    /// Name of the component class.
    pub component: String,
    /// Area of its surface that a complete inspection sees, square millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_area_mm2: Option<f64>,
    /// Least share of this area that must have been seen, 0 to 1; without it the component must have been seen at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_completeness: Option<f64>,
    /// Least mean share of the evidence for the component's class, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_confidence: Option<f64>,
    /// What follows where that is not so.
    pub then: Decision,
}

/// What is tolerated of a defect. A rule for a component stands in place of those for all components. Of several rules for
/// the same component and defect all are judged, so that small ones can be reworked and large ones rejected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct DefectRule {
    /// Name of the component class; every component if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub component: Option<String>,
    /// Name of the defect class.
    pub defect: String,
    /// Largest area of a finding, square millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_area_mm2: Option<f64>,
    /// Largest share of the component's seen area that all findings together take, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_share: Option<f64>,
    /// Largest length of a finding along the surface, millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_length_mm: Option<f64>,
    /// Largest depth of a finding, millimetres: against the reference where there is one, else against its surroundings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_depth_mm: Option<f64>,
    /// Largest number of findings on the component.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_count: Option<u32>,
    /// Area from which on a finding counts, square millimetres; every finding if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counted_from_mm2: Option<f64>,
    /// Least mean share of the evidence that the class of a finding has, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_confidence: Option<f64>,
    /// What follows where one of these limits does not hold. `accept` takes the defect whatever its size and has no limits.
    pub then: Decision,
}

impl Criteria {
    /// The JSON Schema of `criteria.toml`, read as JSON.
    #[cfg(feature = "schema")]
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(Self).into()
    }
}

impl DefectRule {
    /// Whether it states a limit.
    pub fn has_limit(&self) -> bool {
        let Self { largest_area_mm2, largest_share, largest_length_mm, largest_depth_mm, least_confidence, .. } = self;
        [largest_area_mm2, largest_share, largest_length_mm, largest_depth_mm, least_confidence]
            .iter()
            .any(|limit| limit.is_some())
            || self.largest_count.is_some()
    }
}
