//! `/inspections/{inspection}/pointers`: where somebody points on the surface, told to all who look at the same inspection. Nothing of
//! it is kept, and so nothing is changed by it: who may look may point.

use super::super::access::{Credential, Identity};
use super::super::server::Shared;
use super::content::content;
use super::problem::Problem;
use super::request::inspection_id;
use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use semascan_protocol::Pointer;
use serde::{Deserialize, Serialize};

/// Bytes that one may have.
const LARGEST: usize = 1 << 10;
/// Letters of a viewer's name, and of a person's.
const NAME: usize = 64;
const PERSON: usize = 100;

/// Where somebody points.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Pointing {
    /// The name that the page made for itself: a later place takes that of the one before.
    #[schemars(length(min = 1, max = 64))]
    viewer: String,
    /// Who points, as others are told; of somebody who has logged in their own name is told.
    #[serde(default)]
    #[schemars(length(max = 100))]
    person: String,
    /// Metres, table frame. Read as doubles: a number that is no single one is then refused here with its field, and not by the
    /// reader of JSON, which tells such numbers apart in some builds only.
    position: [f64; 3],
}

/// Who was told.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct PointingTold {
    /// Viewers of the inspection beside the one who points.
    others: u32,
}

/// Tells others where somebody points.
#[utoipa::path(
    post,
    path = "/api/v1/inspections/{inspection}/pointers",
    tag = "inspections",
    params(("inspection" = String, Path, description = "The inspection")),
    request_body(content = ref("#/components/schemas/Pointing"), content_type = "application/json"),
    responses((status = 200, description = "They were told", body = ref("#/components/schemas/PointingTold")))
)]
pub(super) async fn point(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    Extension(identity): Extension<Identity>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let Pointing { viewer, person, position } = content(&shared, &headers, body, "a pointer", LARGEST).await?;
    let wrong = |field: &str, reason: &str| {
        Problem::new(StatusCode::UNPROCESSABLE_ENTITY, format!("{field} {reason}")).about(field)
    };
    if viewer.is_empty() || viewer.chars().count() > NAME {
        return Err(wrong("viewer", "has 1 to 64 letters"));
    }
    if person.chars().count() > PERSON {
        return Err(wrong("person", "has at most 100 letters"));
    }
    let [x, y, z] = position.map(|coordinate| coordinate as f32);
    if ![x, y, z].iter().all(|coordinate| coordinate.is_finite()) {
        return Err(wrong("position", "is no place"));
    }
    // Where nobody logs in, people say who they are.
    let person = if identity.credential == Credential::Reach { person } else { identity.name };
    let told = shared.tell_pointer(&id.to_string(), &Pointer { viewer, person, x, y, z });
    let no_store = [(header::CACHE_CONTROL, HeaderValue::from_static("no-store"))];
    Ok((no_store, axum::Json(PointingTold { others: told.saturating_sub(1) })).into_response())
}
