//! The chunk decoder on any bytes: it may refuse, it may not panic, and what it takes it must encode again to the same
//! content.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_protocol::chunk::{CHUNK_EDGE, VoxelChunk, decode, encode};
use semascan_protocol::{ChunkId, ChunkUpdate};

fuzz_target!(|input: (u16, i8, Vec<u8>)| {
    let (points, x, columns) = input;
    let id = ChunkId { x: x.into(), y: 0, z: -1 };
    let scale = 0.002 / 14.0;
    let update =
        ChunkUpdate { id: Some(id), scale, points: points.into(), columns: columns.into(), ..Default::default() };
    let Ok(decoded) = decode(&update) else { return };
    let corner = [f32::from(x), 0.0, -1.0].map(|c| c * CHUNK_EDGE as f32 * decoded.voxel);
    let first = corner.map(|c| c + scale / 2.0);
    let restored = decode(&ChunkUpdate { origin_x: first[0], origin_y: first[1], origin_z: first[2], ..update });
    let cloud = restored.expect("an origin does not matter to the columns").cloud;
    let cell = |p: [f32; 3]| [0, 1, 2].map(|a| ((p[a] - corner[a]) / decoded.voxel) as u8);
    let voxels = cloud.iter().map(|p| (cell(p.position), p)).collect();
    let again = encode(&VoxelChunk { id: decoded.id, voxel: decoded.voxel, voxels }, 0, 0);
    assert_eq!(again.expect("decoded points lie in their voxels").hash, decoded.hash);
});
