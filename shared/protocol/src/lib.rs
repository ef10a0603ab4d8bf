//! The live stream: WebSocket subprotocol `semascan.v1`, binary Protocol Buffers (`proto/*.proto` is the public
//! contract), the codec of the chunks that carry the model, and an inspection as one file.
//!
//! Everything that arrives is untrusted: [`decode_client`], [`decode_server`] and [`chunk::decode`] check every length
//! before they allocate.

pub mod chunk;
mod convert;
mod inspection_file;
mod limits;

pub use inspection_file::{FILE_ENDING, FileError, InspectionFile};
pub use limits::{
    MAX_CLIENT_MESSAGE, MAX_ENTRIES, MAX_HELD_CHUNKS, MAX_SERVER_MESSAGE, WireError, decode_client, decode_server,
};
pub use v1::*;

/// Name of the WebSocket subprotocol; the version is part of it.
pub const SUBPROTOCOL: &str = "semascan.v1";

/// Capability of a client that takes [`ReviewChange`].
pub const TAKES_REVIEWS: &str = "reviews.1";

/// Capability of a client that takes [`Pointer`].
pub const TAKES_POINTERS: &str = "pointers.1";

/// The generated messages.
#[allow(missing_docs, unreachable_pub, clippy::all)]
mod v1 {
    include!(concat!(env!("OUT_DIR"), "/semascan.v1.rs"));
}
