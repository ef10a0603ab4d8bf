//! One client's connection, from Hello to the end.

use super::live::{LiveModel, pack};
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use semascan_protocol::client_message::Body as FromClient;
use semascan_protocol::server_message::Body;
use semascan_protocol::{Hello, Refused, decode_client};
use std::time::Duration;

/// A client that has not said Hello by then is not one.
const HELLO_TIMEOUT: Duration = Duration::from_secs(10);

/// A quiet connection is pinged, so that a dead one is noticed by the operating system.
const PING: Duration = Duration::from_secs(20);

/// Serves one client until it leaves or misbehaves.
pub(super) async fn serve(socket: WebSocket, live: std::sync::Arc<LiveModel>) {
    let (mut to_client, mut from_client) = socket.split();
    let hello = match tokio::time::timeout(HELLO_TIMEOUT, read_hello(&mut from_client)).await {
        Ok(Ok(Some(hello))) => hello,
        Ok(Ok(None)) => return,
        Ok(Err(reason)) => return refuse(to_client, reason).await,
        Err(_) => return refuse(to_client, "no Hello within 10 s".into()).await,
    };
    tracing::info!(client = %hello.client, held = hello.held.len(), "viewer connected");
    // One side ends the other: writing stops when the client leaves, reading when it cannot be written to.
    let outcome = tokio::select! {
        () = write(&mut to_client, &live, &hello) => None,
        reason = read_rest(&mut from_client) => reason,
    };
    tracing::info!(client = %hello.client, "viewer left");
    if let Some(reason) = outcome {
        refuse(to_client, reason).await;
    }
}

/// The first message; `None` if the client left before it.
async fn read_hello(from_client: &mut SplitStream<WebSocket>) -> Result<Option<Hello>, String> {
    loop {
        match from_client.next().await {
            None | Some(Err(_)) | Some(Ok(Message::Close(_))) => return Ok(None),
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
            Some(Ok(Message::Text(_))) => return Err("text message; semascan.v1 is binary".into()),
            Some(Ok(Message::Binary(bytes))) => {
                return match decode_client(&bytes).map_err(|e| e.to_string())?.body {
                    Some(FromClient::Hello(hello)) => Ok(Some(hello)),
                    None => Err("message without a body".into()),
                };
            }
        }
    }
}

/// Listens for the end; the reason if the client has to be refused.
async fn read_rest(from_client: &mut SplitStream<WebSocket>) -> Option<String> {
    while let Some(message) = from_client.next().await {
        match message {
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(Message::Text(_)) => return Some("text message; semascan.v1 is binary".into()),
            Ok(Message::Binary(bytes)) => match decode_client(&bytes) {
                Ok(_) => return Some("a second Hello".into()),
                Err(error) => return Some(error.to_string()),
            },
        }
    }
    None
}

async fn write(to_client: &mut SplitSink<WebSocket, Message>, live: &LiveModel, hello: &Hello) {
    let mut changes = live.changes();
    let (mut cursor, welcome) = live.welcome(&hello.inspection_id, hello.epoch, &hello.held);
    if to_client.send(Message::Binary(welcome)).await.is_err() {
        return;
    }
    loop {
        changes.mark_unchanged();
        while let Some(message) = live.next(&mut cursor) {
            // Waits until the socket takes it: a slow client holds nothing but its place in the order.
            if to_client.send(Message::Binary(message)).await.is_err() {
                return;
            }
        }
        match tokio::time::timeout(PING, changes.changed()).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return,
            Err(_) => {
                if to_client.send(Message::Ping(Vec::new().into())).await.is_err() {
                    return;
                }
            }
        }
    }
}

/// Says why, then closes.
async fn refuse(mut to_client: SplitSink<WebSocket, Message>, reason: String) {
    tracing::warn!(%reason, "viewer refused");
    let message = pack(Body::Refused(Refused { reason: reason.clone() }));
    let _ = to_client.send(Message::Binary(message)).await;
    // A close reason holds 123 bytes at most.
    let short: String = reason.chars().take(100).filter(char::is_ascii).collect();
    let close = CloseFrame { code: close_code::POLICY, reason: short.into() };
    let _ = to_client.send(Message::Close(Some(close))).await;
}
