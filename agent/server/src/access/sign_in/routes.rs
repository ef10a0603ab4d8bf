//! The routes of logins at an identity provider, and `GET /api/v1/login`, which says how one logs in here.

use super::super::login::{read, set_cookie};
use super::super::refusal;
use super::page::refused_page;
use super::{Brought, ProviderError, SignInDenied, SignedIn};
use crate::client_log::{Excerpt, Kind};
use crate::connections::Connection;
use crate::limits::seconds;
use crate::server::Shared;
use axum::Json;
use axum::extract::{Extension, Query, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::Arc;

/// How one logs in.
#[derive(Debug, Serialize)]
struct Ways<'a> {
    /// Whether users log in here.
    login: bool,
    /// The name of the identity provider; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    provider: Option<&'a str>,
}

/// What a page says to begin.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Begin {
    /// The path of this agent to go to afterwards.
    next: String,
}

/// Where the page sends its browser.
#[derive(Debug, Serialize)]
struct Begun {
    location: String,
}

/// `GET /api/v1/login`: how one logs in here.
pub(crate) async fn ways(State(shared): State<Shared>) -> Response {
    let provider = shared.entry.provider().map(|provider| provider.name.as_str());
    let ways = Ways { login: shared.entry.has_login(), provider };
    ([(header::CACHE_CONTROL, "no-store")], Json(ways)).into_response()
}

/// `POST /api/v1/oidc`: begins a login at the provider.
pub(crate) async fn begin(State(shared): State<Shared>, request: Request) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default().to_owned();
    let expected = "a login at the identity provider is begun with a JSON object with the text next";
    let Begin { next } = match read(request, seconds(shared.limits.request_s), expected).await {
        Ok(begin) => begin,
        Err(response) => return response,
    };
    match shared.entry.begin_sign_in(&host, &next).await {
        Ok((location, cookie)) => {
            ([(header::CACHE_CONTROL, "no-store")], set_cookie(&cookie), Json(Begun { location })).into_response()
        }
        Err(denied) => {
            let Said { status, text, .. } = say(&shared, &denied);
            refusal(status, &text)
        }
    }
}

/// `GET /api/v1/oidc/callback`: the browser comes back from the provider.
pub(crate) async fn callback(
    State(shared): State<Shared>,
    Extension(connection): Extension<Arc<Connection>>,
    Query(query): Query<HashMap<String, String>>,
    headers: HeaderMap,
) -> Response {
    let field = |name: &str| query.get(name).map_or("", String::as_str);
    let code = query.get("error").map_or_else(|| Ok(field("code")), |error| Err(error.as_str()));
    let brought = Brought { state: field("state"), code };
    let address = connection.address();
    let mut response = match shared.entry.finish_sign_in(address, &headers, brought).await {
        Ok(SignedIn { identity, cookie, next }) => {
            let (name, role) = (&identity.name, identity.role);
            shared.log.info(Kind::LoggedIn, || format!("{name} ({role}) logged in, from {address}"));
            let there = HeaderValue::from_str(&next).unwrap_or(HeaderValue::from_static("/"));
            let headers = [(header::LOCATION, there), (header::CACHE_CONTROL, HeaderValue::from_static("no-store"))];
            (StatusCode::SEE_OTHER, headers, set_cookie(&cookie)).into_response()
        }
        Err(SignInDenied::NoProvider) => return refusal(StatusCode::NOT_FOUND, NO_PROVIDER),
        Err(denied) => {
            let Said { status, heading, text } = say(&shared, &denied);
            refused_page(status, heading, &text)
        }
    };
    // Whatever came of it, it is over.
    if let Ok(cookie) = HeaderValue::from_str(&shared.entry.no_ticket()) {
        response.headers_mut().append(header::SET_COOKIE, cookie);
    }
    response
}

const NO_PROVIDER: &str = "nobody logs in at an identity provider here";

/// How a refusal is told to people: in a sentence of its own, without anything that a browser sent.
struct Said {
    status: StatusCode,
    heading: &'static str,
    text: String,
}

/// Says to the log why somebody cannot log in, and how people are told.
fn say(shared: &Shared, denied: &SignInDenied) -> Said {
    let name = shared.entry.provider().map_or("the identity provider", |provider| &provider.name);
    let refused =
        |reason: &str| shared.log.warn(Kind::LoginRefused, || format!("login at {name} refused: {}", Excerpt(reason)));
    match denied {
        SignInDenied::NoProvider => said(StatusCode::NOT_FOUND, "No such login", NO_PROVIDER),
        SignInDenied::Elsewhere { name, address } => {
            let text = format!("to log in with {name}, open {address}/login.html");
            said(StatusCode::MISDIRECTED_REQUEST, "Another address", text)
        }
        SignInDenied::NotBegun => {
            refused("it was not begun in this browser, or is over");
            let text =
                "This login was not begun in this browser, took too long or was used before. Please log in again.";
            said(StatusCode::BAD_REQUEST, "Please log in again", text)
        }
        SignInDenied::Declined(code) => {
            refused(&format!("it says {code}"));
            said(
                StatusCode::FORBIDDEN,
                "Not logged in",
                format!("{name} did not log you in. The agent's log says why."),
            )
        }
        SignInDenied::TooMany(wait) => {
            refused("too many attempts");
            let text = format!("Too many attempts: please try again in {} s.", wait.as_secs() + 1);
            said(StatusCode::TOO_MANY_REQUESTS, "Please wait", text)
        }
        SignInDenied::Busy => {
            refused("too many at once");
            let text = "Too many log in at once. Please try again.";
            said(StatusCode::SERVICE_UNAVAILABLE, "Please try again", text)
        }
        SignInDenied::Provider(ProviderError::Unavailable(reason)) => {
            shared.log.warn(Kind::ProviderFailed, || format!("{name} cannot be asked: {}", Excerpt(reason)));
            let text =
                format!("{name} cannot be asked now: the agent's log says why. Users with a password can log in.");
            said(StatusCode::SERVICE_UNAVAILABLE, "Not reached", text)
        }
        SignInDenied::Provider(ProviderError::Rejected(reason)) => {
            refused(reason);
            let text = format!("What {name} said about you could not be believed: the agent's log says why.");
            said(StatusCode::FORBIDDEN, "Not logged in", text)
        }
        SignInDenied::NoRole { name: person, groups } => {
            refused(&format!("no group of {person} has a role"));
            tracing::debug!("the groups of {person}: {}", Excerpt(&groups.join(", ")));
            let text = format!(
                "{name} knows you, but none of your groups may use this agent. Please ask who administers it for access."
            );
            said(StatusCode::FORBIDDEN, "No access", text)
        }
        SignInDenied::Removed(person) => {
            refused(&format!("{person} was removed"));
            let text = "Your access to this agent was taken away. Please ask who administers it.";
            said(StatusCode::FORBIDDEN, "No access", text)
        }
        SignInDenied::Unavailable(reason) => {
            tracing::error!("nobody can log in: {reason}");
            let text = "Nobody can log in now: the agent's log says why.";
            said(StatusCode::SERVICE_UNAVAILABLE, "Not logged in", text)
        }
    }
}

fn said(status: StatusCode, heading: &'static str, text: impl Into<String>) -> Said {
    Said { status, heading, text: text.into() }
}
