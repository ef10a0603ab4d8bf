//! The catalogue: parts, inspections, their views and what happened, as rows.

use super::{BusMessage, PortError};
use jiff::Timestamp;
use semascan_model::InspectionId;
use semascan_model::finding::Finding;
use semascan_model::record::InspectionRecord;
use semascan_model::verdict::Decision;
use std::fmt;
use std::str::FromStr;

/// How an inspection stands in the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InspectionState {
    /// It runs, or was killed.
    Running,
    /// Its model is there.
    Finished,
    /// Somebody ended it early.
    Stopped,
    /// It came to no usable model.
    Failed,
    /// It was killed and cannot be continued.
    Interrupted,
}

impl InspectionState {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Finished => "finished",
            Self::Stopped => "stopped",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }
}

impl fmt::Display for InspectionState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for InspectionState {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        [Self::Running, Self::Finished, Self::Stopped, Self::Failed, Self::Interrupted]
            .into_iter()
            .find(|state| state.name() == text)
            .ok_or_else(|| format!("{text} is no state of an inspection"))
    }
}

/// An inspection.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectionRow {
    /// The inspection.
    pub id: InspectionId,
    /// The part, for people; parts of one name are one part.
    pub part: String,
    /// URI or path of the source.
    pub source: String,
    /// What it is run with, as JSON of [`crate::spec::InspectionSpec`].
    pub spec: String,
    /// When it began.
    pub began: Timestamp,
    /// When it ended; `None` while it runs.
    pub ended: Option<Timestamp>,
    /// How it stands.
    pub state: InspectionState,
    /// Why it failed or was interrupted.
    pub reason: Option<String>,
    /// Whether retention must leave it alone.
    pub held: bool,
    /// Views that are committed, those that were left out included.
    pub views: u32,
    /// What was found and decided.
    pub result: ResultRow,
}

/// What was found in an inspection and decided about it, in short.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResultRow {
    /// What counts now, decisions of people included; `None` where nobody judged.
    pub decision: Option<Decision>,
    /// What follows from criteria alone; `None` where it was not judged by any.
    pub automatic: Option<Decision>,
    /// Subjects with decisions that contradict each other.
    pub conflicts: u32,
    /// Findings, those of people included; `None` where nobody looked, which is no sign that there is nothing.
    pub findings: Option<u32>,
}

/// A finding of an inspection, as far as lists are filtered by it.
#[derive(Clone, Debug, PartialEq)]
pub struct FindingRow {
    /// Its name.
    pub id: String,
    /// Its kind, as [`semascan_model::finding::FindingKind::name`] says it.
    pub kind: &'static str,
    /// Name of the component that it is on.
    pub component: String,
    /// Name of the defect, where it is of one.
    pub defect: Option<String>,
    /// Its area in square metres, where it is known.
    pub area: Option<f64>,
}

impl FindingRow {
    /// The row of a finding.
    pub fn of(finding: &Finding) -> Self {
        Self {
            id: finding.id.to_string(),
            kind: finding.kind.name(),
            component: finding.component.name.clone(),
            defect: finding.kind.defect().map(|defect| defect.name.clone()),
            area: finding.area().map(|area| area.value),
        }
    }
}

/// What is listed of an inspection that is over.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultRows {
    /// In short.
    pub row: ResultRow,
    /// Its findings.
    pub findings: Vec<FindingRow>,
    /// Mean confidence of the components of its model; `None` where it is not known.
    pub confidence: Option<f64>,
}

impl ResultRows {
    /// What is listed of an inspection with this record.
    pub fn of(record: &InspectionRecord) -> Self {
        let findings = record.findings.as_ref().map(|findings| findings.list.as_slice());
        let row = ResultRow {
            decision: record.verdict.as_ref().map(|verdict| verdict.decision()),
            automatic: record.verdict.as_ref().map(|verdict| verdict.automatic),
            conflicts: 0,
            findings: findings.map(|list| list.len() as u32),
        };
        let findings = findings.unwrap_or_default().iter().map(FindingRow::of).collect();
        Self { row, findings, confidence: record.component_confidence() }
    }
}

/// A view that is through all stages.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewRow {
    /// Position in the capture order.
    pub index: u32,
    /// Whether it became part of the model.
    pub accepted: bool,
    /// JSON of [`semascan_model::record::ViewRecord`].
    pub record: String,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRow {
    /// Place in the history.
    pub sequence: u64,
    /// When.
    pub time: Timestamp,
    /// JSON of [`crate::event::EventKind`].
    pub kind: String,
}

/// What is committed together: all of it or nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Commit {
    /// What happened since the last commit.
    pub events: Vec<EventRow>,
    /// The view that is through, if one is. A row of the same view is replaced.
    pub view: Option<ViewRow>,
    /// Messages about it for the [`Bus`](super::Bus).
    pub messages: Vec<BusMessage>,
}

/// Which inspections are listed.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectionFilter {
    /// Those in this state alone.
    pub state: Option<InspectionState>,
    /// Those whose part's name holds this piece, in capitals or small letters.
    pub part: Option<String>,
    /// Those alone about which this counts now.
    pub decision: Option<Decision>,
    /// Whether those alone whose decisions contradict each other.
    pub in_conflict: bool,
    /// Those alone with a finding on this component; together with `defect`, with one of that defect on it.
    pub component: Option<String>,
    /// Those alone with a finding of this defect.
    pub defect: Option<String>,
    /// Those alone that began then or later, to a millisecond.
    pub from: Option<Timestamp>,
    /// Those alone that began before then, to a millisecond.
    pub until: Option<Timestamp>,
    /// Those that began before this one, for the next page.
    pub before: Option<InspectionId>,
    /// Most that are listed.
    pub limit: u32,
}

impl Default for InspectionFilter {
    fn default() -> Self {
        Self {
            state: None,
            part: None,
            decision: None,
            in_conflict: false,
            component: None,
            defect: None,
            from: None,
            until: None,
            before: None,
            limit: u32::MAX,
        }
    }
}

/// What inspections come to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trends {
    /// Days on which one began, in order.
    pub days: Vec<DayTrend>,
    /// What was found, by component and defect: what most inspections have first.
    pub classes: Vec<ClassTrend>,
}

/// Inspections that began on one day.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DayTrend {
    /// The day (UTC), as `2026-11-29`.
    pub day: String,
    /// How many.
    pub inspections: u64,
    /// Those in which defects were looked for.
    pub looked: u64,
    /// Their findings.
    pub findings: u64,
    /// Those that count as accepted now, decisions of people included.
    pub accept: u64,
    /// The same, to be worked on.
    pub rework: u64,
    /// The same, rejected.
    pub reject: u64,
    /// Those that a person must decide about.
    pub person: u64,
    /// Mean over the inspections whose components' mean confidence is known; `None` where it is known of none.
    pub confidence: Option<f64>,
}

/// Findings of a kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassTrend {
    /// Name of the component that they are on.
    pub component: String,
    /// Name of the defect, where they are of one.
    pub defect: Option<String>,
    /// As [`FindingRow::kind`].
    pub kind: String,
    /// How many.
    pub findings: u64,
    /// Inspections that have any.
    pub inspections: u64,
    /// Their area together, square metres, where it is known; `None` where it is known of none.
    pub area: Option<f64>,
    /// Findings whose area is not known.
    pub without_area: u64,
}

/// Rows of parts, inspections, views and events. What a method has returned from is durable. Every method fails with a
/// [`PortError`] that names the database and the reason.
#[allow(clippy::missing_errors_doc)]
pub trait Catalogue: Send + Sync {
    /// Adds an inspection that begins.
    fn begin(&self, row: &InspectionRow) -> Result<(), PortError>;

    /// Adds what happened in an inspection.
    fn commit(&self, id: InspectionId, commit: &Commit) -> Result<(), PortError>;

    /// Closes an inspection.
    fn close(
        &self,
        id: InspectionId,
        ended: Timestamp,
        state: InspectionState,
        reason: Option<&str>,
    ) -> Result<(), PortError>;

    /// An inspection, if there is one.
    fn inspection(&self, id: InspectionId) -> Result<Option<InspectionRow>, PortError>;

    /// Inspections, the latest first.
    fn inspections(&self, filter: &InspectionFilter) -> Result<Vec<InspectionRow>, PortError>;

    /// What the inspections that `filter` fits come to.
    fn trends(&self, filter: &InspectionFilter) -> Result<Trends, PortError>;

    /// Notes what was found in an inspection and decided about it, in place of what was noted before.
    fn set_result(&self, id: InspectionId, result: &ResultRows) -> Result<(), PortError>;

    /// Inspections that are over and whose result was never noted, the earliest first.
    fn without_result(&self) -> Result<Vec<InspectionId>, PortError>;

    /// The views of an inspection in capture order.
    fn views(&self, id: InspectionId) -> Result<Vec<ViewRow>, PortError>;

    /// At most `limit` events of an inspection from the place `from` on.
    fn events(&self, id: InspectionId, from: u64, limit: u32) -> Result<Vec<EventRow>, PortError>;

    /// The place of the next event of an inspection.
    fn next_event(&self, id: InspectionId) -> Result<u64, PortError>;

    /// Whether retention must leave an inspection alone from now on.
    fn hold(&self, id: InspectionId, held: bool) -> Result<(), PortError>;

    /// Forgets an inspection and all its rows.
    fn remove(&self, id: InspectionId) -> Result<(), PortError>;
}
