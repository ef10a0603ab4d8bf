//! A server that tests talk to, and the requests that they send.

use semascan_model::InspectionId;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A server, ended when it is dropped.
pub(crate) struct Serving {
    pub(crate) child: Child,
    pub(crate) address: SocketAddr,
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A server of what is kept in `data`.
pub(crate) fn serve(data: &Path) -> Serving {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(["serve", "--port", "0", "--data", data.to_str().expect("UTF-8")]);
    serve_as(command)
}

/// The server that `command` starts.
pub(crate) fn serve_as(mut command: Command) -> Serving {
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("starts");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let address = lines.by_ref().map_while(Result::ok).find_map(|line| {
        let (_, address) = line.split_once("listening on http://")?;
        address.trim().parse().ok()
    });
    // What follows is read, so that the server does not wait for a reader.
    std::thread::spawn(move || lines.map_while(Result::ok).for_each(drop));
    Serving { child, address: address.expect("it says where it listens") }
}

#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) headers: BTreeMap<String, String>,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&self.body)))
    }

    /// The field that a problem names.
    pub(crate) fn field(&self) -> String {
        assert_eq!(self.headers["content-type"], "application/problem+json", "{self:?}");
        assert_eq!(self.json()["status"], self.status);
        self.json()["field"].as_str().unwrap_or_default().to_owned()
    }
}

impl Serving {
    pub(crate) fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        ask(self.address, method, path, headers, body).expect("an answer")
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[], &[])
    }

    pub(crate) fn review(&self, id: InspectionId, review: &Value) -> Answer {
        let path = format!("/api/v1/inspections/{id}/reviews");
        self.ask("POST", &path, &[("Content-Type", "application/json")], review.to_string().as_bytes())
    }
}

/// The answer to a request; an error where the server is gone or ends in the middle of it.
pub(crate) fn ask(
    address: SocketAddr,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> std::io::Result<Answer> {
    let mut stream = TcpStream::connect(address)?;
    let mut head = format!("{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n");
    headers.iter().for_each(|(name, value)| head.push_str(&format!("{name}: {value}\r\n")));
    if method == "POST" {
        head.push_str(&format!("Content-Length: {}\r\n", body.len()));
    }
    stream.write_all(format!("{head}\r\n").as_bytes())?;
    // A server that refuses what it has not read closes early.
    let _ = stream.write_all(body);
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes)?;
    let broken = || std::io::Error::from(std::io::ErrorKind::UnexpectedEof);
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").ok_or_else(broken)?;
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let mut lines = head.lines();
    let status = lines.next().and_then(|line| line.split(' ').nth(1)).and_then(|s| s.parse().ok());
    let headers = lines.filter_map(|line| line.split_once(": "));
    let headers: BTreeMap<_, _> = headers.map(|(name, value)| (name.to_lowercase(), value.to_owned())).collect();
    let body = &bytes[end + 4..];
    let in_pieces = headers.get("transfer-encoding").is_some_and(|value| value == "chunked");
    let body = if in_pieces { joined(body).ok_or_else(broken)? } else { body.to_vec() };
    Ok(Answer { status: status.ok_or_else(broken)?, headers, body })
}

/// A body that was sent in pieces (RFC 9112, section 7.1); `None` where its end is missing.
fn joined(mut rest: &[u8]) -> Option<Vec<u8>> {
    let mut body = Vec::new();
    loop {
        let line = rest.windows(2).position(|w| w == b"\r\n")?;
        let length = usize::from_str_radix(std::str::from_utf8(&rest[..line]).ok()?, 16).ok()?;
        if length == 0 {
            return Some(body);
        }
        body.extend_from_slice(rest.get(line + 2..line + 2 + length)?);
        rest = rest.get(line + 4 + length..)?;
    }
}

/// A review of its own name.
pub(crate) fn review(number: u64, subject: Value, seen: u64, action: Value) -> Value {
    json!({
        "id": format!("00000000-0000-4000-8000-{number:012x}"), "subject": subject, "seen": seen, "action": action,
        "person": "A. Reviewer", "reason": "can be ground"
    })
}
