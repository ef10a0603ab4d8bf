//! The checked entry point for everything an agent sends, on any bytes: it may refuse, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_protocol::server_message::Body;
use semascan_protocol::{chunk, decode_server};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(message) = decode_server(bytes) {
        let again = prost::Message::encode_to_vec(&message);
        assert!(decode_server(&again).is_ok());
        if let Some(Body::Chunk(update)) = &message.body {
            let _ = chunk::decode(update);
        }
    }
});
