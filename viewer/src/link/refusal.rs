//! Why a connection is not made, in words that say what helps. A browser tells a page next to nothing about a failed
//! connection, so that pages cannot search a network; what is left is who was asked, and by whom.

use crate::words::t;

/// Host and port in the address of a stream (`ws://host:port/path`), as a browser would connect to: what stands before an
/// `@` is a user's name. `None` if there is none.
pub fn host_of(url: &str) -> Option<&str> {
    let rest = url.strip_prefix("ws://").or_else(|| url.strip_prefix("wss://"))?;
    let authority = rest.split(['/', '?', '#', '\\']).next().unwrap_or_default();
    let host = authority.rsplit('@').next().unwrap_or_default();
    (!host.is_empty() && !host.starts_with(':') && !host.contains(char::is_whitespace)).then_some(host)
}

/// The server of the page forbids it to connect to `url` (its Content Security Policy).
pub fn forbidden_by_own_server(url: &str) -> String {
    let host = host_of(url).unwrap_or(url);
    let scheme = if url.starts_with("wss:") { "wss" } else { "ws" };
    t!("link.forbidden_by_server", host, scheme)
}

/// The browser itself does not try to connect to `url`.
pub fn forbidden_by_browser(url: &str) -> String {
    let host = host_of(url).unwrap_or(url);
    t!("link.forbidden_by_browser", host)
}

/// A connection to `url` failed or broke without a word.
///
/// * `own_host` and `own_origin`: of the page.
pub fn not_reached(url: &str, own_host: &str, own_origin: &str) -> String {
    match host_of(url) {
        Some(host) if !host.eq_ignore_ascii_case(own_host) => t!("link.host_not_reached", host, own_origin),
        _ => t!("review.unreachable").to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_host_is_the_one_that_is_connected_to() {
        for (url, host) in [
            ("ws://10.0.0.7:8787/ws", Some("10.0.0.7:8787")),
            ("wss://cell.factory", Some("cell.factory")),
            ("ws://[::1]:8787/ws?x=1", Some("[::1]:8787")),
            ("ws://localhost:8787@evil.example/ws", Some("evil.example")),
            ("ws://evil.example\\@localhost/ws", Some("evil.example")),
            ("ws:///ws", None),
            ("ws://:80", None),
            ("http://a", None),
        ] {
            assert_eq!(host_of(url), host, "{url}");
        }
    }

    #[test]
    fn each_reason_names_the_host_and_what_helps() {
        let url = "wss://cell.factory:9/ws";
        assert!(forbidden_by_own_server(url).contains("--allow-agent wss://cell.factory:9 "));
        assert!(not_reached(url, "10.0.0.1:80", "http://10.0.0.1").contains("--allow-origin http://10.0.0.1 "));
        assert_eq!(not_reached(url, "cell.factory:9", "https://cell.factory:9"), "the agent cannot be reached");
        assert!(forbidden_by_browser(url).contains("cell.factory:9"));
    }
}
