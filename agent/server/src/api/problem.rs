//! Errors of the API: `application/problem+json` (RFC 9457) that names the field at fault.

use super::super::client_log::Excerpt;
use axum::extract::rejection::QueryRejection;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use semascan_inspection::ports::{Obstacle, PortError};
use serde::Serialize;

const MEDIA_TYPE: &str = "application/problem+json";

/// Why a request was not answered as it was meant.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct Problem {
    /// Names the kind of problem; `about:blank` where the status says all.
    #[serde(rename = "type")]
    kind: &'static str,
    /// The status in words.
    title: String,
    /// The HTTP status.
    status: u16,
    /// What is wrong, for people.
    detail: String,
    /// The field or parameter at fault, as a path; absent where it is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    field: Option<String>,
}

impl Problem {
    pub(crate) fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        let title = status.canonical_reason().unwrap_or("error").to_owned();
        Self { kind: "about:blank", title, status: status.as_u16(), detail: detail.into(), field: None }
    }

    /// The same about `field`.
    pub(super) fn about(self, field: impl Into<String>) -> Self {
        Self { field: Some(field.into()), ..self }
    }

    /// A parameter that cannot be used.
    pub(super) fn parameter(name: &str, given: &str, reason: impl std::fmt::Display) -> Self {
        Self::new(StatusCode::BAD_REQUEST, format!("{name}: {} {reason}", Excerpt(given))).about(name)
    }

    /// Parameters that cannot be read at all: an unknown name, a value twice.
    pub(super) fn of_query(rejection: &QueryRejection) -> Self {
        Self::new(StatusCode::BAD_REQUEST, Excerpt(&rejection.body_text()).to_string())
    }

    /// Whether there is nothing of what was asked for.
    pub(super) fn is_missing(&self) -> bool {
        self.status == StatusCode::NOT_FOUND.as_u16()
    }

    pub(super) fn not_found(what: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, what)
    }

    /// What is kept could not be read or written. The log has the file's path; a client learns the reason, and may send the
    /// same again later.
    pub(super) fn unavailable(error: &PortError) -> Self {
        tracing::error!("{error}");
        let (status, what) = match error.obstacle {
            Some(Obstacle::Space) => (StatusCode::INSUFFICIENT_STORAGE, "nothing more can be kept"),
            Some(Obstacle::ReadOnly) => (StatusCode::SERVICE_UNAVAILABLE, "what is kept cannot be changed"),
            _ => (StatusCode::SERVICE_UNAVAILABLE, "what is kept cannot be used"),
        };
        Self::new(status, format!("{what}: {}", error.reason))
    }
}

impl From<PortError> for Problem {
    fn from(error: PortError) -> Self {
        Self::unavailable(&error)
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        // What is plain data always serialises.
        let body = serde_json::to_vec(&self).unwrap_or_default();
        let mut response = (status, body).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
        if matches!(status, StatusCode::SERVICE_UNAVAILABLE | StatusCode::INSUFFICIENT_STORAGE) {
            headers.insert(header::RETRY_AFTER, HeaderValue::from_static("5"));
        }
        response
    }
}
