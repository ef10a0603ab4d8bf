//! Bytes a point and points a second of the chunk codec, beside raw structs + zstd in the same run.
//!
//! `cargo bench -p semascan-shared --bench stream -- [cloud.ply [voxel metres]]`; without a cloud it measures a seeded
//! synthetic part. A table for people goes to stderr, one JSON object to stdout.
#![allow(clippy::print_stdout)]

mod cloud;

use semascan_shared::wire::chunk::{
    ChunkDecoder, ChunkEncoder, Plane, VoxelChunk, decode, plane_sizes,
};
use std::collections::BTreeMap;
use std::time::Instant;

fn main() {
    let mut args = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let (name, voxel, points) = match args.next() {
        Some(path) => {
            let (noted, points) = cloud::read_ply(&path);
            let voxel = args
                .next()
                .map(|v| v.parse().expect("voxel edge in metres"))
                .or(noted);
            (
                path,
                voxel.expect("the cloud has no `comment voxel METRES`: name the voxel edge"),
                points,
            )
        }
        None => ("synthetic part, seed 7".into(), 0.0005, cloud::synthetic(7)),
    };
    let chunks = cloud::chunks(&points, voxel);
    let count: usize = chunks.iter().map(|c| c.voxels.len()).sum();
    eprintln!(
        "{name}: {count} points at {} mm in {} chunks",
        voxel * 1e3,
        chunks.len()
    );

    let mut encoder = ChunkEncoder::default();
    let (encode_s, updates) = fastest(|| {
        chunks
            .iter()
            .map(|c| encoder.encode(c, 1, 1).expect("a valid chunk").update)
            .collect::<Vec<_>>()
    });
    let mut decoder = ChunkDecoder::default();
    let (decode_s, decoded) = fastest(|| {
        updates
            .iter()
            .map(|u| decoder.decode(u).expect("own bytes").cloud.len())
            .sum::<usize>()
    });
    assert_eq!(decoded, count);
    let message_bytes: usize = updates.iter().map(prost::Message::encoded_len).sum();
    let worst = updates
        .iter()
        .zip(&chunks)
        .map(|(u, c)| worst_error(c, u))
        .fold(0.0, f64::max);

    let mut planes: BTreeMap<Plane, f64> = BTreeMap::new();
    for chunk in &chunks {
        for (plane, bytes) in plane_sizes(chunk).expect("a valid chunk") {
            *planes.entry(plane).or_default() += bytes;
        }
    }
    let per_point = |bytes: f64| bytes / count as f64;
    for (plane, bytes) in &planes {
        eprintln!(
            "  {:<12} {:.3} bytes/point",
            format!("{plane:?}"),
            per_point(*bytes)
        );
    }
    let core: f64 = [
        Plane::Occupancy,
        Plane::Position,
        Plane::Color,
        Plane::Label,
    ]
    .map(|p| planes.get(&p).copied().unwrap_or(0.0))
    .iter()
    .sum();
    let coded: f64 = planes.values().sum();
    let overhead = message_bytes as f64 - coded;
    eprintln!("  {:<12} {:.3}", "headers", per_point(overhead));
    eprintln!(
        "position + colour + label {:.3}, with headers {:.3}",
        per_point(core),
        per_point(core + overhead)
    );
    eprintln!("all {:.3}", per_point(message_bytes as f64));
    eprintln!(
        "encode {:.2} M points/s, decode {:.2} M points/s, worst error {worst:.4} voxel",
        count as f64 / encode_s / 1e6,
        count as f64 / decode_s / 1e6
    );
    let (raw_zstd, raw, zstd_s) = cloud::raw_zstd(&chunks);
    eprintln!(
        "raw structs {:.2}, + zstd-3 {:.3} bytes/point, {:.2} M points/s",
        per_point(raw as f64),
        per_point(raw_zstd as f64),
        count as f64 / zstd_s / 1e6
    );
    let json = serde_json::json!({
        "cloud": name, "points": count, "chunks": chunks.len(), "voxel_m": voxel,
        "bytes_per_point": per_point(message_bytes as f64),
        "bytes_per_point_position_color_label": per_point(core + overhead),
        "bytes_per_point_by_plane": planes.iter().map(|(p, b)| (format!("{p:?}").to_lowercase(), per_point(*b))).collect::<BTreeMap<_, _>>(),
        "encode_mpoints_per_s": count as f64 / encode_s / 1e6,
        "decode_mpoints_per_s": count as f64 / decode_s / 1e6,
        "worst_position_error_voxels": worst,
        "raw_bytes_per_point": per_point(raw as f64),
        "raw_zstd_bytes_per_point": per_point(raw_zstd as f64),
        "raw_zstd_encode_mpoints_per_s": count as f64 / zstd_s / 1e6,
    });
    println!("{json}");
}

/// CPU seconds of the cheapest of five runs, and the last result.
fn fastest<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut result = None;
    for _ in 0..5 {
        let (start, clock) = (cpu_seconds(), Instant::now());
        result = Some(run());
        let wall = clock.elapsed().as_secs_f64();
        best = best.min(
            start
                .zip(cpu_seconds())
                .map_or(wall, |(start, end)| end - start),
        );
    }
    (best, result.expect("ran"))
}

/// CPU time of this thread, which other work on the machine does not change; `None` where the system does not tell.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(stat.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

/// Largest distance between a point and its decoded self, in voxels; also checks that labels and colours are exact.
fn worst_error(chunk: &VoxelChunk, update: &semascan_shared::wire::ChunkUpdate) -> f64 {
    let mut sent = chunk.voxels.clone();
    sent.sort_unstable_by_key(|([x, y, z], _)| (*z, *y, *x));
    let cloud = decode(update).expect("own bytes").cloud;
    let mut worst = 0.0_f64;
    for ((_, a), b) in sent.iter().zip(cloud.iter()) {
        assert_eq!(
            (a.label, a.color, a.defect, a.flags, a.views),
            (b.label, b.color, b.defect, b.flags, b.views)
        );
        let d = (0..3)
            .map(|k| (f64::from(a.position[k]) - f64::from(b.position[k])).powi(2))
            .sum::<f64>()
            .sqrt();
        worst = worst.max(d / f64::from(chunk.voxel));
    }
    worst
}
