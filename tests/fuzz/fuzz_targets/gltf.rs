//! glTF and GLB with a buffer beside it, any bytes: the reader may refuse them, it may not panic, and what it takes is
//! consistent.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_formats::Geometry;

fuzz_target!(|bytes: &[u8]| {
    let (scene, buffer) = semascan_fuzz::two_files(bytes);
    let name = if scene.starts_with(b"glTF") { "fuzzed.glb" } else { "fuzzed.gltf" };
    if let Ok(geometry) = Geometry::read(name, scene, &|_| Ok(buffer.to_vec())) {
        let points = geometry.positions.len() as u32;
        assert!(geometry.triangles.iter().flatten().all(|corner| *corner < points));
    }
});
