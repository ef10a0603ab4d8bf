//! How a request is refused: as the API states its problems, with the status and the reason in words.

use crate::api::Problem;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// Refuses a request with `status` because of `reason`.
pub(crate) fn refusal(status: StatusCode, reason: &str) -> Response {
    let mut response = Problem::new(status, reason).into_response();
    let headers = response.headers_mut();
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    if status == StatusCode::UNAUTHORIZED {
        headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer realm=\"semascan\""));
    }
    response
}
