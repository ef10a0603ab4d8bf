//! `criteria.toml`, any text: it may be refused, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_inspection::criteria::CheckedCriteria;

fuzz_target!(|text: &str| {
    let _ = CheckedCriteria::parse(text);
});
