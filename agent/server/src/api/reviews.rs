//! `/inspections/{inspection}/reviews`: what people decided, and the one command of the API.
//!
//! A review carries an identifier that its client made: sent again it is answered as before (200), another one with that
//! identifier is refused (409). It is on the disk before it is answered, and then told to all viewers.

use super::super::access::{Credential, Identity};
use super::super::past::Past;
use super::super::server::Shared;
use super::answer;
use super::content::content;
use super::openapi::{long_limits, numbers};
use super::problem::Problem;
use super::request::{blocking, command, inspection_id, limit, parsed};
use axum::Extension;
use axum::body::Body;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use jiff::Timestamp;
use schemars::JsonSchema;
use semascan_inspection::review::{ReviewError, Taken};
use semascan_model::InspectionId;
use semascan_model::review::{Review, ReviewEntry, Subject, SubjectState};
use semascan_model::verdict::Decision;
use semascan_protocol::{ReviewChange, ReviewSubject, review_subject};
use serde::{Deserialize, Serialize};
use utoipa::IntoParams;

/// Entries of a page where the client does not say it, and most.
const PAGE: (u32, u32) = (100, 500);
/// Bytes that a review may have: an outline of 20 000 points with all their digits.
pub(crate) const LARGEST: usize = 2 << 20;
/// Letters of a reason that viewers are told.
const TOLD: usize = 500;

/// A page of reviews.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct ReviewsQuery {
    /// Those behind this place of the log.
    #[param(schema_with = numbers)]
    after: Option<String>,
    /// Most of a page, 1 to 500.
    #[param(schema_with = long_limits)]
    limit: Option<String>,
}

/// Reviews of an inspection, in the order in which they were taken in.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ReviewList {
    /// The entries of the log.
    items: Vec<ReviewEntry>,
    /// `after` of the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<u64>,
    /// How the part stands, and every component and finding that was reviewed: a review says the `version` in `seen`.
    subjects: Vec<SubjectState>,
    /// The model's generation, which a review may name as `model`.
    #[serde(skip_serializing_if = "Option::is_none")]
    model: Option<String>,
}

/// A review that was taken in.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ReviewTaken {
    /// Its entry in the log. `conflicts_with` names the reviews that it contradicts.
    entry: ReviewEntry,
    /// What counts for the part now; absent where nobody judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    decision: Option<Decision>,
    /// Subjects of the inspection with reviews that contradict each other.
    conflicts: u32,
    /// How its subjects stand now.
    subjects: Vec<SubjectState>,
}

/// The reviews of an inspection.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/reviews",
    tag = "reviews",
    params(("inspection" = String, Path, description = "The inspection"), ReviewsQuery),
    responses((status = 200, description = "A page", body = ref("#/components/schemas/ReviewList")))
)]
pub(super) async fn list(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
    query: Result<Query<ReviewsQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let after: u64 = parsed("after", query.after.as_deref())?.unwrap_or(0);
    let page = limit(query.limit.as_deref(), PAGE.0, PAGE.1)?;
    blocking(&shared, move |past| answer::json(&headers, &page_of(past, id, after, page)?)).await
}

/// A page of the reviews of an inspection.
fn page_of(past: &Past, id: InspectionId, after: u64, page: u32) -> Result<ReviewList, Problem> {
    let (record, state) = past.reviewed(id)?;
    let logged = past.desk.log().entries(id, after.saturating_add(1), page + 1)?;
    let is_more = logged.len() > page as usize;
    let items: Vec<_> = logged.into_iter().take(page as usize).map(|logged| logged.entry).collect();
    let next = items.last().map(|entry| entry.sequence).filter(|_| is_more);
    let model = record.files.map(|files| files.generation);
    Ok(ReviewList { items, next, subjects: state.subjects, model })
}

/// All reviews of an inspection.
pub(super) fn all(past: &Past, id: InspectionId) -> Result<ReviewList, Problem> {
    let mut list = page_of(past, id, 0, PAGE.1)?;
    while let Some(after) = list.next {
        let more = page_of(past, id, after, PAGE.1)?;
        let items = std::mem::take(&mut list.items);
        list = ReviewList { items: [items, more.items].concat(), ..more };
    }
    Ok(list)
}

/// Takes a review in.
#[utoipa::path(
    post,
    path = "/api/v1/inspections/{inspection}/reviews",
    tag = "reviews",
    params(("inspection" = String, Path, description = "The inspection")),
    request_body(content = ref("#/components/schemas/Review"), content_type = "application/json"),
    responses(
        (status = 201, description = "It was taken in", body = ref("#/components/schemas/ReviewTaken")),
        (status = 200, description = "It had been taken in before", body = ref("#/components/schemas/ReviewTaken"))
    )
)]
pub(super) async fn take(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    Extension(identity): Extension<Identity>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let review: Review = content(&shared, &headers, body, "a review", LARGEST).await?;
    // Where nobody logs in, people say who they are.
    if identity.credential != Credential::Reach && review.person != identity.name {
        let reason = format!("is {}, and {} is who sends it", review.person, identity.name);
        return Err(Problem::new(StatusCode::FORBIDDEN, format!("person {reason}")).about("person"));
    }
    let answered = command(&shared, move |past| {
        let record = past.record(id)?;
        let criteria = past.criteria_of(&record)?;
        past.desk.take(&record, criteria.as_ref(), review, Timestamp::now()).map_err(Problem::from)
    })
    .await?;
    let Taken { entry, is_known, state } = answered;
    if !is_known {
        shared.tell_review(&change(&entry, state.decision, state.conflicts));
    }
    let status = if is_known { StatusCode::OK } else { StatusCode::CREATED };
    let taken = ReviewTaken { entry, decision: state.decision, conflicts: state.conflicts, subjects: state.subjects };
    let no_store = [(header::CACHE_CONTROL, HeaderValue::from_static("no-store"))];
    Ok((status, no_store, axum::Json(taken)).into_response())
}

impl From<ReviewError> for Problem {
    fn from(error: ReviewError) -> Self {
        match error {
            ReviewError::Field(field) => {
                Self::new(StatusCode::UNPROCESSABLE_ENTITY, field.to_string()).about(field.field)
            }
            ReviewError::Other(_) => Self::new(StatusCode::CONFLICT, error.to_string()).about("id"),
            ReviewError::Running(_) => Self::new(StatusCode::CONFLICT, error.to_string()),
            ReviewError::Model { .. } => Self::new(StatusCode::CONFLICT, error.to_string()).about("model"),
            ReviewError::Port(error) => Self::unavailable(&error),
        }
    }
}

/// What viewers are told of an entry.
fn change(entry: &ReviewEntry, decision: Option<Decision>, conflicts: u32) -> ReviewChange {
    let review = &entry.review;
    let kind = match &review.subject {
        Subject::Part => review_subject::Kind::Part(true),
        Subject::Component { component } => review_subject::Kind::Component(component.clone()),
        Subject::Finding { finding } => review_subject::Kind::Finding(finding.to_string()),
    };
    ReviewChange {
        inspection: entry.inspection.to_string(),
        sequence: entry.sequence,
        review: review.id.to_string(),
        subject: Some(ReviewSubject { kind: Some(kind) }),
        action: review.action.name().into(),
        person: review.person.clone(),
        at: entry.at.to_string(),
        reason: review.reason.chars().take(TOLD).collect(),
        conflicts_with: entry.conflicts_with.iter().map(ToString::to_string).collect(),
        decision: decision.map(|decision| decision.name().to_owned()).unwrap_or_default(),
        conflicts,
    }
}

#[cfg(test)]
mod tests {
    use super::super::content;
    use super::*;
    use proptest::prelude::*;

    fn parse(body: &[u8]) -> Result<Review, Problem> {
        content::parse(body)
    }

    #[test]
    fn what_is_no_review_is_refused_by_its_field() {
        let right = r#"{"id":"018f3f6e-0000-7000-8000-000000000001","subject":{"kind":"part"},"seen":0,
            "action":{"type":"accept"},"person":"A","reason":"fine"}"#;
        assert!(parse(right.as_bytes()).is_ok());
        for (from, to, word) in [
            ("\"seen\":0", "\"seen\":-1", "seen"),
            ("\"accept\"", "\"refuse\"", "action"),
            ("\"person\":\"A\"", "\"person\":5", "person"),
            ("\"seen\"", "\"sene\"", "sene"),
            ("018f3f6e-", "", "id"),
            ("\"fine\"}", "\"fine\"} x", "trailing"),
            ("{\"id\"", "x{\"id\"", "expected value"),
        ] {
            let problem = parse(right.replace(from, to).as_bytes()).expect_err(to);
            let said = serde_json::to_string(&problem).expect("plain data");
            assert!(said.contains(word) && said.contains("\"status\":400"), "{to}: {said}");
        }
    }

    proptest! {
        #[test]
        fn damaged_reviews_are_read_or_refused(
            damage in prop::collection::vec(
                (any::<prop::sample::Index>(), prop::sample::select(vec!["0", "-1", "1e308", "nan", "99999999999999999999", "null", "[[[[[[[[", "\"", "\u{0}ä", ""])),
                1..6,
            ),
            cut in any::<prop::sample::Index>(),
            is_cut in any::<bool>(),
        ) {
            let mut text: Vec<char> = r#"{"id":"018f3f6e-0000-7000-8000-000000000001","subject":{"kind":"part"},"seen":0,"action":{"type":"relabel",
                "patch":{"kind":"points","points":[[0,0.1,-2]],"radius":0.1},"component":"gear"},"person":"A","reason":"fine"}"#.chars().collect();
            for (at, word) in damage {
                let at = at.index(text.len());
                drop(text.splice(at..=at, word.chars()));
            }
            if is_cut {
                text.truncate(cut.index(text.len() + 1));
            }
            let text: String = text.into_iter().collect();
            let _ = parse(text.as_bytes());
        }
    }
}
