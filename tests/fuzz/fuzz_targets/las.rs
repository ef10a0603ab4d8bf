//! LAS, any bytes: the reader may refuse them, it may not panic, and what it takes is consistent.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_formats::{Geometry, no_files};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(geometry) = Geometry::read("fuzzed.las", bytes, &no_files) {
        let points = geometry.positions.len() as u32;
        assert!(geometry.triangles.iter().flatten().all(|corner| *corner < points));
    }
});
