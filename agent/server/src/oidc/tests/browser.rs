//! A browser as far as logins go: requests over sockets, cookies that it keeps, and what a page of the agent sends along.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

const PATIENCE: Duration = Duration::from_secs(20);

/// An answer.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) status: u16,
    pub(super) headers: Vec<(String, String)>,
    pub(super) body: String,
}

impl Reply {
    pub(super) fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(given, _)| given == name).map_or("", |(_, value)| value)
    }

    pub(super) fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.body).expect("JSON")
    }

    /// What the cookies are set to whose name ends with `suffix`.
    pub(super) fn cookie(&self, suffix: &str) -> Option<&str> {
        let set = self.headers.iter().filter(|(name, _)| name == "set-cookie");
        set.map(|(_, value)| value.as_str())
            .find(|value| value.split_once('=').is_some_and(|(name, _)| name.ends_with(suffix)))
    }
}

/// Asks `address` for `url`, of which the scheme and host are left out; `headers` follow its own.
pub(super) async fn exchange(
    address: SocketAddr,
    method: &str,
    url: &str,
    headers: &[(&str, &str)],
    body: &str,
) -> Reply {
    let path = match url.split_once("://") {
        Some((_, rest)) => rest.find('/').map_or("/", |at| &rest[at..]),
        None => url,
    };
    let mut request = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
    let host = ("host", address.to_string());
    let host = (!headers.iter().any(|(name, _)| *name == "host")).then_some(host);
    for (name, value) in host.iter().map(|(name, value)| (*name, value.as_str())).chain(headers.iter().copied()) {
        request.push_str(&format!("{name}: {value}\r\n"));
    }
    request.push_str("\r\n");
    request.push_str(body);
    let mut stream = TcpStream::connect(address).await.expect("connects");
    stream.write_all(request.as_bytes()).await.expect("sends");
    let mut bytes = Vec::new();
    timeout(PATIENCE, stream.read_to_end(&mut bytes)).await.expect("an answer in time").expect("an answer");
    let text = String::from_utf8(bytes).expect("text");
    let (head, body) = text.split_once("\r\n\r\n").expect("a head");
    let mut lines = head.lines();
    let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok()).expect("a status");
    let headers =
        lines.filter_map(|line| line.split_once(": ")).map(|(name, value)| (name.to_lowercase(), value.to_owned()));
    Reply { status, headers: headers.collect(), body: body.to_owned() }
}

/// A browser that is used with an agent.
#[derive(Clone, Debug)]
pub(super) struct Browser {
    pub(super) agent: SocketAddr,
    /// The host under which it knows the agent.
    pub(super) host: String,
    pub(super) cookies: BTreeMap<String, String>,
}

impl Browser {
    pub(super) fn new(agent: SocketAddr, host: &str) -> Self {
        Self { agent, host: host.to_owned(), cookies: BTreeMap::new() }
    }

    /// Asks the agent, and keeps the cookies that it sets.
    pub(super) async fn ask(&mut self, method: &str, url: &str, headers: &[(&str, &str)], body: &str) -> Reply {
        let pairs: Vec<String> = self.cookies.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let cookies = pairs.join("; ");
        let own = [("host", self.host.as_str()), ("cookie", cookies.as_str())];
        let headers: Vec<(&str, &str)> = own.into_iter().chain(headers.iter().copied()).collect();
        let reply = exchange(self.agent, method, url, &headers, body).await;
        for (_, value) in reply.headers.iter().filter(|(name, _)| name == "set-cookie") {
            let (pair, attributes) = value.split_once(';').expect("attributes");
            let (name, value) = pair.split_once('=').expect("a pair");
            if attributes.contains("Max-Age=0;") {
                self.cookies.remove(name);
            } else {
                self.cookies.insert(name.to_owned(), value.to_owned());
            }
        }
        reply
    }

    pub(super) async fn get(&mut self, url: &str) -> Reply {
        self.ask("GET", url, &[], "").await
    }

    /// What the login page sends.
    pub(super) async fn post(&mut self, path: &str, body: serde_json::Value) -> Reply {
        let headers = [("content-type", "application/json"), ("x-semascan-request", "1")];
        self.ask("POST", path, &headers, &body.to_string()).await
    }

    /// Begins a login at the provider that is to lead to `next`.
    pub(super) async fn begin(&mut self, next: &str) -> Reply {
        self.post("/api/v1/oidc", serde_json::json!({ "next": next })).await
    }

    /// Who it is logged in as, and the role; nobody where it is not.
    pub(super) async fn who(&mut self) -> Option<(String, String)> {
        let me = self.get("/api/v1/me").await;
        let text = |name: &str| me.json()[name].as_str().unwrap_or_default().to_owned();
        (me.status == 200).then(|| (text("name"), text("role")))
    }
}
