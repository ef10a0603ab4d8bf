//! `/inspections/{inspection}/report`: the report with everything that people have decided until now. The file of the set
//! (`exports/report.html`) stays what it was when the inspection ended.

use super::super::server::Shared;
use super::answer;
use super::problem::Problem;
use super::request::{blocking, inspection_id};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::Response;

/// What a browser may load for it: the pictures and styles that are in it.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; frame-ancestors 'none'";

/// The report of an inspection, made anew.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/report",
    tag = "exports",
    params(("inspection" = String, Path, description = "The inspection")),
    responses((status = 200, description = "The report", content_type = "text/html", body = String))
)]
pub(super) async fn report(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let html = blocking(&shared, move |past| {
        past.row(id)?;
        let html = past.reports.html(id)?;
        html.ok_or_else(|| Problem::not_found(format!("inspection {id} has no record yet")))
    })
    .await?;
    let mut response = answer::bytes(&headers, "text/html; charset=utf-8", html.into_bytes());
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    Ok(response)
}
