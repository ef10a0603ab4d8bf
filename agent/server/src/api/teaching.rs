//! `/inspections/{inspection}/teaching`: where on the model a label would teach most, as `semascan dataset queue` orders it.

use super::super::server::Shared;
use super::answer;
use super::openapi::limits;
use super::problem::Problem;
use super::request::{blocking, inspection_id, limit};
use crate::past::Past;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::HeaderMap;
use axum::response::Response;
use schemars::JsonSchema;
use semascan_labelling::{
    Basis, NamedRegion, QueuedRegion, TeachingQueue, check_teachable, queue_convention, teaching_queue,
};
use semascan_model::InspectionId;
use semascan_model::finding::FindingId;
use serde::{Deserialize, Serialize};
use utoipa::IntoParams;

/// Regions where the client does not say it, and most.
const REGIONS: (u32, u32) = (10, 200);

/// How much of the queue is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct TeachingQuery {
    /// Most regions, 1 to 200.
    #[param(schema_with = limits)]
    limit: Option<String>,
}

/// Where a label would teach most.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct TeachingAnswer {
    /// How it is ordered.
    convention: String,
    /// Why nothing can be said; absent where something can.
    #[serde(skip_serializing_if = "Option::is_none")]
    nothing: Option<String>,
    /// Whole standard uncertainty times area over the surface that nobody labelled, square metres.
    worth: f64,
    /// Regions in all.
    count: usize,
    /// The first of them, the one that would teach most first.
    regions: Vec<Region>,
}

/// A region of the model.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Region {
    /// The finding that it is; absent for other surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    finding: Option<FindingId>,
    /// Component class as measured.
    component: u16,
    /// Its name.
    name: String,
    /// Its middle, metres, table frame.
    position: [f64; 3],
    /// Square metres.
    area: f64,
    /// Mean standard uncertainty of its labels, 0 to 1.
    sigma: f64,
    /// `model_part`: the part of it that is in the networks alone; `whole`: all of it, where that part is not known.
    basis: &'static str,
    /// Uncertainty times area, square metres: what the order is by.
    worth: f64,
}

impl From<NamedRegion> for Region {
    fn from(NamedRegion { name, region }: NamedRegion) -> Self {
        let QueuedRegion { finding, component, position, area, sigma, basis, worth } = region;
        let basis = match basis {
            Basis::ModelPart => "model_part",
            Basis::Whole => "whole",
        };
        Self { finding, component, name, position, area, sigma, basis, worth }
    }
}

/// Where a label would teach most; surface that a person labelled is not listed.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/teaching",
    tag = "reviews",
    params(("inspection" = String, Path, description = "The inspection"), TeachingQuery),
    responses((status = 200, description = "The queue", body = ref("#/components/schemas/TeachingAnswer")))
)]
pub(super) async fn teaching(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
    query: Result<Query<TeachingQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let most = limit(query.limit.as_deref(), REGIONS.0, REGIONS.1)?;
    blocking(&shared, move |past| answer::json(&headers, &queue(past, id, most as usize)?)).await
}

/// The first regions of the queue of an inspection.
fn queue(past: &Past, id: InspectionId, most: usize) -> Result<TeachingAnswer, Problem> {
    let nothing = |reason: String| TeachingAnswer {
        convention: queue_convention(),
        nothing: Some(reason),
        worth: 0.0,
        count: 0,
        regions: Vec::new(),
    };
    let record = past.record(id)?;
    if let Err(reason) = check_teachable(&record) {
        return Ok(nothing(reason.to_string()));
    }
    let Some((taxonomy, mesh)) = past.archive.mesh(id)? else { return Ok(nothing("it has no mesh".to_owned())) };
    let entries = past.desk.log().all_entries(id)?;
    Ok(match teaching_queue(&mesh, &taxonomy, &record, &entries) {
        Err(reason) => nothing(reason.to_string()),
        Ok(TeachingQueue { worth, regions }) => TeachingAnswer {
            convention: queue_convention(),
            nothing: None,
            worth,
            count: regions.len(),
            regions: regions.into_iter().take(most).map(Region::from).collect(),
        },
    })
}
