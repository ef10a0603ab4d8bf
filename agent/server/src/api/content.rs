//! What is sent with a request: JSON, read within its size and time, whose problems name the field that is wrong.

use super::super::limits::seconds;
use super::super::server::Shared;
use super::problem::Problem;
use axum::body::{Body, to_bytes};
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::DeserializeOwned;
use tokio::time::timeout;

/// The content of a request.
///
/// * `what`: what it is, for people.
/// * `most`: bytes that it may have.
pub(super) async fn content<T: DeserializeOwned>(
    shared: &Shared,
    headers: &HeaderMap,
    body: Body,
    what: &str,
    most: usize,
) -> Result<T, Problem> {
    let media_type = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let media_type = media_type.split(';').next().unwrap_or_default().trim();
    // What a form of another page can send is none: a browser asks before it sends JSON elsewhere.
    if !media_type.eq_ignore_ascii_case("application/json") {
        let reason = format!("{what} is sent with Content-Type: application/json");
        return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, reason));
    }
    match timeout(seconds(shared.limits.request_s), to_bytes(body, most)).await {
        Ok(Ok(bytes)) => parse(&bytes),
        Ok(Err(error)) if is_too_large(&error) => {
            Err(Problem::new(StatusCode::PAYLOAD_TOO_LARGE, format!("{what} has at most {most} bytes")))
        }
        Ok(Err(_)) => Err(Problem::new(StatusCode::BAD_REQUEST, "the content broke off")),
        Err(_) => {
            let reason = format!("the content did not come within {} s", shared.limits.request_s);
            Err(Problem::new(StatusCode::REQUEST_TIMEOUT, reason))
        }
    }
}

fn is_too_large(error: &axum::Error) -> bool {
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(error);
    while let Some(error) = cause {
        if error.is::<http_body_util::LengthLimitError>() {
            return true;
        }
        cause = error.source();
    }
    false
}

/// What `body` says; the problem names the field that is wrong.
pub(super) fn parse<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    let mut json = serde_json::Deserializer::from_slice(body);
    let content: T = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let path = error.path().to_string();
        let reason = error.into_inner().to_string();
        // A body that is no JSON at all is about no field.
        if path == "." {
            Problem::new(StatusCode::BAD_REQUEST, reason)
        } else {
            Problem::new(StatusCode::BAD_REQUEST, format!("{path}: {reason}")).about(path)
        }
    })?;
    json.end().map_err(|error| Problem::new(StatusCode::BAD_REQUEST, error.to_string()))?;
    Ok(content)
}
