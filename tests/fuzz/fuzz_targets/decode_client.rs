//! The checked entry point for everything a client sends, on any bytes: it may refuse, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_protocol::decode_client;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(message) = decode_client(bytes) {
        let again = prost::Message::encode_to_vec(&message);
        assert!(decode_client(&again).is_ok());
    }
});
