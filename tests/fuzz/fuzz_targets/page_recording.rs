//! A recording that is opened on the page, any bytes: the module may refuse them, it may not panic, and what it makes of one is a model.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_formats::ply;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(opened) = semascan_recording::read("fuzzed.mcap", bytes)
        && opened.name.ends_with(".ply")
    {
        ply::read(&opened.name, &opened.bytes).expect("a cloud of our own");
    }
});
