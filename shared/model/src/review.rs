//! What people decide about an inspection: an append-only log of reviews, and the state that follows from it. Plain data.
//!
//! A review is sent with an identifier that its client made, so that sending it again is harmless, and with the version of
//! its subject that the person saw, so that two people who decide about the same version are told apart from one who decides
//! anew. Nothing is ever changed: a later entry stands beside the earlier ones. Positions in metres, table frame.

use crate::InspectionId;
use crate::finding::{Finding, FindingId, RegionFigures};
use crate::measurement::{KeptMeasurement, MeasurementRecord};
use crate::record::SoftwareRecord;
use crate::verdict::{CriteriaRecord, Decision, Verdict};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::fmt;
use uuid::Uuid;

/// Names a review: a UUID that its client made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReviewId(#[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "uuid")))] pub Uuid);

impl fmt::Display for ReviewId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What a review is about.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Subject {
    /// The part as a whole.
    Part,
    /// A component, all its instances together.
    Component {
        /// Its name.
        component: String,
    },
    /// A finding, measured or drawn.
    Finding {
        /// Its name.
        #[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "uuid")))]
        finding: FindingId,
    },
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Part => f.write_str("part"),
            Self::Component { component } => write!(f, "component {component}"),
            Self::Finding { finding } => write!(f, "finding {finding}"),
        }
    }
}

/// A patch of the model's surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum SurfacePatch {
    /// All surface nearer to one of these points than `radius`.
    Points {
        /// The points, metres, table frame.
        #[cfg_attr(feature = "schema", schemars(length(min = 1, max = 20_000)))]
        points: Vec<[f64; 3]>,
        /// Metres.
        radius: f64,
    },
    /// All surface in these cells of a grid in the table frame.
    Voxels {
        /// Edge of a cell, metres.
        edge: f64,
        /// Lowest corners of the cells divided by the edge.
        #[cfg_attr(feature = "schema", schemars(length(min = 1, max = 20_000)))]
        cells: Vec<[i32; 3]>,
    },
    /// The surface within a closed curve; the last point is joined with the first.
    Outline {
        /// Points on the surface, metres, table frame.
        #[cfg_attr(feature = "schema", schemars(length(min = 3, max = 20_000)))]
        outline: Vec<[f64; 3]>,
    },
}

/// What a person does with a subject.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum ReviewAction {
    /// It is good as it is.
    Accept,
    /// It is not used.
    Reject,
    /// It is to be worked on.
    Rework,
    /// A remark, which decides nothing.
    Comment,
    /// The finding is of another class than was found.
    Reclassify {
        /// The component that it is on; absent where that stays.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        component: Option<String>,
        /// The defect that it is; absent where there is none: it was found in error.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        defect: Option<String>,
    },
    /// A patch of surface has another class than the model says.
    Relabel {
        /// The patch.
        patch: SurfacePatch,
        /// Its component; absent where that stays.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        component: Option<String>,
        /// Its defect, `none` where it has none; absent where that stays.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        defect: Option<String>,
    },
    /// Something that was not found.
    NewFinding {
        /// A closed curve around it on the surface, metres, table frame; the last point is joined with the first.
        #[cfg_attr(feature = "schema", schemars(length(min = 3, max = 20_000)))]
        outline: Vec<[f64; 3]>,
        /// The component that it is on.
        component: String,
        /// The defect; absent for a remark.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        defect: Option<String>,
    },
    /// A measurement is kept.
    Measure {
        /// The measurement.
        measurement: Box<MeasurementRecord>,
    },
    /// A measurement that was kept is not used any more.
    Withdraw {
        /// The review that it came with.
        review: ReviewId,
    },
}

impl ReviewAction {
    /// Lower-case name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Accept => "accept",
            Self::Reject => "reject",
            Self::Rework => "rework",
            Self::Comment => "comment",
            Self::Reclassify { .. } => "reclassify",
            Self::Relabel { .. } => "relabel",
            Self::NewFinding { .. } => "new_finding",
            Self::Measure { .. } => "measure",
            Self::Withdraw { .. } => "withdraw",
        }
    }

    /// What it decides; `None` where it decides nothing.
    pub fn decision(&self) -> Option<Decision> {
        match self {
            Self::Accept => Some(Decision::Accept),
            Self::Reject => Some(Decision::Reject),
            Self::Rework => Some(Decision::Rework),
            Self::Comment
            | Self::Reclassify { .. }
            | Self::Relabel { .. }
            | Self::NewFinding { .. }
            | Self::Measure { .. }
            | Self::Withdraw { .. } => None,
        }
    }
}

/// A review as its client sends it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Review {
    /// Its name.
    pub id: ReviewId,
    /// What it is about.
    pub subject: Subject,
    /// The version of the subject that the person saw, as [`SubjectState::version`] says it; 0 where nothing had been decided.
    pub seen: u64,
    /// The generation of the model that the person saw, as the record's `files` say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// What is done.
    pub action: ReviewAction,
    /// Who. A server that knows its users takes their own name alone.
    #[cfg_attr(feature = "schema", schemars(length(min = 1, max = 200)))]
    pub person: String,
    /// Why. Decisions, remarks, changes of a class and what is withdrawn need a reason.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(length(max = 10_000)))]
    pub reason: String,
    /// Where decisions contradict each other: all of them, which this one settles.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resolves: Vec<ReviewId>,
}

/// A network that labelled the views.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NetworkVersion {
    /// Its name and version.
    pub name: String,
    /// SHA-256 of its files, hexadecimal, in the order of its manifest.
    pub sha256: Vec<String>,
}

/// What made the result that a person reviewed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReviewedVersions {
    /// What kept the review.
    pub software: SoftwareRecord,
    /// What made the model.
    pub inspected_with: SoftwareRecord,
    /// The model's generation; absent in records that did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// The networks; empty where labels came from elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub networks: Vec<NetworkVersion>,
    /// The criteria that it was judged by; absent where it was not judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub criteria: Option<CriteriaRecord>,
}

/// An entry of the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReviewEntry {
    /// Place in the log, from 1 without gaps.
    pub sequence: u64,
    /// The inspection.
    #[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "uuid")))]
    pub inspection: InspectionId,
    /// When it was taken in (RFC 3339, UTC).
    #[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "date-time")))]
    pub at: Timestamp,
    /// What the person looked at was made by these.
    pub versions: ReviewedVersions,
    /// Decisions about the same version of the subject that stand beside this one; empty where there is no conflict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conflicts_with: Vec<ReviewId>,
    /// The review as it was sent.
    pub review: Review,
    /// What the model says of the finding that it draws; absent in reviews that draw none, and in those of versions that measured
    /// nothing of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn: Option<DrawnFigures>,
}

/// What was measured of a finding that a person drew, when its review was taken in: of the surface of the model within the curve,
/// as that of findings that were found.
///
/// Confidence and sigma are those of the model's own defect labels there, whatever the person says. The uncertainty of the area
/// is that of the surface within the curve as it was drawn: how well the curve follows the defect is not in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DrawnFigures {
    /// Instances of the component that it touches, in order; empty where they are not told apart.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<u16>,
    /// The figures; absent where nothing could be measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<RegionFigures>,
    /// Why nothing could be measured, or what the figures leave out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// How a subject stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SubjectState {
    /// The subject.
    pub subject: Subject,
    /// Place in the log of the last decision about it or change of its class; 0 where there is none. A later review says it in
    /// `seen`.
    pub version: u64,
    /// What a person decided; absent where nobody did, or where decisions contradict each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decision: Option<Decision>,
    /// The decisions and changes that contradict each other, all of them; empty where there is no conflict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conflict: Vec<ReviewId>,
}

/// A finding that a person drew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DrawnOutline {
    /// The finding. It stands in the list with the region that was measured within the curve, where one was.
    #[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "uuid")))]
    pub finding: FindingId,
    /// The review that it came with.
    pub review: ReviewId,
    /// The curve, metres, table frame.
    pub outline: Vec<[f64; 3]>,
    /// Length of the curve, metres.
    pub perimeter: f64,
    /// Area of the curve seen along its mean normal, square metres: that of the surface within it where it is flat, else less.
    pub flat_area: f64,
    /// Why nothing was measured on the model, or what the figures leave out; absent where there is nothing to say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// An inspection as it stands after all reviews.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReviewedState {
    /// The last entry of this inspection that is taken into account; 0 where there is none.
    pub sequence: u64,
    /// The part, and every component and finding that there is an entry about.
    pub subjects: Vec<SubjectState>,
    /// The findings with their classes as people changed them, those that people drew included, those found in error left out;
    /// absent where nobody looked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub findings: Option<Vec<Finding>>,
    /// Outlines of the findings that people drew.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drawn: Vec<DrawnOutline>,
    /// Measurements that people keep, in the order in which they were taken in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measurements: Vec<KeptMeasurement>,
    /// Measured findings that people called an error.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "schema", schemars(with = "Vec<String>"))]
    pub found_in_error: Vec<FindingId>,
    /// The verdict with the decisions of people; absent where it was not judged by criteria.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Whether people changed findings after criteria judged them, and the verdict's lines are of the measured ones.
    pub is_verdict_outdated: bool,
    /// What counts: the decision of a person about the part, `person` where such decisions contradict each other, else what
    /// follows from the verdict; absent where nobody judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decision: Option<Decision>,
    /// Subjects with decisions that contradict each other.
    pub conflicts: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn review(action: ReviewAction) -> Review {
        Review {
            id: ReviewId(Uuid::from_u128(7)),
            subject: Subject::Component { component: "gear".into() },
            seen: 3,
            model: None,
            action,
            person: "A. Reviewer".into(),
            reason: "can be ground".into(),
            resolves: Vec::new(),
        }
    }

    #[test]
    fn a_review_is_read_as_it_was_written_and_an_unknown_field_is_named() {
        let relabel = ReviewAction::Relabel {
            patch: SurfacePatch::Points { points: vec![[0.0, 0.1, 0.2]], radius: 1e-3 },
            component: None,
            defect: Some("none".into()),
        };
        let outline = vec![[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]];
        let drawn = ReviewAction::NewFinding { outline, component: "gear".into(), defect: Some("wear".into()) };
        for action in [ReviewAction::Accept, ReviewAction::Comment, relabel, drawn] {
            let text = serde_json::to_string(&review(action.clone())).expect("plain data");
            assert_eq!(serde_json::from_str::<Review>(&text).expect("its own"), review(action), "{text}");
        }
        let text = serde_json::to_string(&review(ReviewAction::Rework)).expect("plain data");
        assert!(text.contains(r#""action":{"type":"rework"}"#), "{text}");
        let slip = text.replace("\"seen\"", "\"sene\"");
        let said = serde_json::from_str::<Review>(&slip).expect_err("a slip").to_string();
        assert!(said.contains("sene"), "{said}");
    }

    #[test]
    fn decisions_are_those_of_their_names() {
        for action in [ReviewAction::Accept, ReviewAction::Reject, ReviewAction::Rework] {
            assert_eq!(action.decision().map(Decision::name), Some(action.name()));
        }
        assert_eq!(ReviewAction::Comment.decision(), None);
        assert_eq!(Subject::Part.to_string(), "part");
    }
}
