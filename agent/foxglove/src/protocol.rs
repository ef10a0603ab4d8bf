//! The WebSocket protocol of Foxglove, server's side: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>. Texts are
//! JSON with the key `op`, frames begin with a byte that says what they are. A client may only subscribe: nothing else is offered.

use crate::topic::{TOPICS, Topic};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;
use serde_json::json;

/// The subprotocols that are spoken, the preferred one first: that of Foxglove's SDK, and that of before, with the same messages.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// Subscriptions that a client may have.
pub const MOST_SUBSCRIPTIONS: usize = 64;

/// First byte of a frame that carries a message.
const MESSAGE_DATA: u8 = 1;

/// What a client asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// To be sent what is published, by the numbers of its subscriptions and the topics.
    Subscribe(Vec<(u32, Topic)>),
    /// No more of these subscriptions.
    Unsubscribe(Vec<u32>),
    /// Something that was not offered, by its name.
    Other(String),
}

/// A text that is none of the protocol.
#[derive(Debug, thiserror::Error)]
#[error("no message of Foxglove's protocol: {0}")]
pub struct ProtocolError(String);

impl ProtocolError {
    pub(crate) fn new(reason: impl Into<String>) -> Self {
        Self(reason.into())
    }
}

/// The first text: who speaks, and of which inspection.
pub fn server_info(agent: &str, session: &str) -> String {
    json!({ "op": "serverInfo", "name": agent, "capabilities": [], "metadata": {}, "sessionId": session }).to_string()
}

/// The topics that there are.
pub fn advertisement() -> String {
    let channels: Vec<_> = TOPICS
        .into_iter()
        .map(|topic| {
            json!({
                "id": topic.channel(),
                "topic": topic.name(),
                "encoding": "protobuf",
                "schemaName": topic.schema().name,
                "schema": STANDARD.encode(topic.schema().descriptors),
                "schemaEncoding": "protobuf",
            })
        })
        .collect();
    json!({ "op": "advertise", "channels": channels }).to_string()
}

/// A remark for the person at the client: something that it asked for cannot be had.
pub fn warning(text: &str) -> String {
    json!({ "op": "status", "level": 1, "message": text }).to_string()
}

/// A frame with a message for a subscription, at a time in nanoseconds after 1970.
pub fn message_frame(subscription: u32, nanoseconds: u64, message: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(13 + message.len());
    frame.push(MESSAGE_DATA);
    frame.extend(subscription.to_le_bytes());
    frame.extend(nanoseconds.to_le_bytes());
    frame.extend(message);
    frame
}

/// Reads a text of a client.
///
/// # Errors
/// [`ProtocolError`] if it is none of the protocol, or names a channel that there is not.
pub fn read_request(text: &str) -> Result<Request, ProtocolError> {
    #[derive(Deserialize)]
    struct Subscription {
        id: u32,
        #[serde(rename = "channelId")]
        channel: u32,
    }
    #[derive(Deserialize)]
    struct Text {
        op: String,
        #[serde(default)]
        subscriptions: Vec<Subscription>,
        #[serde(default, rename = "subscriptionIds")]
        subscription_ids: Vec<u32>,
    }
    let text: Text = serde_json::from_str(text).map_err(|error| ProtocolError::new(error.to_string()))?;
    match text.op.as_str() {
        "subscribe" => {
            let topic = |wanted: Subscription| {
                let topic = TOPICS.get(wanted.channel as usize).copied();
                topic
                    .map(|topic| (wanted.id, topic))
                    .ok_or_else(|| ProtocolError::new(format!("there is no channel {}", wanted.channel)))
            };
            text.subscriptions.into_iter().map(topic).collect::<Result<_, _>>().map(Request::Subscribe)
        }
        "unsubscribe" => Ok(Request::Unsubscribe(text.subscription_ids)),
        _ => Ok(Request::Other(text.op)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn requests_are_read_and_what_is_none_is_refused() {
        let subscribe = r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":0},{"id":8,"channelId":6}]}"#;
        assert_eq!(
            read_request(subscribe).expect("one"),
            Request::Subscribe(vec![(7, Topic::Points), (8, Topic::Log)])
        );
        let unsubscribe = r#"{"op":"unsubscribe","subscriptionIds":[7]}"#;
        assert_eq!(read_request(unsubscribe).expect("one"), Request::Unsubscribe(vec![7]));
        assert_eq!(read_request(r#"{"op":"getParameters"}"#).expect("one"), Request::Other("getParameters".into()));
        for wrong in ["", "{}", "[]", r#"{"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]}"#] {
            assert!(read_request(wrong).is_err(), "{wrong}");
        }
        let unknown = r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}"#;
        assert!(read_request(unknown).expect_err("none").to_string().contains("99"));
    }

    #[test]
    fn a_frame_is_laid_out_as_the_protocol_says() {
        assert_eq!(message_frame(0x0102, 3, b"ab"), [1, 2, 1, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, b'a', b'b']);
    }

    #[test]
    fn every_topic_is_advertised_by_its_channel() {
        let said: serde_json::Value = serde_json::from_str(&advertisement()).expect("JSON");
        for (number, topic) in TOPICS.into_iter().enumerate() {
            let channel = &said["channels"][number];
            assert_eq!((channel["id"].as_u64(), channel["topic"].as_str()), (Some(number as u64), Some(topic.name())));
            assert!(channel["schema"].as_str().is_some_and(|schema| schema.len() > 50));
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in ".{0,200}") {
            let _ = read_request(&text);
        }
    }
}
