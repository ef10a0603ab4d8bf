//! `/inspections/{inspection}/captures`: asks the running inspection for a view of what its camera sees now.

use super::super::live::CaptureAnswer;
use super::super::server::Shared;
use super::content::content;
use super::problem::Problem;
use super::request::inspection_id;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bytes that a request may have.
const LARGEST: usize = 1 << 10;
/// Letters of an identifier.
const ID: usize = 64;

/// A request for a view.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Capture {
    /// Made by who asks, a UUID for example: the same request sent again asks for nothing more.
    #[schemars(length(min = 1, max = 64))]
    id: String,
}

/// A request that was taken in.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct CaptureTaken {
    /// Requests that no view has answered yet. The view comes with the inspection's events.
    waiting: usize,
}

/// Asks for a view. It is the next pair of pictures that comes after the request, whatever rule the source has besides.
#[utoipa::path(
    post,
    path = "/api/v1/inspections/{inspection}/captures",
    tag = "inspections",
    params(("inspection" = String, Path, description = "The inspection that runs")),
    request_body(content = ref("#/components/schemas/Capture"), content_type = "application/json"),
    responses((status = 202, description = "It was taken in", body = ref("#/components/schemas/CaptureTaken")))
)]
pub(super) async fn capture(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let inspection = inspection_id(&id)?;
    let Capture { id } = content(&shared, &headers, body, "a request for a view", LARGEST).await?;
    if id.is_empty() || id.chars().count() > ID {
        return Err(Problem::new(StatusCode::UNPROCESSABLE_ENTITY, "id has 1 to 64 letters").about("id"));
    }
    let conflict = |reason: &str| Err(Problem::new(StatusCode::CONFLICT, reason));
    match shared.live.ask_for_capture(&inspection.to_string(), &id) {
        CaptureAnswer::Taken { waiting } => {
            let no_store = [(header::CACHE_CONTROL, HeaderValue::from_static("no-store"))];
            Ok((StatusCode::ACCEPTED, no_store, axum::Json(CaptureTaken { waiting })).into_response())
        }
        CaptureAnswer::NotRunning => conflict("this inspection does not run"),
        CaptureAnswer::NotAsked => conflict("its source gives views when it does, and cannot be asked for one"),
        CaptureAnswer::TooMany => conflict("so many views were asked for that no more requests are taken in"),
    }
}
