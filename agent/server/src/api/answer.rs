//! Answers with an entity tag (RFC 9110, section 8.8): who has the same content already is told so and sent nothing.

use super::problem::Problem;
use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use semascan_inspection::ports::ArchivedFile;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::io::Read;

/// Bytes of a file that are read and sent at once.
const PIECE: usize = 64 << 10;

/// `value` as JSON.
pub(super) fn json(headers: &HeaderMap, value: &impl Serialize) -> Result<Response, Problem> {
    let body = serde_json::to_vec(value)
        .map_err(|error| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()))?;
    Ok(bytes(headers, "application/json", body))
}

/// `body`, whose tag is its digest.
pub(super) fn bytes(headers: &HeaderMap, media_type: &'static str, body: Vec<u8>) -> Response {
    let tag = tag(&hex(&Sha256::digest(&body)));
    if has(headers, &tag) {
        return unchanged(&tag);
    }
    with_tag(&tag, media_type, Body::from(body))
}

/// The content of `file`, piece by piece as the client takes it. Without a noted digest it has no tag.
pub(super) fn file(headers: &HeaderMap, media_type: &'static str, name: &str, file: ArchivedFile) -> Response {
    let tag = file.sha256.as_deref().map(tag);
    if let Some(tag) = tag.as_ref().filter(|tag| has(headers, tag)) {
        return unchanged(tag);
    }
    let bytes = file.bytes;
    let pieces = futures_util::stream::unfold(Some(file.content), |content| async move {
        let mut content = content?;
        let read = tokio::task::spawn_blocking(move || {
            let mut piece = vec![0; PIECE];
            let read = content.read(&mut piece);
            (content, read.map(|count| piece[..count].to_vec()))
        });
        match read.await {
            Ok((_, Ok(piece))) if piece.is_empty() => None,
            Ok((content, Ok(piece))) => Some((Ok(piece), Some(content))),
            Ok((_, Err(error))) => Some((Err(error), None)),
            Err(error) => Some((Err(std::io::Error::other(error)), None)),
        }
    });
    let body = Body::from_stream(pieces);
    let mut response = match &tag {
        Some(tag) => with_tag(tag, media_type, body),
        None => with_type(media_type, body),
    };
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_LENGTH, HeaderValue::from(bytes));
    if let Ok(disposition) = HeaderValue::from_str(&format!("attachment; filename=\"{name}\"")) {
        headers.insert(header::CONTENT_DISPOSITION, disposition);
    }
    response
}

fn hex(digest: &[u8]) -> String {
    digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

fn tag(digest: &str) -> String {
    format!("\"{digest}\"")
}

/// Whether the client names `tag` among those that it has.
fn has(headers: &HeaderMap, tag: &str) -> bool {
    headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok()).any(|value| {
        let mut tags = value.split(',').map(str::trim);
        tags.any(|own| own == "*" || own.strip_prefix("W/").unwrap_or(own) == tag)
    })
}

fn unchanged(tag: &str) -> Response {
    let mut response = StatusCode::NOT_MODIFIED.into_response();
    mark(&mut response, tag);
    response
}

fn with_tag(tag: &str, media_type: &'static str, body: Body) -> Response {
    let mut response = with_type(media_type, body);
    mark(&mut response, tag);
    response
}

fn with_type(media_type: &'static str, body: Body) -> Response {
    let mut response = Response::new(body);
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    // Kept by nobody but who asked, and asked for again each time.
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"));
    response
}

fn mark(response: &mut Response, tag: &str) {
    if let Ok(tag) = HeaderValue::from_str(tag) {
        response.headers_mut().insert(header::ETAG, tag);
    }
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_has_the_content_is_sent_nothing() {
        let first = bytes(&HeaderMap::new(), "text/plain", b"content".to_vec());
        let tag = first.headers()[header::ETAG].clone();
        for (named, status) in [
            (tag.to_str().expect("text").to_owned(), StatusCode::NOT_MODIFIED),
            (format!("\"x\", W/{}", tag.to_str().expect("text")), StatusCode::NOT_MODIFIED),
            ("*".to_owned(), StatusCode::NOT_MODIFIED),
            ("\"x\"".to_owned(), StatusCode::OK),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::IF_NONE_MATCH, HeaderValue::from_str(&named).expect("a value"));
            let answer = bytes(&headers, "text/plain", b"content".to_vec());
            assert_eq!((answer.status(), &answer.headers()[header::ETAG]), (status, &tag), "{named}");
        }
    }
}
