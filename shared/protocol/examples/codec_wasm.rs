//! The chunk codec at work, to be timed from outside: built for wasm32 and run by `benches/codec_wasm.mjs`.
//!
//! The first call of `main` makes 200 chunks of 1024 points (a rough, noisy surface through each) and encodes them; after
//! that calls alternate between encoding and decoding all of them.

use semascan_model::{PointFlags, SemanticPoint};
use semascan_protocol::ChunkUpdate;
use semascan_protocol::chunk::{ChunkDecoder, ChunkEncoder, VoxelChunk};
use std::cell::RefCell;

const CHUNKS: i32 = 200;
const VOXEL: f32 = 0.0005;

#[derive(Default)]
struct Work {
    chunks: Vec<VoxelChunk>,
    updates: Vec<ChunkUpdate>,
    encoder: ChunkEncoder,
    decoder: ChunkDecoder,
    calls: u32,
}

thread_local! {
    static WORK: RefCell<Work> = RefCell::new(Work::default());
}

fn main() {
    WORK.with_borrow_mut(|work| {
        let Work { chunks, updates, encoder, decoder, calls } = work;
        if chunks.is_empty() {
            chunks.extend((0..CHUNKS).map(chunk));
        }
        if *calls % 2 == 0 {
            updates.clear();
            updates.extend(chunks.iter().filter_map(|c| encoder.encode(c, 1, 1).ok()).map(|e| e.update));
            assert_eq!(updates.len(), chunks.len());
        } else {
            let points: usize = updates.iter().filter_map(|u| decoder.decode(u).ok()).map(|c| c.cloud.len()).sum();
            assert_eq!(points, chunks.len() * 1024);
        }
        *calls += 1;
    });
}

/// A rough surface through one chunk, coloured with noise.
fn chunk(index: i32) -> VoxelChunk {
    let voxels = (0..32 * 32_u32).map(|i| {
        let (x, y) = (i % 32, i / 32);
        let noise = |k: u32| (i ^ (index as u32 * 7919)).wrapping_mul(2_654_435_761).rotate_left(k * 7) >> 24;
        let z = (16.0 + 9.0 * (x as f32 * 0.15 + index as f32).sin() * (y as f32 * 0.11).cos()) as u32;
        let cell = [x, y, z];
        let jitter = [noise(0), noise(1), noise(2)].map(|n| n as f32 / 256.0);
        let origin = [index * 32, 0, 0];
        let point = SemanticPoint {
            position: std::array::from_fn(|a| (origin[a] as f32 + cell[a] as f32 + 0.1 + 0.8 * jitter[a]) * VOXEL),
            normal: [0.0, 0.6, 0.8],
            color: [120 + (noise(3) >> 5) as u8, 110 + (noise(4) >> 5) as u8, 100 + (noise(5) >> 5) as u8],
            label: 1 + (x / 16) as u16,
            confidence: 0.9 + 0.1 * jitter[0],
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 1,
            views: 3 + (noise(6) >> 6) as u16,
            flags: PointFlags(0),
        };
        (cell.map(|c| c as u8), point)
    });
    VoxelChunk { id: [index, 0, 0], voxel: VOXEL, voxels: voxels.collect() }
}
