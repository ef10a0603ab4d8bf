//! `model.toml` of a network, any text: it may be refused, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_perception::segment::network::Manifest;

fuzz_target!(|text: &str| {
    let _ = Manifest::parse(text);
});
