//! Chunks without end, as a hostile agent would send them, or so many of them: `endless_stream EPOCH POINTS VOXEL [CHUNKS]`.
//!
//! Writes messages of the live stream to stdout, each after its length (u32, little endian): chunks of `POINTS` points on voxels
//! of edge `VOXEL` (metres), under ever new names, until nobody reads on. A browser test passes them to a page. With 1024 points they
//! are planes above each other: a model of any size for a benchmark.

use anyhow::{Context, Result, ensure};
use prost::Message as _;
use semascan_model::SemanticPoint;
use semascan_protocol::chunk::{CHUNK_EDGE, ChunkEncoder, VoxelChunk};
use semascan_protocol::{ServerMessage, server_message::Body};
use std::io::{self, BufWriter, ErrorKind, Write};

/// Chunks along an edge of the square that they fill layer by layer.
const SIDE: i32 = 64;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (required, chunks) = arguments.split_at(arguments.len().min(3));
    let ([epoch, points, voxel], [] | [_]) = (required, chunks) else {
        anyhow::bail!("usage: endless_stream EPOCH POINTS VOXEL [CHUNKS]");
    };
    let chunks = chunks.first().map_or(Ok(i32::MAX), |chunks| chunks.parse())?;
    let (epoch, points, voxel) = (epoch.parse()?, points.parse::<usize>()?, voxel.parse::<f32>()?);
    let cells = (CHUNK_EDGE as usize).pow(3);
    ensure!((1..=cells).contains(&points), "POINTS: from 1 to {cells}");
    let mut out = BufWriter::new(io::stdout().lock());
    let mut encoder = ChunkEncoder::default();
    for number in 0..chunks {
        let chunk = VoxelChunk {
            id: [number % SIDE, number / SIDE % SIDE, number / (SIDE * SIDE)],
            voxel,
            voxels: (0..points).map(|i| point(number, i, voxel)).collect(),
        };
        let update = encoder.encode(&chunk, epoch, 1).context("a chunk of our own")?.update;
        let message = ServerMessage { body: Some(Body::Chunk(update)) }.encode_to_vec();
        let written = out.write_all(&(message.len() as u32).to_le_bytes()).and_then(|()| out.write_all(&message));
        match written {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => break,
            written => written?,
        }
    }
    Ok(())
}

/// The point `i` of the chunk `number`, in the middle of its voxel.
fn point(number: i32, i: usize, voxel: f32) -> ([u8; 3], SemanticPoint) {
    let edge = CHUNK_EDGE as usize;
    let cell = [i % edge, i / edge % edge, i / (edge * edge)];
    let chunk = [number % SIDE, number / SIDE % SIDE, number / (SIDE * SIDE)];
    let position = [0, 1, 2].map(|k| voxel * ((chunk[k] * edge as i32) as f32 + cell[k] as f32 + 0.5));
    let normal = [0.0, 0.0, 1.0];
    (cell.map(|c| c as u8), SemanticPoint { position, normal, color: [200; 3], ..SemanticPoint::UNKNOWN })
}
