//! A `virtual:` URI, any text: it may be refused, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_simulation::VirtualCellSpec;

fuzz_target!(|text: &str| {
    let _ = VirtualCellSpec::parse(&format!("virtual:{text}"));
});
