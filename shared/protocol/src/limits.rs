//! Size limits and the checked entry points for everything that arrives.

use super::server_message::Body;
use super::{ClientMessage, Inspection, ServerMessage, client_message};
use prost::Message;

/// Largest message an agent accepts from a client: a Hello that lists [`MAX_HELD_CHUNKS`].
pub const MAX_CLIENT_MESSAGE: usize = 512 << 10;

/// Most chunks that a Hello may list: a client that holds more starts over, which is no dearer.
pub const MAX_HELD_CHUNKS: usize = 16_000;

/// Largest message a viewer accepts from an agent.
pub const MAX_SERVER_MESSAGE: usize = 8 << 20;

/// Most entries of a list in a message of an agent: labels and instances have 16 bits. A few bytes of a message stand for many
/// times as many in memory.
pub const MAX_ENTRIES: usize = 1 << 16;

/// Why a message was refused.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum WireError {
    /// The message is larger than its side of the protocol allows.
    #[error("message of {len} bytes is over the limit of {limit}")]
    TooLarge {
        /// Its length.
        len: usize,
        /// What is allowed.
        limit: usize,
    },
    /// The bytes are no message of `semascan.v1`.
    #[error("not a semascan.v1 message: {0}")]
    Malformed(String),
    /// A Hello lists more chunks than it may.
    #[error("a Hello of {0} chunks is over the limit of {MAX_HELD_CHUNKS}")]
    TooManyHeld(usize),
    /// A message without its body.
    #[error("message without a body")]
    Empty,
    /// A field holds what it must not.
    #[error("field {field}: {reason}")]
    Field {
        /// The offending field.
        field: &'static str,
        /// What is wrong.
        reason: String,
    },
}

/// Decodes what a client sent.
///
/// # Errors
/// [`WireError`] for anything that is not a whole, known client message.
pub fn decode_client(bytes: &[u8]) -> Result<ClientMessage, WireError> {
    check(bytes, MAX_CLIENT_MESSAGE)?;
    let message = ClientMessage::decode(bytes).map_err(|e| WireError::Malformed(e.to_string()))?;
    match &message.body {
        None => Err(WireError::Empty),
        Some(client_message::Body::Hello(hello)) if hello.held.len() > MAX_HELD_CHUNKS => {
            Err(WireError::TooManyHeld(hello.held.len()))
        }
        Some(_) => Ok(message),
    }
}

/// Decodes what an agent sent.
///
/// # Errors
/// [`WireError`] for anything that is not a whole, known server message.
pub fn decode_server(bytes: &[u8]) -> Result<ServerMessage, WireError> {
    check(bytes, MAX_SERVER_MESSAGE)?;
    let message = ServerMessage::decode(bytes).map_err(|e| WireError::Malformed(e.to_string()))?;
    for (field, entries) in message.body.as_ref().map_or_else(Vec::new, lists) {
        if entries > MAX_ENTRIES {
            let reason = format!("{entries} entries are over the limit of {MAX_ENTRIES}");
            return Err(WireError::Field { field, reason });
        }
    }
    if message.body.is_none() { Err(WireError::Empty) } else { Ok(message) }
}

/// The lists of a message, and how many entries they have.
fn lists(body: &Body) -> Vec<(&'static str, usize)> {
    let classes = |inspection: &Option<Inspection>| {
        let counts = |i: &Inspection| {
            vec![("inspection.components", i.components.len()), ("inspection.defects", i.defects.len())]
        };
        inspection.as_ref().map_or_else(Vec::new, counts)
    };
    match body {
        Body::Welcome(welcome) => {
            let mut lists = classes(&welcome.inspection);
            lists.push(("capabilities", welcome.capabilities.len()));
            lists
        }
        Body::Clear(clear) => classes(&clear.inspection),
        Body::Progress(progress) => progress.figures.as_ref().map_or_else(Vec::new, |figures| {
            vec![
                ("figures.components", figures.components.len()),
                ("figures.defects", figures.defects.len()),
                ("figures.findings", figures.findings.len()),
                ("figures.instances", figures.instances.len()),
            ]
        }),
        Body::View(view) => vec![("timings", view.timings.len())],
        Body::Review(review) => vec![("conflicts_with", review.conflicts_with.len())],
        _ => Vec::new(),
    }
}

fn check(bytes: &[u8], limit: usize) -> Result<(), WireError> {
    if bytes.len() > limit { Err(WireError::TooLarge { len: bytes.len(), limit }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ChunkId, HeldChunk, Hello};

    fn hello(chunks: usize) -> Vec<u8> {
        // The longest coordinates and revisions that can be written.
        let chunk = HeldChunk { id: Some(ChunkId { x: i32::MIN, y: i32::MIN, z: i32::MIN }), revision: u32::MAX };
        let hello = Hello { client: "c".repeat(100), held: vec![chunk; chunks], ..Hello::default() };
        ClientMessage { body: Some(client_message::Body::Hello(hello)) }.encode_to_vec()
    }

    #[test]
    fn the_largest_hello_is_taken_and_a_larger_one_is_not() {
        assert!(decode_client(&hello(MAX_HELD_CHUNKS)).is_ok());
        assert_eq!(decode_client(&hello(MAX_HELD_CHUNKS + 1)), Err(WireError::TooManyHeld(MAX_HELD_CHUNKS + 1)));
        let larger = hello(MAX_CLIENT_MESSAGE / 20);
        assert_eq!(decode_client(&larger), Err(WireError::TooLarge { len: larger.len(), limit: MAX_CLIENT_MESSAGE }));
    }
}
