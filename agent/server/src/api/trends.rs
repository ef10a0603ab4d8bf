//! `/trends`: what inspections come to day by day, and which findings they have.

use super::super::server::Shared;
use super::answer;
use super::inspections::ListQuery;
use super::problem::Problem;
use super::request::blocking;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::HeaderMap;
use axum::response::Response;
use schemars::JsonSchema;
use semascan_inspection::ports::{ClassTrend, DayTrend, Trends};
use serde::Serialize;

/// Inspections that are counted, the latest ones.
const MOST: u32 = 10_000;

/// What inspections come to.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct TrendsAnswer {
    /// Days on which an inspection began, in order.
    days: Vec<Day>,
    /// What was found, by component and defect: what most inspections have first.
    classes: Vec<Class>,
    /// Inspections that are counted; of more than 10 000 the latest.
    inspections: u64,
}

/// One day.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Day {
    /// The day (RFC 3339, UTC).
    #[schemars(extend("format" = "date"))]
    day: String,
    /// Inspections that began.
    inspections: u64,
    /// Those of them in which defects were looked for.
    looked: u64,
    /// Their findings.
    findings: u64,
    /// Those about which this counts, decisions of people included.
    accept: u64,
    /// The same.
    rework: u64,
    /// The same.
    reject: u64,
    /// Those that a person must decide about.
    person: u64,
    /// Mean confidence of the models' components, 0 to 1, over the inspections of which it is known; absent where it is of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    confidence: Option<f64>,
}

/// Findings of a kind.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Class {
    /// The component that they are on.
    component: String,
    /// The defect; absent where they are of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    defect: Option<String>,
    /// `defect`, `completeness`, `deviation` or `drawn`.
    kind: String,
    /// How many.
    findings: u64,
    /// Inspections that have any.
    inspections: u64,
    /// Their area together where it is known, square metres; absent where it is known of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    area: Option<f64>,
    /// Findings whose area is not known.
    without_area: u64,
}

impl From<DayTrend> for Day {
    fn from(trend: DayTrend) -> Self {
        let DayTrend { day, inspections, looked, findings, accept, rework, reject, person, confidence } = trend;
        Self { day, inspections, looked, findings, accept, rework, reject, person, confidence }
    }
}

impl From<ClassTrend> for Class {
    fn from(trend: ClassTrend) -> Self {
        let ClassTrend { component, defect, kind, findings, inspections, area, without_area } = trend;
        Self { component, defect, kind, findings, inspections, area, without_area }
    }
}

/// What the inspections that all given parameters fit come to; `cursor` and `limit` mean nothing here.
#[utoipa::path(
    get,
    path = "/api/v1/trends",
    tag = "inspections",
    params(ListQuery),
    responses((status = 200, description = "The trends", body = ref("#/components/schemas/TrendsAnswer")))
)]
pub(super) async fn trends(
    State(shared): State<Shared>,
    headers: HeaderMap,
    query: Result<Query<ListQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let mut filter = query.filter()?;
    (filter.before, filter.limit) = (None, MOST);
    blocking(&shared, move |past| {
        let Trends { days, classes } = past.catalogue.trends(&filter)?;
        let inspections = days.iter().map(|day| day.inspections).sum();
        let days = days.into_iter().map(Day::from).collect();
        let classes = classes.into_iter().map(Class::from).collect();
        answer::json(&headers, &TrendsAnswer { days, classes, inspections })
    })
    .await
}
