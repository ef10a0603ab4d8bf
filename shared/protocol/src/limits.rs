//! Size limits and the checked entry points for everything that arrives.

use super::{ClientMessage, ServerMessage};
use prost::Message;

/// Largest message an agent accepts from a client: a Hello that holds 100 000 chunks is about 2 MB.
pub const MAX_CLIENT_MESSAGE: usize = 4 << 20;

/// Largest message a viewer accepts from an agent.
pub const MAX_SERVER_MESSAGE: usize = 8 << 20;

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
    if message.body.is_none() { Err(WireError::Empty) } else { Ok(message) }
}

/// Decodes what an agent sent.
///
/// # Errors
/// [`WireError`] for anything that is not a whole, known server message.
pub fn decode_server(bytes: &[u8]) -> Result<ServerMessage, WireError> {
    check(bytes, MAX_SERVER_MESSAGE)?;
    let message = ServerMessage::decode(bytes).map_err(|e| WireError::Malformed(e.to_string()))?;
    if message.body.is_none() { Err(WireError::Empty) } else { Ok(message) }
}

fn check(bytes: &[u8], limit: usize) -> Result<(), WireError> {
    if bytes.len() > limit { Err(WireError::TooLarge { len: bytes.len(), limit }) } else { Ok(()) }
}
