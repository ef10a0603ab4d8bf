//! `/inspections/{inspection}/exports/{file}`: the files of an inspection, as they were written.

use super::super::server::Shared;
use super::answer;
use super::openapi::FILES;
use super::problem::Problem;
use super::request::{blocking, inspection_id};
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;

/// A file of an inspection: `inspection.json`, `cloud.ply`, `mesh.ply`, `scene.glb`, `report.html` as it was when the inspection
/// ended, and `truth.ply` where the source knew it.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/exports/{file}",
    tag = "exports",
    params(
        ("inspection" = String, Path, description = "The inspection"),
        ("file" = String, Path, description = "The file")
    ),
    responses((status = 200, description = "The file", content_type = "application/octet-stream", body = [u8]))
)]
pub(super) async fn file(
    State(shared): State<Shared>,
    Path((id, name)): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let Some((name, media_type)) = FILES.into_iter().find(|(known, _)| *known == name) else {
        let known: Vec<&str> = FILES.iter().map(|(name, _)| *name).collect();
        return Err(Problem::parameter("file", &name, format!("is none of {}", known.join(", "))));
    };
    let file = blocking(&shared, move |past| {
        past.row(id)?;
        let file = past.archive.file(id, name)?;
        file.ok_or_else(|| Problem::not_found(format!("inspection {id} has no {name}")))
    })
    .await?;
    Ok(answer::file(&headers, media_type, name, file))
}
