//! Who may talk to the agent, and what its pages may do: the Host and the Origin of every request are checked, its sender's role
//! is compared with the one that the route needs, and every answer says what a browser may make of it.
//!
//! A web page from elsewhere must not open the stream (cross-site WebSocket hijacking), and a name that an attacker
//! points at this machine must not reach it (DNS rebinding). Loopback names, literal addresses and names that the
//! operator allowed pass as Host; an Origin, which every browser sends with a WebSocket, must be the Host itself or one
//! that the operator allowed. The pages of this agent connect to this agent, and to others that the operator named.

use super::access::routes::{self, Least, Ruling};
use super::access::{Denied, refusal};
use super::client_log::{Excerpt, Kind};
use super::connections::Connection;
use super::server::{Exposed, HTTPS_ONLY, ServeError, Shared};
use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Instant;

/// The header that a request which changes something carries, whatever its value.
const INTENDED: HeaderName = HeaderName::from_static("x-semascan-request");
const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");
/// Headers of every answer: it is what it says it is, names itself nowhere, is shown in frames of its own pages only, shares nothing
/// with pages from elsewhere, and asks the machine for nothing but the puck that moves the camera (`hid`).
const HEADERS: [(HeaderName, &str); 6] = [
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "SAMEORIGIN"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (
        HeaderName::from_static("permissions-policy"),
        "camera=(), microphone=(), geolocation=(), payment=(), usb=(), serial=(), hid=(self), bluetooth=(), midi=(), \
         display-capture=()",
    ),
];

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
             frame-ancestors 'self'",
            agents.join(" ")
        )
    }

    pub(super) fn is_own(&self, name: &str) -> bool {
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        bare.eq_ignore_ascii_case("localhost")
            || bare.parse::<IpAddr>().is_ok()
            || self.allowed_hosts.iter().any(|h| h.eq_ignore_ascii_case(name))
    }
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
pub(super) fn host_name(host: &str) -> &str {
    let after_bracket = host.rfind(']').map_or(0, |i| i + 1);
    host[after_bracket..].find(':').map_or(host, |i| &host[..after_bracket + i])
}

/// Whether a host is a name of a network: browsers keep what they are told to keep (HSTS) for these only, and what they kept for
/// `localhost` would hold for all servers of the machine.
fn is_name(host: &str) -> bool {
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    !bare.eq_ignore_ascii_case("localhost") && bare.parse::<IpAddr>().is_err()
}

/// Whether nobody but this machine reaches `host`.
pub(super) fn is_loopback(host: &str) -> bool {
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    bare.eq_ignore_ascii_case("localhost")
        || bare.parse::<IpAddr>().is_ok_and(|address| address.to_canonical().is_loopback())
}

/// Whether `text` is a host with or without a port: letters, digits and the marks of names and addresses.
pub(super) fn is_authority(text: &str) -> bool {
    let port = &text[host_name(text).len()..];
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '[' | ']');
    !host_name(text).is_empty()
        && text.chars().all(plain)
        && (port.is_empty() || port.strip_prefix(':').is_some_and(|digits| digits.parse::<u16>().is_ok()))
}

/// Middleware: refuses what [`AccessRule::check`] refuses, requests that their sender has no role for, and those that a page
/// from elsewhere may have caused; gives every answer the headers that bound what a browser makes of it.
pub(super) async fn guard(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let host = text(request.headers(), header::HOST).map(str::to_owned);
    let (mut response, is_own) = match shared.access.check(request.headers()) {
        Ok(()) => (ruled_and_closed(&shared, request, next).await, true),
        Err(reason) => {
            shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
            ((StatusCode::FORBIDDEN, reason).into_response(), false)
        }
    };
    shared.live.metrics().answered(response.status());
    // A Host that was not checked has no place in a header.
    let host = host.filter(|_| is_own);
    let policy =
        host.as_deref().and_then(|host| HeaderValue::from_str(&shared.access.content_security_policy(host)).ok());
    let policy = policy.unwrap_or(HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"));
    let headers = response.headers_mut();
    // A report brings a stricter one of its own.
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(policy);
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if shared.secure && host.is_some_and(|host| is_name(host_name(&host))) {
        headers.insert(header::STRICT_TRANSPORT_SECURITY, HeaderValue::from_static("max-age=31536000"));
    }
    response
}

/// As [`ruled`]. Content of a request that is refused may be unread, and what follows on the connection cannot be told from it:
/// the connection ends.
async fn ruled_and_closed(shared: &Shared, request: Request, next: Next) -> Response {
    let has_body = has_body(request.headers());
    let mut response = ruled(shared, request, next).await;
    if has_body && (response.status().is_client_error() || response.status().is_server_error()) {
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    response
}

/// Answers a request if the table of routes lets its sender make it.
async fn ruled(shared: &Shared, mut request: Request, next: Next) -> Response {
    let path = request.extensions().get::<MatchedPath>().map_or(routes::FILES, MatchedPath::as_str).to_owned();
    if let Some(connection) = request.extensions().get::<Arc<Connection>>()
        && let Err(wait) = shared.rate.admit(connection.address(), Instant::now())
    {
        let reason = "too many requests from this address";
        shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}, {}", connection.address()));
        let mut response = refusal(StatusCode::TOO_MANY_REQUESTS, reason);
        response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(wait.as_secs() + 1));
        return response;
    }
    // Health is asked for by programs of the machine that speak no TLS; nothing else is said in the open.
    if request.extensions().get::<Exposed>().is_some() && !routes::EXPOSED.contains(&path.as_str()) {
        return (StatusCode::BAD_REQUEST, [(header::CONNECTION, "close")], HTTPS_ONLY).into_response();
    }
    let least = match routes::ruling(request.method().as_str(), &path) {
        Ruling::Least(least) => least,
        Ruling::Methods(methods) => {
            let reason = format!("this agent answers {} only here", methods.join(" and "));
            let allowed = [(header::ALLOW, methods.join(", "))];
            // The API states problems in its own way, pages and files in words.
            return if path.starts_with("/api/") {
                (allowed, refusal(StatusCode::METHOD_NOT_ALLOWED, &reason)).into_response()
            } else {
                (StatusCode::METHOD_NOT_ALLOWED, allowed, reason).into_response()
            };
        }
        Ruling::Missing => {
            tracing::error!("{path}: no role is stated for this route, so that nobody may use it");
            return refusal(StatusCode::FORBIDDEN, "nobody may use this route");
        }
    };
    let is_safe = matches!(*request.method(), Method::GET | Method::HEAD);
    if is_safe && has_body(request.headers()) {
        return (StatusCode::PAYLOAD_TOO_LARGE, "this agent takes no content with such a request").into_response();
    }
    let identity = match least {
        Least::Public => None,
        Least::Role(role) => match shared.entry.identify(request.headers()).await {
            Ok(identity) if identity.role >= role => Some(identity),
            Ok(identity) => {
                let reason =
                    format!("{} has the role {}, and this needs the role {role}", identity.name, identity.role);
                shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
                return refusal(StatusCode::FORBIDDEN, &reason);
            }
            Err(denied) => return denied_answer(shared, &denied),
        },
    };
    // Public routes that change something begin a session, which a page from elsewhere must not do either.
    let by_itself = identity.as_ref().is_none_or(|identity| identity.credential.comes_by_itself());
    if !is_safe
        && by_itself
        && let Err(reason) = check_intended(shared.entry.has_login(), request.headers())
    {
        shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
        return refusal(StatusCode::FORBIDDEN, reason);
    }
    if let Some(identity) = identity {
        request.extensions_mut().insert(identity);
    }
    next.run(request).await
}

/// How a request without an identity is answered.
fn denied_answer(shared: &Shared, denied: &Denied) -> Response {
    match denied {
        Denied::Unknown(reason) => refusal(StatusCode::UNAUTHORIZED, reason),
        Denied::Forwarded => {
            let reason = "a proxy asks for others: start the agent with --login, so that they log in";
            shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
            refusal(StatusCode::FORBIDDEN, reason)
        }
        Denied::Unavailable(error) => {
            tracing::error!("nobody can be told from others: {error}");
            refusal(StatusCode::SERVICE_UNAVAILABLE, "it cannot be told now who asks: the agent's log says why")
        }
    }
}

/// Whether a request that changes something was meant by whose browser sent it (cross-site request forgery). A browser says
/// where such a request comes from (`Origin`, `Sec-Fetch-Site`): pages from elsewhere that may follow the stream may not make
/// it. And it lets no page from elsewhere set a header of its own, without which a session's cookie does not count.
fn check_intended(has_login: bool, headers: &HeaderMap) -> Result<(), &'static str> {
    let site = headers.get(SEC_FETCH_SITE).map(HeaderValue::as_bytes);
    let origin = text(headers, header::ORIGIN).and_then(|origin| origin.split_once("://"));
    let is_own = |authority: &str| text(headers, header::HOST).is_some_and(|host| host.eq_ignore_ascii_case(authority));
    if site.is_some_and(|site| site != b"same-origin" && site != b"none")
        || headers.contains_key(header::ORIGIN) && !origin.is_some_and(|(_, authority)| is_own(authority))
    {
        return Err("a page from elsewhere caused this request");
    }
    if has_login && !headers.contains_key(INTENDED) {
        return Err("the header x-semascan-request is missing, without which a cookie changes nothing");
    }
    Ok(())
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
    fn pages_connect_to_this_agent_and_to_those_that_were_allowed() {
        let policy = rule().content_security_policy("127.0.0.1:8787");
        let connect = policy.split("; ").find_map(|d| d.strip_prefix("connect-src ")).expect("a directive");
        assert_eq!(connect, "'self' ws://127.0.0.1:8787 wss://127.0.0.1:8787 ws://10.0.0.7:8787");
    }

    #[test]
    fn a_request_that_changes_something_was_meant_by_who_sent_it() {
        let check = |has_login: bool, given: &[(&'static str, &'static str)]| {
            let headers =
                given.iter().map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_static(value)));
            check_intended(has_login, &headers.collect())
        };
        assert!(check(false, &[]).is_ok(), "no browser");
        assert!(check(true, &[]).is_err());
        assert!(check(true, &[("x-semascan-request", "1"), ("sec-fetch-site", "same-origin")]).is_ok());
        let own = [("host", "cell:1"), ("origin", "https://cell:1")];
        assert!(check(false, &own).is_ok());
        assert!(check(false, &[own[0], ("origin", "https://cell:2")]).is_err(), "one that may follow the stream");
        assert!(check(false, &[own[0], ("origin", "null")]).is_err());
        for site in ["cross-site", "same-site", "nonsense"] {
            assert!(check(false, &[("sec-fetch-site", site)]).is_err(), "{site}");
            assert!(check(true, &[("sec-fetch-site", site), ("x-semascan-request", "1")]).is_err(), "{site}");
        }
        assert!(is_name("cell.factory") && !is_name("localhost") && !is_name("[::1]") && !is_name("10.0.0.7"));
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
