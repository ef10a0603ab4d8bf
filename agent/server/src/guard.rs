//! Who may talk to the agent, and what its pages may do: the Host, the Origin and the method of every request are checked,
//! and every answer says what a browser may make of it. The only content that is taken is that of the API's commands, from this
//! agent's own pages and from programs.
//!
//! A web page from elsewhere must not open the stream (cross-site WebSocket hijacking), and a name that an attacker
//! points at this machine must not reach it (DNS rebinding). Loopback names, literal addresses and names that the
//! operator allowed pass as Host; an Origin, which every browser sends with a WebSocket, must be the Host itself or one
//! that the operator allowed. The pages of this agent connect to this agent, and to others that the operator named.

use super::api::{self, route_of};
use super::client_log::{Excerpt, Kind};
use super::server::{ServeError, Shared};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::net::IpAddr;

/// Which hosts count as this machine.
#[derive(Clone, Debug, Default)]
pub struct AccessRule {
    /// Host names, beyond loopback names and literal addresses, under which the agent may be reached.
    pub allowed_hosts: Vec<String>,
    /// Origins of pages elsewhere that may follow this agent, as `http://host:port`.
    pub allowed_origins: Vec<String>,
    /// Other agents that this agent's pages may follow, as `ws://host:port`.
    pub allowed_agents: Vec<String>,
}

impl AccessRule {
    /// Whether a request with these headers may pass; the reason if not.
    pub fn check(&self, headers: &HeaderMap) -> Result<(), String> {
        let host = text(headers, header::HOST).ok_or("no Host header")?;
        if !self.is_own(host_name(host)) || !is_authority(host) {
            return Err(format!("host {} is not this machine; allow it with --allow-host", Excerpt(host)));
        }
        if headers.get_all(header::ORIGIN).iter().count() > 1 {
            return Err("more than one Origin header".into());
        }
        if !headers.contains_key(header::ORIGIN) {
            return Ok(());
        }
        let origin = text(headers, header::ORIGIN).ok_or("Origin is not text")?;
        let authority = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        match authority {
            Some(a) if a.eq_ignore_ascii_case(host) => Ok(()),
            _ if self.allowed_origins.iter().any(|allowed| allowed.eq_ignore_ascii_case(origin)) => Ok(()),
            _ => Err(format!("origin {} may not use this agent; allow it with --allow-origin", Excerpt(origin))),
        }
    }

    /// Whether what the operator allowed are origins.
    ///
    /// # Errors
    /// [`ServeError::Origin`] that names the first that is none.
    pub(super) fn check_origins(&self) -> Result<(), ServeError> {
        let is_origin = |text: &str, schemes: [&str; 2]| {
            schemes.iter().any(|scheme| text.strip_prefix(scheme).is_some_and(is_authority))
        };
        if let Some(origin) = self.allowed_origins.iter().find(|o| !is_origin(o, ["http://", "https://"])) {
            let reason = "the origin of a page is http://HOST[:PORT] or https://HOST[:PORT], without a path";
            return Err(ServeError::Origin { origin: origin.clone(), reason });
        }
        if let Some(origin) = self.allowed_agents.iter().find(|o| !is_origin(o, ["ws://", "wss://"])) {
            let reason = "another agent is ws://HOST[:PORT] or wss://HOST[:PORT], without a path";
            return Err(ServeError::Origin { origin: origin.clone(), reason });
        }
        Ok(())
    }

    /// What a page that was asked for as `host` may load and connect to: scripts of this origin, WebAssembly, sockets to this
    /// host (named for Safari, which does not count them to `'self'`) and to the agents that the operator allowed.
    fn content_security_policy(&self, host: &str) -> String {
        let own = [format!("ws://{host}"), format!("wss://{host}")];
        let agents: Vec<&str> = own.iter().chain(&self.allowed_agents).map(String::as_str).collect();
        format!(
            "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self' {}; img-src 'self' blob: data:; \
             style-src 'self'; worker-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; \
             frame-ancestors 'none'",
            agents.join(" ")
        )
    }

    fn is_own(&self, name: &str) -> bool {
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        bare.eq_ignore_ascii_case("localhost")
            || bare.parse::<IpAddr>().is_ok()
            || self.allowed_hosts.iter().any(|h| h.eq_ignore_ascii_case(name))
    }
}

/// The methods that change nothing.
const GET_AND_HEAD: &str = "GET, HEAD";

/// Whether a request that changes something comes from a page of this agent, or from no page at all. An origin that may follow
/// the agent may not decide for its users.
fn check_own_page(headers: &HeaderMap) -> Result<(), String> {
    let own = headers.get(header::HOST);
    if let Some(origin) = headers.get(header::ORIGIN) {
        let authority = origin
            .to_str()
            .ok()
            .and_then(|origin| origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://")));
        let is_own = authority.zip(own).is_some_and(|(a, host)| a.as_bytes().eq_ignore_ascii_case(host.as_bytes()));
        if !is_own {
            return Err("a page from elsewhere may look and not decide".into());
        }
    }
    match headers.get("sec-fetch-site").map(HeaderValue::as_bytes) {
        None | Some(b"same-origin" | b"none") => Ok(()),
        Some(_) => Err("a page from elsewhere may look and not decide".into()),
    }
}

/// The answer to a request with content, which may be unread where it is refused: nothing follows it on the connection.
fn closing_where_refused(mut response: Response) -> Response {
    if response.status().is_client_error() || response.status().is_server_error() {
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    response
}

/// Whether content is announced with a request.
fn has_body(headers: &HeaderMap) -> bool {
    headers.contains_key(header::TRANSFER_ENCODING)
        || headers.get_all(header::CONTENT_LENGTH).iter().any(|length| length.as_bytes() != b"0")
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

/// `host` without its port.
fn host_name(host: &str) -> &str {
    let after_bracket = host.rfind(']').map_or(0, |i| i + 1);
    host[after_bracket..].find(':').map_or(host, |i| &host[..after_bracket + i])
}

/// Whether `text` is a host with or without a port: letters, digits and the marks of names and addresses.
fn is_authority(text: &str) -> bool {
    let port = &text[host_name(text).len()..];
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '[' | ']');
    !host_name(text).is_empty()
        && text.chars().all(plain)
        && (port.is_empty() || port.strip_prefix(':').is_some_and(|digits| digits.parse::<u16>().is_ok()))
}

/// Middleware: refuses methods that change something, requests with content, and what [`AccessRule::check`] refuses; gives
/// every answer the headers that bound what a browser makes of it.
pub(super) async fn guard(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let host = text(request.headers(), header::HOST).map(str::to_owned);
    let mut response = match (request.method(), shared.access.check(request.headers())) {
        (_, Err(reason)) => {
            shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
            (StatusCode::FORBIDDEN, reason).into_response()
        }
        (&Method::GET | &Method::HEAD, Ok(())) if has_body(request.headers()) => {
            // It is not read: what follows it on the connection cannot be told from it.
            let close = [(header::CONNECTION, "close")];
            (StatusCode::PAYLOAD_TOO_LARGE, close, "this agent takes no content with a request").into_response()
        }
        (&Method::GET | &Method::HEAD, Ok(())) => next.run(request).await,
        (&Method::POST, Ok(())) if route_of("POST", request.uri().path()).is_some() => {
            match check_own_page(request.headers()) {
                // It ends with an answer that leaves content unread, where there is such.
                Ok(()) => closing_where_refused(next.run(request).await),
                Err(reason) => {
                    shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
                    closing_where_refused(api::refusal(StatusCode::FORBIDDEN, reason))
                }
            }
        }
        (_, Ok(())) if request.uri().path().starts_with(api::PREFIX) => {
            let allow = [GET_AND_HEAD, "POST"].into_iter().zip(["GET", "POST"]);
            let path = request.uri().path();
            let allow: Vec<&str> =
                allow.filter(|(_, method)| route_of(method, path).is_some()).map(|(said, _)| said).collect();
            let reason = format!("{} is not answered here", Excerpt(request.method().as_str()));
            let mut response = api::refusal(StatusCode::METHOD_NOT_ALLOWED, reason);
            if let Ok(allow) = HeaderValue::from_str(&allow.join(", ")) {
                response.headers_mut().insert(header::ALLOW, allow);
            }
            closing_where_refused(response)
        }
        (_, Ok(())) => {
            let allowed = [(header::ALLOW, GET_AND_HEAD)];
            (StatusCode::METHOD_NOT_ALLOWED, allowed, "this agent answers GET and HEAD only").into_response()
        }
    };
    // A Host that was not checked has no place in a header.
    let host = host.filter(|_| response.status() != StatusCode::FORBIDDEN);
    let policy = host.and_then(|host| HeaderValue::from_str(&shared.access.content_security_policy(&host)).ok());
    let policy = policy.unwrap_or(HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"));
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(host: &'static str, origin: Option<&'static str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_static(host));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
        }
        rule().check(&headers).is_ok()
    }

    fn rule() -> AccessRule {
        AccessRule {
            allowed_hosts: vec!["cell.factory".into()],
            allowed_origins: vec!["https://office.factory:8443".into()],
            allowed_agents: vec!["ws://10.0.0.7:8787".into()],
        }
    }

    #[test]
    fn own_hosts_and_own_pages_pass() {
        assert!(verdict("127.0.0.1:8787", None));
        assert!(verdict("localhost:8787", Some("http://localhost:8787")));
        assert!(verdict("[::1]:8787", Some("http://[::1]:8787")));
        assert!(verdict("cell.factory", Some("https://cell.factory")));
        assert!(verdict("cell.factory", Some("https://office.factory:8443")));
    }

    #[test]
    fn foreign_pages_and_foreign_names_do_not() {
        assert!(!verdict("127.0.0.1:8787", Some("http://evil.example")));
        assert!(!verdict("127.0.0.1:8787", Some("http://127.0.0.1:9999")));
        assert!(!verdict("127.0.0.1:8787", Some("http://localhost:8787")));
        assert!(!verdict("127.0.0.1:8787", Some("null")));
        assert!(!verdict("evil.example:8787", Some("http://evil.example:8787")));
        assert!(!verdict("cell.factory", Some("https://office.factory")));
        assert!(!verdict("localhost:8787; script-src *", None));
        assert!(!verdict("localhost:99999", None));
        assert!(AccessRule::default().check(&HeaderMap::new()).is_err());
    }

    #[test]
    fn only_own_pages_and_programs_decide() {
        let of = |origin: Option<&'static str>, site: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static("cell.factory:8787"));
            origin.map(|origin| headers.insert(header::ORIGIN, HeaderValue::from_static(origin)));
            site.map(|site| headers.insert("sec-fetch-site", HeaderValue::from_static(site)));
            check_own_page(&headers).is_ok()
        };
        assert!(of(None, None) && of(Some("http://cell.factory:8787"), Some("same-origin")));
        assert!(!of(Some("https://office.factory:8443"), None), "it may follow, and not decide");
        assert!(!of(None, Some("cross-site")) && !of(None, Some("same-site")) && !of(Some("null"), None));
    }

    #[test]
    fn pages_connect_to_this_agent_and_to_those_that_were_allowed() {
        let policy = rule().content_security_policy("127.0.0.1:8787");
        let connect = policy.split("; ").find_map(|d| d.strip_prefix("connect-src ")).expect("a directive");
        assert_eq!(connect, "'self' ws://127.0.0.1:8787 wss://127.0.0.1:8787 ws://10.0.0.7:8787");
    }

    #[test]
    fn what_is_allowed_must_be_an_origin() {
        assert!(rule().check_origins().is_ok());
        for wrong in ["office", "http://", "http://a/b", "http://a;b", "*", "ws://a", "http://a:x"] {
            let origins = AccessRule { allowed_origins: vec![wrong.into()], ..AccessRule::default() };
            assert!(origins.check_origins().is_err_and(|e| e.to_string().starts_with(wrong)), "{wrong}");
        }
        let agents = AccessRule { allowed_agents: vec!["http://a".into()], ..AccessRule::default() };
        assert!(agents.check_origins().is_err());
    }
}
