//! `/inspections/{inspection}/measurements`: what people measured on the model and keep.

use super::super::server::Shared;
use super::answer;
use super::problem::Problem;
use super::request::{blocking, inspection_id};
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use schemars::JsonSchema;
use semascan_model::measurement::KeptMeasurement;
use semascan_model::review::ReviewedState;
use serde::Serialize;

/// The measurements of an inspection.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct MeasurementsAnswer {
    /// Those that nobody has withdrawn, in the order in which they were taken in.
    items: Vec<KeptMeasurement>,
    /// The last review of this inspection that is taken into account; 0 where there is none.
    sequence: u64,
}

/// What people measured.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/measurements",
    tag = "measurements",
    params(("inspection" = String, Path, description = "The inspection")),
    responses((status = 200, description = "The measurements", body = ref("#/components/schemas/MeasurementsAnswer")))
)]
pub(super) async fn list(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    blocking(&shared, move |past| {
        let (_, ReviewedState { measurements: items, sequence, .. }) = past.reviewed(id)?;
        answer::json(&headers, &MeasurementsAnswer { items, sequence })
    })
    .await
}
