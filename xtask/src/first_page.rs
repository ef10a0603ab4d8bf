//! The page that is shown at the demo's address while the demo is built: what is being done, and the viewer as soon as the
//! agent is there.

use anyhow::{Context, Result};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

const PAGE: &str = include_str!("first_page.html");
/// Time that a browser has to ask and to take the answer; it is answered one connection after the other.
const PATIENCE: Duration = Duration::from_millis(500);
/// Most bytes of a request that are read.
const LONGEST_REQUEST: u64 = 16 << 10;
/// How often it is looked whether somebody connects, or the page is to end.
const PAUSE: Duration = Duration::from_millis(20);

/// A server of the first page, until it is ended.
pub(crate) struct FirstPage {
    step: Arc<Mutex<String>>,
    ended: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl FirstPage {
    /// Serves the page at `address`.
    pub(crate) fn begin(address: SocketAddr) -> Result<Self> {
        let listener = TcpListener::bind(address).with_context(|| format!("cannot listen on {address}"))?;
        listener.set_nonblocking(true)?;
        let (step, ended) = (Arc::new(Mutex::new(String::new())), Arc::new(AtomicBool::new(false)));
        let (step_of_page, end) = (Arc::clone(&step), Arc::clone(&ended));
        let thread = thread::spawn(move || {
            while !end.load(Ordering::Relaxed) {
                match listener.accept() {
                    Ok((connection, _)) => {
                        let step = step_of_page.lock().unwrap_or_else(PoisonError::into_inner).clone();
                        // Who does not ask, or goes away, gets no answer.
                        let _ = answer(connection, &step);
                    }
                    Err(_) => thread::sleep(PAUSE),
                }
            }
        });
        Ok(Self { step, ended, thread })
    }

    /// Says what is being done.
    pub(crate) fn say(&self, step: &str) {
        *self.step.lock().unwrap_or_else(PoisonError::into_inner) = step.to_owned();
    }

    /// Frees the address.
    pub(crate) fn end(self) {
        self.ended.store(true, Ordering::Relaxed);
        // Its thread has nothing that could be lost.
        let _ = self.thread.join();
    }
}

/// Answers one request: 503 with the step at `/healthz`, so that nobody takes this for the agent, else the page.
fn answer(connection: TcpStream, step: &str) -> io::Result<()> {
    connection.set_nonblocking(false)?;
    connection.set_read_timeout(Some(PATIENCE))?;
    connection.set_write_timeout(Some(PATIENCE))?;
    let mut lines = BufReader::new((&connection).take(LONGEST_REQUEST)).lines();
    let request = lines.next().transpose()?.unwrap_or_default();
    // The rest of the head is read too: closing with unread bytes would reset the connection.
    for line in lines {
        if line?.is_empty() {
            break;
        }
    }
    let (status, kind, body) = match request.split(' ').nth(1) {
        Some("/healthz") => ("503 Service Unavailable", "text/plain", step),
        Some("/") => ("200 OK", "text/html", PAGE),
        _ => ("404 Not Found", "text/plain", "not found\n"),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    );
    (&connection).write_all(&[head.as_bytes(), body.as_bytes()].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get(address: SocketAddr, path: &str) -> String {
        let mut connection = TcpStream::connect(address).expect("listens");
        write!(connection, "GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n").expect("asks");
        let mut answer = String::new();
        connection.read_to_string(&mut answer).expect("is answered");
        answer
    }

    #[test]
    fn the_page_is_there_at_once_says_the_step_and_frees_its_address() {
        let probe = TcpListener::bind(("127.0.0.1", 0)).expect("a free port");
        let address = probe.local_addr().expect("its address");
        assert!(FirstPage::begin(address).is_err(), "the address is taken");
        drop(probe);
        let page = FirstPage::begin(address).expect("free now");
        page.say("building the agent");
        // A connection that says nothing costs the others half a second at most.
        let mute = TcpStream::connect(address).expect("listens");
        let shown = get(address, "/");
        assert!(shown.starts_with("HTTP/1.1 200") && shown.contains("Semascan starts"), "{shown}");
        let health = get(address, "/healthz");
        assert!(health.starts_with("HTTP/1.1 503") && health.ends_with("building the agent"), "{health}");
        drop(mute);
        page.end();
        TcpListener::bind(address).expect("the agent can listen there");
    }
}
