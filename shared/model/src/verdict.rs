//! The verdict on a part: what follows from the criteria, line by line with its reason, and what a person made of it. Plain
//! data.

use crate::finding::{FindingId, NamedClass, Quantity};
use crate::record::SoftwareRecord;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

/// What becomes of a part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// It is good as it is.
    Accept,
    /// It is to be worked on.
    Rework,
    /// A person decides.
    #[default]
    Person,
    /// It is not used.
    Reject,
}

impl Decision {
    /// As it stands in criteria and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accept => "accept",
            Self::Rework => "rework",
            Self::Person => "person",
            Self::Reject => "reject",
        }
    }

    /// The decision of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Accept, Self::Rework, Self::Person, Self::Reject].into_iter().find(|decision| decision.name() == name)
    }

    /// What follows from several: a rejection whatever else there is; else a person decides, if about one line; else rework,
    /// if one asks for it.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        let weight = |decision| match decision {
            Self::Accept => 0,
            Self::Rework => 1,
            Self::Person => 2,
            Self::Reject => 3,
        };
        if weight(other) > weight(self) { other } else { self }
    }
}

/// How a figure stands to its limit ([ISO 14253-1]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Conformity {
    /// The whole interval of the figure keeps the limit.
    Holds,
    /// No part of it does.
    Broken,
    /// The limit lies within the interval, or the figure or its uncertainty is not known.
    Undecided,
}

/// What was compared with a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum JudgedFigure {
    /// Area of a finding, square metres.
    Area,
    /// Area of all findings as a share of the component's.
    Share,
    /// Length of a finding, metres.
    Length,
    /// Depth of a finding, metres.
    Depth,
    /// Number of findings.
    Count,
    /// Seen area of a component as a share of the expected one.
    Completeness,
    /// Mean share of the evidence.
    Confidence,
    /// Distance from the reference, metres.
    Deviation,
    /// Share of the component's surface whose defects nobody knows.
    Unjudged,
    /// How the inspection ended.
    Inspection,
    /// Whether a rule covers a finding.
    Coverage,
}

/// One comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VerdictLine {
    /// What was compared.
    pub figure: JudgedFigure,
    /// The component, where it is about one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub component: Option<NamedClass>,
    /// The defect, where it is about one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defect: Option<NamedClass>,
    /// The findings that it is about.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<FindingId>,
    /// The figure; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Quantity>,
    /// The limit, in the unit of the figure; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// How the figure stands to it.
    pub conformity: Conformity,
    /// What follows.
    pub decision: Decision,
    /// Why, in words.
    pub reason: String,
}

/// What a part was judged by.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CriteriaRecord {
    /// Name of the criteria.
    pub name: String,
    /// Their revision.
    pub revision: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
}

/// A decision of a person in place of the automatic one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Override {
    /// What was decided.
    pub decision: Decision,
    /// Who.
    pub person: String,
    /// When (RFC 3339, UTC).
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub at: Timestamp,
    /// Why.
    pub reason: String,
}

/// Why a decision of a person cannot be taken down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OverrideError {
    /// Nobody is named.
    #[error("person: nobody is named")]
    Person,
    /// There is no reason.
    #[error("reason: none is given")]
    Reason,
    /// That a person decides is what they were asked for.
    #[error("decision: that a person decides is no decision of a person")]
    Decision,
}

impl Override {
    /// The decision of `person`, for `reason`.
    ///
    /// # Errors
    /// [`OverrideError`] naming what is missing.
    pub fn new(decision: Decision, person: &str, at: Timestamp, reason: &str) -> Result<Self, OverrideError> {
        let (person, reason) = (person.trim(), reason.trim());
        match (person.is_empty(), reason.is_empty(), decision) {
            (true, ..) => Err(OverrideError::Person),
            (_, true, _) => Err(OverrideError::Reason),
            (.., Decision::Person) => Err(OverrideError::Decision),
            _ => Ok(Self { decision, person: person.into(), at, reason: reason.into() }),
        }
    }
}

/// The verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Verdict {
    /// What it was judged by.
    pub criteria: CriteriaRecord,
    /// What judged.
    pub software: SoftwareRecord,
    /// When (RFC 3339, UTC).
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub at: Timestamp,
    /// What follows from the lines.
    pub automatic: Decision,
    /// Every comparison.
    pub lines: Vec<VerdictLine>,
    /// What people decided in its place, in order: the last one counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<Override>,
}

impl Verdict {
    /// What counts: the last decision of a person, else the automatic one.
    pub fn decision(&self) -> Decision {
        self.overrides.last().map_or(self.automatic, |o| o.decision)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_that_of_its_decision() {
        for decision in [Decision::Accept, Decision::Rework, Decision::Person, Decision::Reject] {
            assert_eq!(Decision::from_name(decision.name()), Some(decision));
        }
        assert_eq!(Decision::from_name("Accept"), None);
    }

    #[test]
    fn the_heavier_decision_counts() {
        use Decision::{Accept, Person, Rework};
        let of = |list: &[Decision]| list.iter().fold(Accept, |all, one| all.with(*one));
        assert_eq!(of(&[]), Accept);
        assert_eq!(of(&[Accept, Rework]), Rework);
        assert_eq!(of(&[Person, Rework]), Person, "rework may turn out to be a rejection");
        assert_eq!(of(&[Decision::Reject, Person, Rework]), Decision::Reject);
    }

    #[test]
    fn a_person_needs_a_name_and_a_reason() {
        let at = Timestamp::UNIX_EPOCH;
        let new = |decision, person, reason| Override::new(decision, person, at, reason);
        assert_eq!(new(Decision::Accept, " ", "fine"), Err(OverrideError::Person));
        assert_eq!(new(Decision::Accept, "A", "\n"), Err(OverrideError::Reason));
        assert_eq!(new(Decision::Person, "A", "fine"), Err(OverrideError::Decision));
        let software = SoftwareRecord { name: "semascan".into(), version: "1".into() };
        let criteria = CriteriaRecord { name: "n".into(), revision: "1".into(), sha256: String::new() };
        let mut verdict =
            Verdict { criteria, software, at, automatic: Decision::Reject, lines: Vec::new(), overrides: Vec::new() };
        assert_eq!(verdict.decision(), Decision::Reject);
        verdict.overrides.push(new(Decision::Rework, "A", "can be ground").expect("complete"));
        assert_eq!(verdict.decision(), Decision::Rework);
    }
}
