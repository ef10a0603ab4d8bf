//! Logging in with a password, logging out, and who one is.
//!
//! What a client sends here is never written anywhere: not the password, and not the name of a user whom nobody knows, because
//! people type their password there, too.

use super::{Identity, LoginDenied, refusal};
use crate::client_log::Kind;
use crate::connections::Connection;
use crate::limits::seconds;
use crate::server::Shared;
use axum::body::{Body, to_bytes};
use axum::extract::{Extension, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Json, http};
use semascan_model::Role;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::timeout;

/// Bytes that a login may have.
const LARGEST: usize = 4 << 10;

/// What a client says to log in.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Login {
    name: String,
    password: String,
}

/// Who a client is.
#[derive(Debug, Serialize)]
struct Me<'a> {
    name: &'a str,
    role: Role,
    /// `none`, `session` or `token`.
    credential: &'static str,
    /// Whether users log in here.
    login: bool,
    /// Whether inspections are kept here, and can be listed.
    keeps: bool,
}

/// `POST /api/v1/login`: begins a session.
pub(crate) async fn log_in(
    State(shared): State<Shared>,
    Extension(connection): Extension<Arc<Connection>>,
    request: Request,
) -> Response {
    let address = connection.address();
    let refused = |reason: &str| {
        shared.log.warn(Kind::LoginRefused, || format!("login refused, from {address}: {reason}"));
    };
    let expected = "a login is a JSON object with the texts name and password";
    let Login { name, password } = match read(request, seconds(shared.limits.request_s), expected).await {
        Ok(login) => login,
        Err(response) => return response,
    };
    match shared.entry.log_in(address, &name, password).await {
        Ok((identity, cookie)) => {
            let Identity { name, role, .. } = &identity;
            shared.log.info(Kind::LoggedIn, || format!("{name} ({role}) logged in, from {address}"));
            (set_cookie(&cookie), me_of(&shared, &identity)).into_response()
        }
        Err(LoginDenied::Wrong) => {
            refused("name or password is wrong");
            refusal(StatusCode::UNAUTHORIZED, "name or password is wrong")
        }
        Err(LoginDenied::TooMany(wait)) => {
            refused("too many attempts");
            let text = format!("too many attempts: try again in {} s", wait.as_secs() + 1);
            let mut response = refusal(StatusCode::TOO_MANY_REQUESTS, &text);
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(wait.as_secs() + 1));
            response
        }
        Err(LoginDenied::Busy) => {
            refused("too many at once");
            let mut response = refusal(StatusCode::SERVICE_UNAVAILABLE, "too many log in at once: try again");
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
            response
        }
        Err(LoginDenied::NoLogin) => refusal(StatusCode::NOT_FOUND, "this agent asks nobody to log in"),
        Err(LoginDenied::Unavailable(reason)) => {
            tracing::error!("nobody can log in: {reason}");
            refusal(StatusCode::SERVICE_UNAVAILABLE, "nobody can log in now: the agent's log says why")
        }
    }
}

/// Reads what a client says to log in, which is `expected`, or says what is wrong with it without repeating any of it.
pub(super) async fn read<T: DeserializeOwned>(
    request: Request,
    patience: Duration,
    expected: &str,
) -> Result<T, Response> {
    let kind = request.headers().get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    if !kind.split(';').next().is_some_and(|kind| kind.trim().eq_ignore_ascii_case("application/json")) {
        return Err(refusal(StatusCode::UNSUPPORTED_MEDIA_TYPE, "a login is application/json"));
    }
    let Ok(body) = timeout(patience, to_bytes(request.into_body(), LARGEST)).await else {
        return Err(refusal(StatusCode::REQUEST_TIMEOUT, "the request did not arrive in time"));
    };
    let Ok(body) = body else {
        return Err(refusal(StatusCode::PAYLOAD_TOO_LARGE, "a login has 4096 bytes at most"));
    };
    serde_json::from_slice(&body).map_err(|_| refusal(StatusCode::BAD_REQUEST, expected))
}

/// `POST /api/v1/logout`: ends the session.
pub(crate) async fn log_out(
    State(shared): State<Shared>,
    Extension(connection): Extension<Arc<Connection>>,
    Extension(identity): Extension<Identity>,
) -> Response {
    match shared.entry.log_out(&identity, connection.address()).await {
        Ok(cookie) => {
            shared.log.info(Kind::LoggedIn, || format!("{} logged out", identity.name));
            (StatusCode::NO_CONTENT, set_cookie(&cookie), Body::empty()).into_response()
        }
        Err(denied) => {
            tracing::error!("a session could not be ended: {denied:?}");
            refusal(StatusCode::SERVICE_UNAVAILABLE, "the session could not be ended: the agent's log says why")
        }
    }
}

/// `GET /api/v1/me`: who asks.
pub(crate) async fn me(State(shared): State<Shared>, Extension(identity): Extension<Identity>) -> Response {
    me_of(&shared, &identity)
}

fn me_of(shared: &Shared, identity: &Identity) -> Response {
    let me = Me {
        name: &identity.name,
        role: identity.role,
        credential: identity.credential.name(),
        login: shared.entry.has_login(),
        keeps: shared.past.is_some(),
    };
    ([(header::CACHE_CONTROL, "no-store")], Json(me)).into_response()
}

/// The header that sets `cookie`.
pub(super) fn set_cookie(cookie: &str) -> http::HeaderMap {
    HeaderValue::from_str(cookie).map(|value| (header::SET_COOKIE, value)).into_iter().collect()
}
