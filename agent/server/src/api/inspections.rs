//! `/inspections`: past inspections and the one that runs, the latest first.

use super::super::server::Shared;
use super::answer;
use super::openapi::{decisions, identifiers, limits, states, times};
use super::problem::Problem;
use super::request::{blocking, inspection_id, limit, parsed};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::HeaderMap;
use axum::response::Response;
use jiff::Timestamp;
use schemars::JsonSchema;
use semascan_inspection::ports::{InspectionFilter, InspectionRow};
use semascan_model::record::{ClassSummary, InspectionRecord, LabelSource, RunRecord, SoftwareRecord};
use semascan_model::verdict::Decision;
use serde::{Deserialize, Serialize};
use utoipa::IntoParams;

/// Inspections of a page where the client does not say it, and most.
const PAGE: (u32, u32) = (50, 200);

/// Which inspections are listed: those that all given parameters fit.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct ListQuery {
    /// How they stand.
    #[param(schema_with = states)]
    state: Option<String>,
    /// A piece of the part's name, in capitals or small letters: `gear` finds `Gear 7` and `GEARBOX`.
    part: Option<String>,
    /// What counts now, decisions of people included.
    #[param(schema_with = decisions)]
    decision: Option<String>,
    /// `true`: those with reviews that contradict each other.
    #[param(value_type = bool)]
    conflict: Option<String>,
    /// With a finding on this component; together with `defect`, with one of that defect on it.
    component: Option<String>,
    /// With a finding of this defect.
    defect: Option<String>,
    /// That began then or later (RFC 3339).
    #[param(schema_with = times)]
    from: Option<String>,
    /// That began before then (RFC 3339).
    #[param(schema_with = times)]
    until: Option<String>,
    /// `next` of the page before.
    #[param(schema_with = identifiers)]
    cursor: Option<String>,
    /// Most of a page, 1 to 200.
    #[param(schema_with = limits)]
    limit: Option<String>,
}

/// An inspection in short.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct InspectionSummary {
    /// The inspection.
    #[schemars(extend("format" = "uuid"))]
    id: String,
    /// The part, for people.
    part: String,
    /// URI or path of the source.
    source: String,
    /// `running`, `finished`, `stopped`, `failed` or `interrupted`.
    state: &'static str,
    /// Why it failed or was interrupted.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    /// When it began (RFC 3339, UTC).
    #[schemars(extend("format" = "date-time"))]
    began: String,
    /// When it ended; absent while it runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("format" = "date-time"))]
    ended: Option<String>,
    /// Views that are kept.
    views: u32,
    /// Whether retention leaves it alone.
    held: bool,
    /// Findings, those of people included; absent where nobody looked, which is no sign that there is nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    findings: Option<u32>,
    /// What counts now, decisions of people included; absent where nobody judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    decision: Option<Decision>,
    /// What follows from criteria alone; absent where it was not judged by any.
    #[serde(skip_serializing_if = "Option::is_none")]
    automatic: Option<Decision>,
    /// Subjects with reviews that contradict each other.
    conflicts: u32,
}

/// A page of inspections, the latest first.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct InspectionList {
    /// The inspections.
    items: Vec<InspectionSummary>,
    /// The `cursor` of the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

/// An inspection.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct InspectionDetail {
    #[serde(flatten)]
    summary: InspectionSummary,
    /// What its record says; absent while there is none. The whole record is the export `inspection.json`.
    #[serde(skip_serializing_if = "Option::is_none")]
    record: Option<RecordHead>,
}

/// The head of a record.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct RecordHead {
    /// What wrote it.
    software: SoftwareRecord,
    /// Where the labels came from.
    labels: LabelSource,
    /// Voxel edge, metres; absent where there is no model.
    #[serde(skip_serializing_if = "Option::is_none")]
    voxel: Option<f64>,
    /// Points of the model.
    points: u64,
    /// The model's generation, which reviews name as `model`; absent where there is no model.
    #[serde(skip_serializing_if = "Option::is_none")]
    generation: Option<String>,
    /// Files that can be exported.
    files: Vec<String>,
    /// How the run went; absent while it runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    run: Option<RunRecord>,
    /// Component classes.
    components: Vec<ClassSummary>,
    /// Defect classes.
    defects: Vec<ClassSummary>,
}

impl From<InspectionRow> for InspectionSummary {
    fn from(row: InspectionRow) -> Self {
        let InspectionRow { id, part, source, spec: _, began, ended, state, reason, held, views, result } = row;
        Self {
            id: id.to_string(),
            part,
            source,
            state: state.name(),
            reason,
            began: began.to_string(),
            ended: ended.map(|time| time.to_string()),
            views,
            held,
            findings: result.findings,
            decision: result.decision,
            automatic: result.automatic,
            conflicts: result.conflicts,
        }
    }
}

impl From<InspectionRecord> for RecordHead {
    fn from(record: InspectionRecord) -> Self {
        let (generation, files) =
            record.files.map_or((None, Vec::new()), |files| (Some(files.generation), files.names));
        Self {
            software: record.software,
            labels: record.labels,
            voxel: record.voxel,
            points: record.points,
            generation,
            files: [vec!["inspection.json".to_owned()], files].concat(),
            run: record.run,
            components: record.components,
            defects: record.defects,
        }
    }
}

impl ListQuery {
    pub(super) fn filter(&self) -> Result<InspectionFilter, Problem> {
        let decision = |name: &str| {
            let reason = "is no decision: accept, rework, person or reject";
            Decision::from_name(name).ok_or_else(|| Problem::parameter("decision", name, reason))
        };
        let text = |text: &Option<String>| text.clone();
        Ok(InspectionFilter {
            state: parsed("state", self.state.as_deref())?,
            part: text(&self.part),
            decision: self.decision.as_deref().map(decision).transpose()?,
            in_conflict: parsed("conflict", self.conflict.as_deref())?.unwrap_or(false),
            component: text(&self.component),
            defect: text(&self.defect),
            from: parsed::<Timestamp>("from", self.from.as_deref())?,
            until: parsed::<Timestamp>("until", self.until.as_deref())?,
            before: parsed("cursor", self.cursor.as_deref())?,
            limit: limit(self.limit.as_deref(), PAGE.0, PAGE.1)?,
        })
    }
}

/// Past inspections and the one that runs, the latest first.
#[utoipa::path(
    get,
    path = "/api/v1/inspections",
    tag = "inspections",
    params(ListQuery),
    responses((status = 200, description = "A page", body = ref("#/components/schemas/InspectionList")))
)]
pub(super) async fn list(
    State(shared): State<Shared>,
    headers: HeaderMap,
    query: Result<Query<ListQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let mut filter = query.filter()?;
    let page = filter.limit as usize;
    // One more says whether there is a next page.
    filter.limit += 1;
    blocking(&shared, move |past| {
        let mut rows = past.catalogue.inspections(&filter)?;
        let next = (rows.len() > page).then(|| {
            rows.truncate(page);
            rows.last().map(|row| row.id.to_string())
        });
        let items = rows.into_iter().map(InspectionSummary::from).collect();
        answer::json(&headers, &InspectionList { items, next: next.flatten() })
    })
    .await
}

/// One inspection.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}",
    tag = "inspections",
    params(("inspection" = String, Path, description = "The inspection")),
    responses((status = 200, description = "The inspection", body = ref("#/components/schemas/InspectionDetail")))
)]
pub(super) async fn one(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    blocking(&shared, move |past| {
        let summary = past.row(id)?.into();
        let record = past.archive.record(id)?.map(RecordHead::from);
        answer::json(&headers, &InspectionDetail { summary, record })
    })
    .await
}
