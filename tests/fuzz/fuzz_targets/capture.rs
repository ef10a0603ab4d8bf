//! A capture (MCAP), any bytes: it may be refused or end early, the reader may not panic, and it comes to an end.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_captures::CaptureReader;
use std::io::Write;

fuzz_target!(|bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("room for it");
    let Ok(mut reader) = CaptureReader::open(file.path()) else { return };
    while let Some(view) = reader.next_view() {
        if view.is_err() {
            break;
        }
    }
});
