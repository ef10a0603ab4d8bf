//! OBJ and the material library that it names, any bytes: the reader may refuse them, it may not panic, and what it takes is
//! consistent.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_formats::Geometry;

fuzz_target!(|bytes: &[u8]| {
    let (object, library) = semascan_fuzz::two_files(bytes);
    if let Ok(geometry) = Geometry::read("fuzzed.obj", object, &|_| Ok(library.to_vec())) {
        let points = geometry.positions.len() as u32;
        assert!(geometry.triangles.iter().flatten().all(|corner| *corner < points));
    }
});
