//! The WebSocket protocol of Foxglove, client's side: what a server says, and how it is asked for messages.

use crate::protocol::ProtocolError;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;
use serde_json::json;

/// Channels that a server may have.
const MOST_CHANNELS: usize = 10_000;
/// First byte of a frame that carries a message, and the bytes in front of the message.
const MESSAGE_DATA: u8 = 1;
const FRAME_HEAD: usize = 13;

/// A stream of messages of one type, as a server offers it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Its number.
    pub id: u32,
    /// Its topic.
    pub topic: String,
    /// How its messages are written: `cdr`, `protobuf`, `json`, `ros1`.
    pub encoding: String,
    /// Name of their type.
    pub schema_name: String,
    /// How the type is defined: `ros2msg`, `protobuf`, `jsonschema`; empty where the server leaves it out.
    pub schema_encoding: String,
    /// The definition.
    pub schema: Vec<u8>,
}

/// What a server says in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FromServer {
    /// Who it is.
    Info {
        /// What it is called.
        name: String,
    },
    /// Channels that there are from now on.
    Advertised(Vec<Channel>),
    /// Channels that there are no more.
    Gone(Vec<u32>),
    /// A remark for people; worse than a note where `is_trouble`.
    Remark {
        /// Whether it is a warning or an error.
        is_trouble: bool,
        /// What it says.
        text: String,
    },
    /// Something that does not concern who only listens.
    Other,
}

/// Reads a text of a server.
///
/// # Errors
/// [`ProtocolError`] if it is none of the protocol.
pub fn read_text(text: &str) -> Result<FromServer, ProtocolError> {
    #[derive(Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Advertised {
        id: u32,
        topic: String,
        encoding: String,
        schema_name: String,
        #[serde(default)]
        schema: String,
        #[serde(default)]
        schema_encoding: Option<String>,
    }
    #[derive(Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Text {
        op: String,
        #[serde(default)]
        name: String,
        #[serde(default)]
        channels: Vec<Advertised>,
        #[serde(default)]
        channel_ids: Vec<u32>,
        #[serde(default)]
        level: u8,
        #[serde(default)]
        message: String,
    }
    let text: Text = serde_json::from_str(text).map_err(|error| ProtocolError::new(error.to_string()))?;
    Ok(match text.op.as_str() {
        "serverInfo" => FromServer::Info { name: text.name },
        "advertise" => {
            if text.channels.len() > MOST_CHANNELS {
                return Err(ProtocolError::new(format!("more than {MOST_CHANNELS} channels")));
            }
            let channel = |channel: Advertised| {
                // A definition that is bytes comes as base64.
                let is_binary = channel.encoding == "protobuf" || channel.encoding == "flatbuffer";
                let schema = match is_binary.then(|| STANDARD.decode(&channel.schema)) {
                    None => channel.schema.into_bytes(),
                    Some(bytes) => bytes.map_err(|error| ProtocolError::new(format!("{}: {error}", channel.topic)))?,
                };
                Ok(Channel {
                    id: channel.id,
                    topic: channel.topic,
                    encoding: channel.encoding,
                    schema_name: channel.schema_name,
                    schema_encoding: channel.schema_encoding.unwrap_or_default(),
                    schema,
                })
            };
            FromServer::Advertised(text.channels.into_iter().map(channel).collect::<Result<_, ProtocolError>>()?)
        }
        "unadvertise" => FromServer::Gone(text.channel_ids),
        "status" => FromServer::Remark { is_trouble: text.level > 0, text: text.message },
        _ => FromServer::Other,
    })
}

/// Subscription, time in nanoseconds after 1970, and message of a frame; `None` if it carries none.
pub fn read_frame(frame: &[u8]) -> Option<(u32, u64, &[u8])> {
    let (head, message) = frame.split_at_checked(FRAME_HEAD)?;
    let (&[kind], head) = head.split_first_chunk()?;
    let (subscription, nanoseconds) = head.split_first_chunk()?;
    let nanoseconds = nanoseconds.first_chunk()?;
    (kind == MESSAGE_DATA).then(|| (u32::from_le_bytes(*subscription), u64::from_le_bytes(*nanoseconds), message))
}

/// Asks for the messages of channels, each under the number of the channel itself.
pub fn subscription(channels: impl Iterator<Item = u32>) -> String {
    let list: Vec<_> = channels.map(|id| json!({ "id": id, "channelId": id })).collect();
    json!({ "op": "subscribe", "subscriptions": list }).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Request, advertisement, message_frame, read_request};
    use crate::topic::{TOPICS, Topic};
    use proptest::prelude::*;

    #[test]
    fn what_the_server_says_is_what_the_client_hears() {
        let FromServer::Advertised(channels) = read_text(&advertisement()).expect("an advertisement") else {
            panic!("channels");
        };
        let names: Vec<_> = channels.iter().map(|channel| channel.topic.as_str()).collect();
        assert_eq!(names, TOPICS.map(Topic::name));
        assert_eq!(channels[0].schema, Topic::Points.schema().descriptors);
        let asked = read_request(&subscription([0, 4].into_iter())).expect("a request");
        assert_eq!(asked, Request::Subscribe(vec![(0, Topic::Points), (4, Topic::Findings)]));
        assert_eq!(read_frame(&message_frame(7, 9, b"abc")), Some((7, 9, &b"abc"[..])));
        assert_eq!(read_frame(&[1, 2, 3]), None);
        let ros = r#"{"op":"advertise","channels":[{"id":3,"topic":"/tf","encoding":"cdr","schemaName":"tf2_msgs/msg/TFMessage",
            "schema":"geometry_msgs/TransformStamped[] transforms","schemaEncoding":"ros2msg"}]}"#;
        let FromServer::Advertised(channels) = read_text(ros).expect("an advertisement") else { panic!("channels") };
        assert!(channels[0].schema.starts_with(b"geometry_msgs"));
        assert_eq!(read_text(r#"{"op":"time"}"#).expect("a text"), FromServer::Other);
        assert!(read_text("[]").is_err());
    }

    proptest! {
        #[test]
        fn no_text_and_no_frame_panics(text in ".{0,300}", frame in proptest::collection::vec(any::<u8>(), 0..64)) {
            let _ = read_text(&text);
            let _ = read_frame(&frame);
        }
    }
}
