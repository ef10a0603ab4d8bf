//! Who may talk to the agent: the Host and Origin of every request are checked.
//!
//! A web page from elsewhere must not open the stream (cross-site WebSocket hijacking), and a name that an attacker
//! points at this machine must not reach it (DNS rebinding). Loopback names, literal addresses and names that the
//! operator allowed pass as Host; an Origin, which every browser sends with a WebSocket, must be the Host itself.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::net::IpAddr;
use std::sync::Arc;

/// Which hosts count as this machine.
#[derive(Clone, Debug, Default)]
pub struct AccessRule {
    /// Host names, beyond loopback names and literal addresses, under which the agent may be reached.
    pub allowed_hosts: Vec<String>,
}

impl AccessRule {
    /// Whether a request with these headers may pass; the reason if not.
    pub fn check(&self, headers: &HeaderMap) -> Result<(), String> {
        let host = text(headers, header::HOST).ok_or("no Host header")?;
        if !self.is_own(host_name(host)) {
            return Err(format!("host {host} is not this machine; allow it with --allow-host"));
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
            _ => Err(format!("origin {origin} may not use this agent")),
        }
    }

    fn is_own(&self, name: &str) -> bool {
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        bare.eq_ignore_ascii_case("localhost")
            || bare.parse::<IpAddr>().is_ok()
            || self.allowed_hosts.iter().any(|h| h.eq_ignore_ascii_case(name))
    }
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

/// `host` without its port.
fn host_name(host: &str) -> &str {
    let after_bracket = host.rfind(']').map_or(0, |i| i + 1);
    host[after_bracket..].find(':').map_or(host, |i| &host[..after_bracket + i])
}

/// Middleware: refuses what [`AccessRule::check`] refuses.
pub(super) async fn guard(State(rule): State<Arc<AccessRule>>, request: Request, next: Next) -> Response {
    match rule.check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(reason) => {
            tracing::warn!(%reason, "request refused");
            (StatusCode::FORBIDDEN, reason).into_response()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn verdict(host: &'static str, origin: Option<&'static str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_static(host));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
        }
        AccessRule { allowed_hosts: vec!["cell.factory".into()] }.check(&headers).is_ok()
    }

    #[test]
    fn own_hosts_and_own_pages_pass() {
        assert!(verdict("127.0.0.1:8787", None));
        assert!(verdict("localhost:8787", Some("http://localhost:8787")));
        assert!(verdict("[::1]:8787", Some("http://[::1]:8787")));
        assert!(verdict("cell.factory", Some("https://cell.factory")));
    }

    #[test]
    fn foreign_pages_and_foreign_names_do_not() {
        assert!(!verdict("127.0.0.1:8787", Some("http://evil.example")));
        assert!(!verdict("127.0.0.1:8787", Some("http://127.0.0.1:9999")));
        assert!(!verdict("127.0.0.1:8787", Some("http://localhost:8787")));
        assert!(!verdict("127.0.0.1:8787", Some("null")));
        assert!(!verdict("evil.example:8787", Some("http://evil.example:8787")));
        assert!(AccessRule::default().check(&HeaderMap::new()).is_err());
    }
}
