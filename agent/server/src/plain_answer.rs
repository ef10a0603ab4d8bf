//! Answers of a connection to what is no request: written whole, because the HTTP library has none or a bare one for these.
//!
//! They carry the headers of every other answer (RFC 9110, section 15: a reason in words; `nosniff`, so that no browser takes
//! it for anything but text), and the connection ends after them.

use axum::http::StatusCode;
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

/// How long a client that still sends is listened to, so that the answer reaches it.
const LINGER: Duration = Duration::from_secs(1);
/// Bytes of a status line that are looked at, and that the library's own bare answers have at most.
const BARE_ANSWER: usize = 256;

/// The last answer on a connection, as it is written.
pub(super) fn plain_answer(status: StatusCode, reason: &str) -> String {
    format!(
        "HTTP/1.1 {status}\r\nconnection: close\r\ncontent-type: text/plain; charset=utf-8\r\n\
         x-content-type-options: nosniff\r\nreferrer-policy: no-referrer\r\n\
         content-security-policy: default-src 'none'; frame-ancestors 'none'\r\ncontent-length: {}\r\n\r\n{reason}",
        reason.len()
    )
}

/// What is said to a client whose request cannot be read.
pub(super) fn reason_of(status: StatusCode) -> &'static str {
    match status {
        StatusCode::REQUEST_TIMEOUT => "the request did not arrive in time",
        StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE => "the head of the request is too large",
        StatusCode::URI_TOO_LONG => "the address in the request is too long",
        _ => "this is no HTTP/1.1 request",
    }
}

/// The status of an answer that the HTTP library made by itself, without the headers of this server: `written` is the whole
/// of it, a head without a body.
pub(super) fn bare_status(written: &[u8]) -> Option<StatusCode> {
    if written.len() > BARE_ANSWER || !written.ends_with(b"\r\n\r\n") {
        return None;
    }
    let head = std::str::from_utf8(written).ok()?;
    let status = head.strip_prefix("HTTP/1.1 ").or_else(|| head.strip_prefix("HTTP/1.0 "))?.get(..3)?;
    let status = StatusCode::from_bytes(status.as_bytes()).ok()?;
    (status.is_client_error() && !head.contains("x-content-type-options")).then_some(status)
}

/// Says `answer` and closes so that it arrives: a connection that is closed while something in it is unread is reset, and what
/// was sent last is lost.
pub(super) async fn say_and_close(mut stream: impl AsyncRead + AsyncWrite + Unpin, answer: &str) {
    let closing = async {
        stream.write_all(answer.as_bytes()).await?;
        stream.shutdown().await?;
        let mut unread = [0; 4096];
        while stream.read(&mut unread).await? > 0 {}
        io::Result::Ok(())
    };
    // A client that goes or sends on and on has had its chance.
    let _ = timeout(LINGER, closing).await;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_bare_answers_of_the_library_are_told_apart() {
        let bare = b"HTTP/1.1 400 Bad Request\r\nconnection: close\r\ncontent-length: 0\r\n\r\n";
        assert_eq!(bare_status(bare), Some(StatusCode::BAD_REQUEST));
        assert_eq!(bare_status(&bare[..bare.len() - 1]), None, "not whole");
        assert_eq!(bare_status(b"HTTP/1.1 200 OK\r\n\r\n"), None, "no refusal");
        assert_eq!(bare_status(plain_answer(StatusCode::BAD_REQUEST, "").as_bytes()), None, "our own");
        assert_eq!(bare_status(&[0x88, 0x02, 0x03, 0xe9]), None, "a frame of a WebSocket");
    }

    #[test]
    fn an_answer_says_how_long_it_is() {
        let answer = plain_answer(StatusCode::SERVICE_UNAVAILABLE, "voll: ü");
        assert!(answer.starts_with("HTTP/1.1 503 Service Unavailable\r\n"), "{answer}");
        assert!(answer.contains("content-length: 8\r\n") && answer.ends_with("\r\n\r\nvoll: ü"), "{answer}");
    }
}
