//! Clouds to measure on, cut into chunks.

use super::{Figures, cheapest};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use semascan_protocol::chunk::{CHUNK_EDGE, VoxelChunk};
use std::collections::BTreeMap;

/// Bytes of one vertex in the layout of `cloud.ply`.
const VERTEX: usize = 53;

/// Reads a `cloud.ply` as this crate writes it: its voxel edge where a comment notes it, and its points.
pub(super) fn read_ply(path: &str) -> (Option<f32>, SemanticCloud) {
    let bytes = std::fs::read(path).expect("a readable cloud");
    let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("a PLY header") + 11;
    let header = String::from_utf8_lossy(&bytes[..end]);
    let voxel = header.lines().find_map(|l| l.strip_prefix("comment voxel ")?.trim().parse().ok());
    let body = &bytes[end..];
    assert_eq!(body.len() % VERTEX, 0, "not the layout of cloud.ply");
    let points = body.chunks_exact(VERTEX).map(|v| {
        let f = |o: usize| f32::from_le_bytes([v[o], v[o + 1], v[o + 2], v[o + 3]]);
        let u = |o: usize| u16::from_le_bytes([v[o], v[o + 1]]);
        SemanticPoint {
            position: [f(0), f(4), f(8)],
            normal: [f(12), f(16), f(20)],
            color: [v[24], v[25], v[26]],
            label: u(27),
            confidence: f(29),
            defect: u(33),
            defect_confidence: f(35),
            sigma: f(39),
            defect_sigma: f(43),
            instance: u(47),
            views: u(49),
            flags: PointFlags(u(51)),
        }
    });
    (voxel, points.collect())
}

/// Cuts a cloud into chunks of voxels of edge `voxel` (metres); of several points in a voxel the first stays.
pub(super) fn chunks(cloud: &SemanticCloud, voxel: f32) -> Vec<VoxelChunk> {
    let mut chunks: BTreeMap<[i32; 3], BTreeMap<[u8; 3], SemanticPoint>> = BTreeMap::new();
    for p in cloud.iter() {
        let cell = p.position.map(|c| (f64::from(c) / f64::from(voxel)).floor() as i32);
        let id = cell.map(|c| c.div_euclid(CHUNK_EDGE));
        let inner = cell.map(|c| c.rem_euclid(CHUNK_EDGE) as u8);
        chunks.entry(id).or_default().entry(inner).or_insert(p);
    }
    let chunk =
        |(id, voxels): ([i32; 3], BTreeMap<_, _>)| VoxelChunk { id, voxel, voxels: voxels.into_iter().collect() };
    chunks.into_iter().map(chunk).collect()
}

/// Points as 18-byte structs (f32 position, RGBA, label) through zstd level 3, chunk by chunk.
pub(super) fn raw_zstd(chunks: &[VoxelChunk]) -> Figures {
    let pack = |chunk: &VoxelChunk| {
        let mut bytes = Vec::with_capacity(18 * chunk.voxels.len());
        for (_, p) in &chunk.voxels {
            bytes.extend(p.position.iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend_from_slice(&[p.color[0], p.color[1], p.color[2], 255]);
            bytes.extend_from_slice(&p.label.to_le_bytes());
        }
        zstd::bulk::compress(&bytes, 3).expect("zstd").len()
    };
    let (seconds, packed) = cheapest(super::RUNS, || chunks.iter().map(pack).sum::<usize>());
    let count: usize = chunks.iter().map(|c| c.voxels.len()).sum();
    Figures {
        bytes_per_point: packed as f64 / count as f64,
        encode_mpoints_per_s: count as f64 / seconds.cpu_s / 1e6,
        decode_mpoints_per_s: None,
        worst_position_error_voxels: None,
    }
}

/// Voxel edge of the synthetic part, metres.
pub(super) const SYNTHETIC_VOXEL: f32 = 0.0005;

/// The same chunks with nothing but position, colour and label, which is what other coders are compared on.
pub(super) fn plain(chunks: &[VoxelChunk]) -> Vec<VoxelChunk> {
    let mut chunks = chunks.to_vec();
    for (_, p) in chunks.iter_mut().flat_map(|c| &mut c.voxels) {
        *p = SemanticPoint {
            position: p.position,
            color: p.color,
            label: p.label,
            normal: [0.0; 3],
            confidence: 0.0,
            defect: 0,
            defect_confidence: 0.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 0,
            flags: PointFlags::default(),
        };
    }
    chunks
}

/// A seeded part of half a million points at 0.5 mm: a ribbed cylinder with a flange, labelled by region, with sensor
/// noise on positions and colours.
pub(super) fn synthetic(seed: u64) -> SemanticCloud {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let mut noise = move |deviation: f32| -> f32 {
        (0..4).map(|_| random.random_range(-1.0..1.0_f32)).sum::<f32>() * deviation * 0.87
    };
    let mut points: BTreeMap<[i32; 3], SemanticPoint> = BTreeMap::new();
    let (around, along) = (1400, 560);
    for i in 0..around {
        for j in 0..along {
            let (angle, height) =
                (i as f32 / around as f32 * std::f32::consts::TAU, (j as f32 + 0.5) / along as f32 * 0.2);
            let (sin, cos) = angle.sin_cos();
            let label = 1 + (height / 0.05) as u16;
            let radius = 0.06 + 0.004 * (angle * 12.0).sin() * f32::from(label % 2) + noise(0.0001);
            let shade = 110.0 + 20.0 * f32::from(label) + 15.0 * (height * 90.0).sin();
            let color = [1.0, 0.97, 0.9].map(|tint| (shade * tint + noise(3.0)).clamp(0.0, 255.0) as u8);
            let position = [radius * cos, radius * sin, height];
            let point = SemanticPoint {
                position,
                normal: [cos, sin, 0.0],
                color,
                label,
                confidence: (0.95 + noise(0.02)).clamp(0.0, 1.0),
                defect: u16::from((angle - 1.0).hypot(height * 20.0 - 2.0) < 0.3),
                defect_confidence: 1.0,
                sigma: (0.1 + noise(0.02)).clamp(0.0, 1.0),
                defect_sigma: 0.0,
                instance: 0,
                views: (4.0 + 3.0 * cos).round() as u16,
                flags: PointFlags::default(),
            };
            points.entry(position.map(|c| (f64::from(c) / f64::from(SYNTHETIC_VOXEL)).floor() as i32)).or_insert(point);
        }
    }
    points.into_values().collect()
}
