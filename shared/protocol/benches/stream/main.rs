//! Bytes a point and points a second of the chunk codec, beside raw structs + zstd in the same run.
//!
//! `cargo bench -p semascan-protocol --bench stream -- [cloud.ply [voxel metres]]`; without a cloud it measures a seeded
//! synthetic part. Bytes are those of whole messages, headers included. A table for people goes to stderr, one JSON
//! object to stdout; speeds are CPU time of one thread.
#![allow(clippy::print_stdout)]

mod cloud;
#[path = "../../../geometry/benches/metrics/cpu.rs"]
mod cpu;

use cpu::cheapest;
use semascan_protocol::ChunkUpdate;
use semascan_protocol::chunk::{ChunkDecoder, ChunkEncoder, Plane, VoxelChunk, decode, plane_sizes};
use std::collections::BTreeMap;

/// Runs of which the cheapest counts.
const RUNS: u32 = 5;

fn main() {
    let mut args = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let (name, voxel, points) = match args.next() {
        Some(path) => {
            let (noted, points) = cloud::read_ply(&path);
            let voxel = args.next().map(|v| v.parse().expect("voxel edge in metres")).or(noted);
            (path, voxel.expect("the cloud has no `comment voxel METRES`: name the voxel edge"), points)
        }
        None => ("synthetic part, seed 7".into(), cloud::SYNTHETIC_VOXEL, cloud::synthetic(7)),
    };
    let chunks = cloud::chunks(&points, voxel);
    let count: usize = chunks.iter().map(|c| c.voxels.len()).sum();
    eprintln!("{name}: {count} points at {} mm in {} chunks", voxel * 1e3, chunks.len());

    let planes = by_plane(&chunks, count);
    for (plane, bytes) in &planes {
        eprintln!("  {plane:<10} {bytes:.3} bytes/point");
    }
    let all = Figures::measure(&chunks);
    all.print("everything");
    let plain = Figures::measure(&cloud::plain(&chunks));
    plain.print("position, colour, label alone");
    let zstd = cloud::raw_zstd(&chunks);
    zstd.print("raw structs of position, colour, label + zstd-3");
    println!(
        "{}",
        serde_json::json!({
            "cloud": name, "points": count, "chunks": chunks.len(), "voxel_m": voxel,
            "bytes_per_point_by_plane": planes,
            "all": all, "position_color_label": plain, "raw_zstd": zstd,
        })
    );
}

/// What one coder does with one cloud.
#[derive(serde::Serialize)]
struct Figures {
    bytes_per_point: f64,
    encode_mpoints_per_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    decode_mpoints_per_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    worst_position_error_voxels: Option<f64>,
}

impl Figures {
    fn measure(chunks: &[VoxelChunk]) -> Self {
        let mut encoder = ChunkEncoder::default();
        let mut encode = |c| encoder.encode(c, 1, 1).expect("a valid chunk").update;
        let (encoding, updates) = cheapest(RUNS, || chunks.iter().map(&mut encode).collect::<Vec<_>>());
        let mut decoder = ChunkDecoder::default();
        let mut decode = |u| decoder.decode(u).expect("own bytes").cloud.len();
        let (decoding, count) = cheapest(RUNS, || updates.iter().map(&mut decode).sum::<usize>());
        let bytes: usize = updates.iter().map(prost::Message::encoded_len).sum();
        Self {
            bytes_per_point: bytes as f64 / count as f64,
            encode_mpoints_per_s: count as f64 / encoding.cpu_s / 1e6,
            decode_mpoints_per_s: Some(count as f64 / decoding.cpu_s / 1e6),
            worst_position_error_voxels: Some(
                updates.iter().zip(chunks).map(|(u, c)| worst_error(c, u)).fold(0.0, f64::max),
            ),
        }
    }

    fn print(&self, what: &str) {
        let decode = self.decode_mpoints_per_s.map(|d| format!(", decode {d:.2}")).unwrap_or_default();
        let worst = self.worst_position_error_voxels.map(|e| format!(", worst error {e:.4} voxel")).unwrap_or_default();
        eprintln!(
            "{what}: {:.3} bytes/point, encode {:.2} M points/s{decode}{worst}",
            self.bytes_per_point, self.encode_mpoints_per_s
        );
    }
}

/// Bytes a point that each plane takes, headers aside.
fn by_plane(chunks: &[VoxelChunk], count: usize) -> BTreeMap<String, f64> {
    let mut planes: BTreeMap<Plane, f64> = BTreeMap::new();
    for chunk in chunks {
        for (plane, bytes) in plane_sizes(chunk).expect("a valid chunk") {
            *planes.entry(plane).or_default() += bytes;
        }
    }
    planes.into_iter().map(|(plane, bytes)| (format!("{plane:?}").to_lowercase(), bytes / count as f64)).collect()
}

/// Largest distance between a point and its decoded self, in voxels; also checks that labels and colours are exact.
fn worst_error(chunk: &VoxelChunk, update: &ChunkUpdate) -> f64 {
    let mut sent = chunk.voxels.clone();
    sent.sort_unstable_by_key(|([x, y, z], _)| (*z, *y, *x));
    let cloud = decode(update).expect("own bytes").cloud;
    let mut worst = 0.0_f64;
    for ((_, a), b) in sent.iter().zip(cloud.iter()) {
        assert_eq!((a.label, a.color, a.defect, a.flags, a.views), (b.label, b.color, b.defect, b.flags, b.views));
        let distance =
            (0..3).map(|k| (f64::from(a.position[k]) - f64::from(b.position[k])).powi(2)).sum::<f64>().sqrt();
        worst = worst.max(distance / f64::from(chunk.voxel));
    }
    worst
}
