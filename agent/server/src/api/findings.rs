//! `/inspections/{inspection}/findings`, `/criteria`, `/verdict`: what was measured and judged, and what it comes to with
//! everything that people decided.

use super::super::server::Shared;
use super::answer;
use super::problem::Problem;
use super::request::{blocking, inspection_id};
use crate::past::Past;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use schemars::JsonSchema;
use semascan_inspection::criteria::CheckedCriteria;
use semascan_model::InspectionId;
use semascan_model::criteria::Criteria;
use semascan_model::finding::{Finding, FindingId, FindingsRecord};
use semascan_model::record::InspectionRecord;
use semascan_model::review::{DrawnOutline, ReviewedState, SubjectState};
use semascan_model::verdict::{CriteriaRecord, Decision, Verdict};
use serde::Serialize;

/// The findings of an inspection.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct FindingsAnswer {
    /// What was measured; absent where nobody looked, which is no sign that there is nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<FindingsRecord>,
    /// The findings as they stand after all reviews; absent where nobody looked and nobody drew.
    #[serde(skip_serializing_if = "Option::is_none")]
    now: Option<Vec<Finding>>,
    /// Outlines of those that people drew.
    drawn: Vec<DrawnOutline>,
    /// Measured ones that people called an error.
    #[schemars(with = "Vec<String>")]
    found_in_error: Vec<FindingId>,
    /// The last review of this inspection that is taken into account; 0 where there is none.
    sequence: u64,
}

/// The criteria that an inspection was judged by.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct CriteriaAnswer {
    /// Their name, revision and digest.
    record: CriteriaRecord,
    /// What they say; absent where their text was not kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    criteria: Option<Criteria>,
}

/// The verdict on an inspection.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct VerdictAnswer {
    /// What counts now: a person's decision about the part, else what follows from the lines; absent where nobody judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    decision: Option<Decision>,
    /// The verdict by the criteria on what was measured; absent where it was not judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<Verdict>,
    /// The verdict with what people decided; absent where it was not judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    now: Option<Verdict>,
    /// Whether people changed findings and `now` could not be judged anew: its lines are those of the measured findings.
    is_outdated: bool,
    /// Subjects with reviews that contradict each other.
    conflicts: u32,
    /// The part, and every component and finding that was reviewed.
    subjects: Vec<SubjectState>,
    /// The last review of this inspection that is taken into account; 0 where there is none.
    sequence: u64,
}

impl Past {
    /// The criteria that an inspection was judged by, where their text was kept.
    pub(super) fn criteria_of(&self, record: &InspectionRecord) -> Result<Option<CheckedCriteria>, Problem> {
        let Some(verdict) = &record.verdict else { return Ok(None) };
        Ok(self.archive.criteria(&verdict.criteria.sha256)?)
    }

    /// The record of an inspection and the state that reviews brought it to.
    pub(crate) fn reviewed(&self, id: InspectionId) -> Result<(InspectionRecord, ReviewedState), Problem> {
        let record = self.record(id)?;
        let criteria = self.criteria_of(&record)?;
        let state = self.desk.state(&record, criteria.as_ref())?;
        Ok((record, state))
    }
}

/// What was found, and what people made of it.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/findings",
    tag = "findings",
    params(("inspection" = String, Path, description = "The inspection")),
    responses((status = 200, description = "The findings", body = ref("#/components/schemas/FindingsAnswer")))
)]
pub(super) async fn findings(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    blocking(&shared, move |past| {
        let (record, state) = past.reviewed(id)?;
        let ReviewedState { findings: now, drawn, found_in_error, sequence, .. } = state;
        answer::json(&headers, &FindingsAnswer { measured: record.findings, now, drawn, found_in_error, sequence })
    })
    .await
}

/// The criteria that the inspection was judged by.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/criteria",
    tag = "findings",
    params(("inspection" = String, Path, description = "The inspection")),
    responses((status = 200, description = "The criteria", body = ref("#/components/schemas/CriteriaAnswer")))
)]
pub(super) async fn criteria(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    blocking(&shared, move |past| {
        let record = past.record(id)?;
        let criteria = past.criteria_of(&record)?.map(|checked| checked.criteria);
        let verdict =
            record.verdict.ok_or_else(|| Problem::not_found(format!("inspection {id} was not judged by criteria")))?;
        answer::json(&headers, &CriteriaAnswer { record: verdict.criteria, criteria })
    })
    .await
}

/// What follows from the criteria, and what people decided.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/verdict",
    tag = "findings",
    params(("inspection" = String, Path, description = "The inspection")),
    responses((status = 200, description = "The verdict", body = ref("#/components/schemas/VerdictAnswer")))
)]
pub(super) async fn verdict(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    blocking(&shared, move |past| {
        let (record, state) = past.reviewed(id)?;
        let ReviewedState { decision, verdict: now, is_verdict_outdated, conflicts, subjects, sequence, .. } = state;
        let (measured, is_outdated) = (record.verdict, is_verdict_outdated);
        answer::json(&headers, &VerdictAnswer { decision, measured, now, is_outdated, conflicts, subjects, sequence })
    })
    .await
}
