//! One client's connection, from Hello to the end.
//!
//! Nothing is allocated for a client before its Hello was read and found good, and of the Hello only what is still the newest
//! is kept. A client has to take what it is sent and to answer pings in time; one that does not is told so and closed.

use super::access::{Denied, Identity, routes};
use super::client_log::{ClientLog, Excerpt, Kind};
use super::connections::Connection;
use super::limits::{Limits, seconds};
use super::live::{LiveModel, pack};
use super::server::Shared;
use axum::body::Bytes;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use semascan_protocol::client_message::Body as FromClient;
use semascan_protocol::server_message::Body;
use semascan_protocol::{Hello, Refused, ViewRequest, decode_client};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::time::{Instant, timeout};

/// Time in which a client may take the reason why it is closed.
const FAREWELL: Duration = Duration::from_secs(5);
/// Requests that a client may have open.
const REQUESTS: usize = 4;
/// Bytes that the reason of a Close frame may have.
const CLOSE_REASON: usize = 123;

type ToClient = SplitSink<WebSocket, Message>;
type FromSocket = SplitStream<WebSocket>;

/// Why a connection is ended from this side.
#[derive(Debug)]
pub(super) struct Farewell {
    code: u16,
    reason: String,
}

impl Farewell {
    /// The client broke the protocol.
    pub(super) fn policy(reason: impl Into<String>) -> Self {
        Self { code: close_code::POLICY, reason: reason.into() }
    }

    /// The agent ends, and the client with it unless another one begins.
    pub(super) fn away() -> Self {
        Self { code: close_code::AWAY, reason: "the agent ends".into() }
    }

    /// The client may try again.
    pub(super) fn again(reason: impl Into<String>) -> Self {
        Self { code: close_code::AGAIN, reason: reason.into() }
    }

    /// The Close frame that says it.
    pub(super) fn frame(&self) -> CloseFrame {
        CloseFrame { code: self.code, reason: close_reason(&self.reason) }
    }
}

/// Serves one client until it leaves or misbehaves, its login ends, or the server ends.
pub(super) async fn serve(socket: WebSocket, shared: Shared, connection: Arc<Connection>, identity: Identity) {
    let (mut to_client, mut from_client) = socket.split();
    let farewell = tokio::select! {
        farewell = follow(&mut to_client, &mut from_client, &shared, &connection, &identity) => farewell,
        farewell = login_ends(&shared, &identity) => Some(farewell),
        () = shared.connections.ending() => Some(Farewell::away()),
    };
    if let Some(farewell) = farewell {
        say_farewell(to_client, from_client, farewell, &shared.log).await;
    }
}

/// Completes when `identity` may not follow the stream any more. An open stream keeps its session from being idle.
pub(super) async fn login_ends(shared: &Shared, identity: &Identity) -> Farewell {
    loop {
        tokio::time::sleep(seconds(shared.limits.ping_s)).await;
        match shared.entry.still(identity).await {
            // Whoever could be let in may not be thrown out because the disk fails.
            Err(Denied::Unavailable(error)) => tracing::warn!("it cannot be told whether a login still holds: {error}"),
            Err(_) => return Farewell::policy("the login has ended: log in again"),
            Ok(_) => {}
        }
    }
}

/// The message in `bytes`, if it is one that `identity` may send.
fn message_of(identity: &Identity, bytes: &[u8]) -> Result<FromClient, Farewell> {
    let message = decode_client(bytes).map_err(|error| Farewell::policy(error.to_string()))?;
    let body = message.body.ok_or_else(|| Farewell::policy("message without a body"))?;
    let least = routes::role_of_message(&body);
    if identity.role >= least { Ok(body) } else { Err(Farewell::policy(format!("this needs the role {least}"))) }
}

/// Follows the stream with one client; why it has to be closed, if it does not leave by itself.
async fn follow(
    to_client: &mut ToClient,
    from_client: &mut FromSocket,
    shared: &Shared,
    connection: &Connection,
    identity: &Identity,
) -> Option<Farewell> {
    let Shared { live, limits, log, connections, .. } = shared;
    if !connections.greet(connection) {
        return Some(Farewell::again("too many clients arrive at once"));
    }
    let hello = match timeout(seconds(limits.hello_s), read_hello(from_client, identity)).await {
        Ok(Ok(Some(hello))) => hello,
        Ok(Ok(None)) => return None,
        Ok(Err(farewell)) => return Some(farewell),
        Err(_) => return Some(Farewell::policy(format!("no Hello within {} s", limits.hello_s))),
    };
    connection.views();
    let name = Excerpt(&hello.client).to_string();
    log.info(Kind::Connected, || format!("viewer connected: {name}, holds {} chunks", hello.held.len()));
    let heard = Heard::now();
    let (requests, mut requested) = mpsc::channel(REQUESTS);
    // One side ends the other: writing stops when the client leaves, reading when it cannot be written to.
    let farewell = tokio::select! {
        farewell = write(to_client, live, limits, hello, &heard, &mut requested) => farewell,
        farewell = read_rest(from_client, identity, &heard, &requests) => farewell,
    };
    log.info(Kind::Left, || format!("viewer left: {name}"));
    farewell
}

/// When something of the client came last.
#[derive(Debug)]
struct Heard {
    began: Instant,
    milliseconds: AtomicU64,
}

impl Heard {
    fn now() -> Self {
        Self { began: Instant::now(), milliseconds: AtomicU64::new(0) }
    }

    fn note(&self) {
        // Rounded up: what came after a ping must not seem to have come before it.
        self.milliseconds.store(self.began.elapsed().as_millis() as u64 + 1, Ordering::Relaxed);
    }

    fn last(&self) -> Instant {
        self.began + Duration::from_millis(self.milliseconds.load(Ordering::Relaxed))
    }
}

/// The first message; `None` if the client left before it.
async fn read_hello(from_client: &mut FromSocket, identity: &Identity) -> Result<Option<Hello>, Farewell> {
    loop {
        match from_client.next().await {
            None | Some(Ok(Message::Close(_))) => return Ok(None),
            Some(Err(error)) => return Err(Farewell::policy(error.to_string())),
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
            Some(Ok(Message::Text(_))) => return Err(Farewell::policy("text message; semascan.v1 is binary")),
            Some(Ok(Message::Binary(bytes))) => {
                return match message_of(identity, &bytes)? {
                    FromClient::Hello(hello) => Ok(Some(hello)),
                    FromClient::Views(_) => Err(Farewell::policy("a request before the Hello")),
                };
            }
        }
    }
}

/// Listens until the end; why the client has to be closed, if it does not leave by itself.
async fn read_rest(
    from_client: &mut FromSocket,
    identity: &Identity,
    heard: &Heard,
    requests: &mpsc::Sender<ViewRequest>,
) -> Option<Farewell> {
    while let Some(message) = from_client.next().await {
        heard.note();
        match message {
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(Message::Close(_)) => return None,
            Err(error) => return Some(Farewell::policy(error.to_string())),
            Ok(Message::Text(_)) => return Some(Farewell::policy("text message; semascan.v1 is binary")),
            Ok(Message::Binary(bytes)) => match message_of(identity, &bytes) {
                Ok(FromClient::Views(request)) => {
                    if requests.try_send(request).is_err() {
                        return Some(Farewell::policy("too many requests at once"));
                    }
                }
                Ok(FromClient::Hello(_)) => return Some(Farewell::policy("a second Hello")),
                Err(farewell) => return Some(farewell),
            },
        }
    }
    None
}

/// Sends what the client is due; why it has to be closed, if the connection does not break.
async fn write(
    to_client: &mut ToClient,
    live: &LiveModel,
    limits: &Limits,
    hello: Hello,
    heard: &Heard,
    requested: &mut mpsc::Receiver<ViewRequest>,
) -> Option<Farewell> {
    let mut changes = live.changes();
    let (mut cursor, welcome) = live.welcome(&hello);
    let _attends = live.attend(&cursor);
    // A long list need not stay as long as the client does.
    drop(hello);
    let (ping, pong) = (seconds(limits.ping_s), seconds(limits.pong_s));
    // When the last ping was sent, while its answer is not due yet; when there is something to do about pings.
    let (mut pinged, mut due) = (None, Instant::now() + ping);
    if let Err(end) = send(to_client, welcome, limits).await {
        return end;
    }
    loop {
        changes.mark_unchanged();
        while let Some(message) = live.next(&mut cursor) {
            // Waits until the socket takes it: a slow client holds nothing but its place in the order.
            if let Err(end) = send(to_client, message, limits).await {
                return end;
            }
        }
        tokio::select! {
            changed = changes.changed() => {
                if changed.is_err() {
                    return Some(Farewell::again("the agent ends"));
                }
            }
            Some(request) = requested.recv() => {
                let (page, reports) = live.page(&request);
                for message in [page].into_iter().chain(reports) {
                    if let Err(end) = send(to_client, message, limits).await {
                        return end;
                    }
                }
            }
            () = tokio::time::sleep_until(due) => {
                if let Some(sent) = pinged.take() {
                    if heard.last() < sent {
                        return Some(Farewell::again(format!("no answer to a ping within {} s", limits.pong_s)));
                    }
                    due = sent + ping;
                } else {
                    let sent = Instant::now();
                    if let Err(end) = send_message(to_client, Message::Ping(Bytes::new()), limits).await {
                        return end;
                    }
                    (pinged, due) = (Some(sent), sent + pong);
                }
            }
        }
    }
}

/// Sends a message of the stream.
async fn send(to_client: &mut ToClient, message: Bytes, limits: &Limits) -> Result<(), Option<Farewell>> {
    send_message(to_client, Message::Binary(message), limits).await
}

/// Waits until the socket has taken `message`; how the connection ends if it does not.
async fn send_message(to_client: &mut ToClient, message: Message, limits: &Limits) -> Result<(), Option<Farewell>> {
    match timeout(seconds(limits.slow_s), to_client.send(message)).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) => Err(None),
        Err(_) => Err(Some(Farewell::again(format!("too slow: a message was not taken within {} s", limits.slow_s)))),
    }
}

/// Says why, then closes and waits for the answer to that: a connection that is closed while something in it is unread is reset,
/// and the reason lost. A client that does not take and answer it in time is cut off.
async fn say_farewell(mut to_client: ToClient, mut from_client: FromSocket, farewell: Farewell, log: &ClientLog) {
    let close = Message::Close(Some(farewell.frame()));
    let Farewell { code, reason } = farewell;
    match code {
        // Every viewer is told, and the agent has said itself that it ends.
        close_code::AWAY => tracing::debug!("viewer closed: {reason}"),
        _ => log.warn(Kind::ViewerRefused, || format!("viewer closed: {}", Excerpt(&reason))),
    }
    let refused = (code == close_code::POLICY).then(|| pack(Body::Refused(Refused { reason })));
    let _ = timeout(FAREWELL, async {
        if let Some(refused) = refused {
            to_client.send(Message::Binary(refused)).await?;
        }
        to_client.send(close).await?;
        while let Some(Ok(_)) = from_client.next().await {}
        Ok::<(), axum::Error>(())
    })
    .await;
}

/// As much of `reason` as a Close frame takes.
fn close_reason(reason: &str) -> Utf8Bytes {
    let end = (0..=reason.len().min(CLOSE_REASON)).rev().find(|end| reason.is_char_boundary(*end));
    reason[..end.unwrap_or(0)].into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_close_reason_fits_its_frame_and_stays_text() {
        assert_eq!(close_reason("short").as_str(), "short");
        let long = "ü".repeat(100);
        assert_eq!(close_reason(&long).len(), CLOSE_REASON - 1);
    }
}
