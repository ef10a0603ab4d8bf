//! The chunk codec as its two sides use it: round trips, order, and everything that may come over a wire.

use proptest::collection::btree_map;
use proptest::prelude::*;
use semascan_model::{PointFlags, SemanticPoint};
use semascan_protocol::chunk::{self, CHUNK_EDGE, ChunkDecoder, ChunkEncoder, VoxelChunk, decode, encode};
use semascan_protocol::{ChunkUpdate, WireError};

/// A point somewhere in its voxel; `voxel` metres, `cell` counted from the table frame's origin.
fn point(cell: [i32; 3], voxel: f32, seed: u64) -> SemanticPoint {
    let byte = |k: u32| (seed.rotate_left(9 * k) & 0xff) as u8;
    let fraction = |k: u32| f64::from(byte(k)) / 255.0;
    let position = [0, 1, 2].map(|a| ((f64::from(cell[a]) + fraction(a as u32)) * f64::from(voxel)) as f32);
    let (sin, cos) = (fraction(3) as f32 * 6.3).sin_cos();
    let z = fraction(4) as f32 * 2.0 - 1.0;
    let r = (1.0 - z * z).sqrt();
    SemanticPoint {
        position,
        normal: if seed.is_multiple_of(7) { [0.0; 3] } else { [r * cos, r * sin, z] },
        color: [byte(5), byte(6), byte(0)],
        label: (seed % 3) as u16 * u16::from(byte(1)),
        confidence: fraction(2) as f32,
        defect: u16::from(seed.is_multiple_of(11)),
        defect_confidence: fraction(5) as f32,
        sigma: if seed.is_multiple_of(2) { 0.25 } else { 0.5 },
        defect_sigma: 0.0,
        instance: (seed % 1000) as u16 * 65,
        views: if seed.is_multiple_of(13) { seed as u16 } else { 3 },
        flags: PointFlags((seed % 16) as u16),
    }
}

fn chunk(id: [i32; 3], voxel: f32, cells: impl IntoIterator<Item = ([u8; 3], u64)>) -> VoxelChunk {
    let place = |(cell, seed): ([u8; 3], u64)| {
        let at = [0, 1, 2].map(|a| id[a] * CHUNK_EDGE + i32::from(cell[a]));
        (cell, point(at, voxel, seed))
    };
    VoxelChunk { id, voxel, voxels: cells.into_iter().map(place).collect() }
}

fn any_chunk(most: usize) -> impl Strategy<Value = VoxelChunk> {
    let cells = btree_map([0_u8..32, 0_u8..32, 0_u8..32], any::<u64>(), 1..most);
    ([-60_i32..60, -60_i32..60, -60_i32..60], (300..20_000_i32).prop_map(|k| k as f32 / 1e6), cells)
        .prop_map(|(id, v, cells)| chunk(id, v, cells))
}

fn close(a: f32, b: f32, tolerance: f32) -> bool {
    (a - b).abs() <= tolerance
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_chunk_comes_back(chunk in any_chunk(600)) {
        let sent = encode(&chunk, 3, 9).expect("a valid chunk");
        let got = decode(&sent.update).expect("own bytes");
        prop_assert_eq!((got.id, got.epoch, got.revision, got.hash), (chunk.id, 3, 9, sent.hash));
        prop_assert!(close(got.voxel, chunk.voxel, chunk.voxel * 1e-6));
        let mut voxels = chunk.voxels.clone();
        voxels.sort_unstable_by_key(|([x, y, z], _)| (*z, *y, *x));
        prop_assert_eq!(got.cloud.len(), voxels.len());
        for ((_, a), b) in voxels.iter().zip(got.cloud.iter()) {
            let squared: f32 = (0..3).map(|k| (a.position[k] - b.position[k]).powi(2)).sum();
            prop_assert!(squared.sqrt() <= chunk.voxel / 16.0, "{:?} {:?}", a.position, b.position);
            prop_assert_eq!((a.color, a.label, a.defect), (b.color, b.label, b.defect));
            prop_assert_eq!((a.instance, a.views, a.flags), (b.instance, b.views, b.flags));
            for (x, y) in [
                (a.confidence, b.confidence),
                (a.defect_confidence, b.defect_confidence),
                (a.sigma, b.sigma),
                (a.defect_sigma, b.defect_sigma),
            ] {
                prop_assert!(close(x, y, 0.5 / 255.0 + 1e-6), "{x} {y}");
            }
            let cosine: f32 = (0..3).map(|k| a.normal[k] * b.normal[k]).sum();
            let same_normal = if a.normal == [0.0; 3] { b.normal == [0.0; 3] } else { cosine > 0.9998 };
            prop_assert!(same_normal, "{:?} {:?}", a.normal, b.normal);
        }
    }

    #[test]
    fn what_was_decoded_encodes_to_the_same_bytes(chunk in any_chunk(200)) {
        let first = encode(&chunk, 1, 1).expect("a valid chunk");
        let cloud = decode(&first.update).expect("own bytes").cloud;
        let mut cells: Vec<_> = chunk.voxels.iter().map(|(cell, _)| *cell).collect();
        cells.sort_unstable_by_key(|&[x, y, z]| (z, y, x));
        let again = VoxelChunk { voxels: cells.into_iter().zip(cloud.iter()).collect(), ..chunk };
        prop_assert_eq!(encode(&again, 1, 1).expect("a valid chunk"), first);
    }

    #[test]
    fn order_does_not_matter(chunk in any_chunk(300), shift in any::<prop::sample::Index>()) {
        let mut other = chunk.clone();
        other.voxels.rotate_left(shift.index(chunk.voxels.len()));
        other.voxels.reverse();
        prop_assert_eq!(encode(&chunk, 1, 2), encode(&other, 1, 2));
    }

    #[test]
    fn hash_tells_content_but_not_revision(chunk in any_chunk(100), which in any::<prop::sample::Index>()) {
        let hash = encode(&chunk, 1, 1).expect("a valid chunk").hash;
        prop_assert_eq!(encode(&chunk, 2, 5).expect("a valid chunk").hash, hash);
        let mut changed = chunk.clone();
        let i = which.index(changed.voxels.len());
        changed.voxels[i].1.label ^= 1;
        prop_assert_ne!(encode(&changed, 1, 1).expect("a valid chunk").hash, hash);
    }

    #[test]
    fn random_bytes_are_refused(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        points in any::<u32>(),
        scale in any::<f32>(),
        versioned in any::<bool>(),
    ) {
        let mut columns = bytes;
        if let Some(first) = columns.first_mut().filter(|_| versioned) {
            *first = 1;
        }
        let update = ChunkUpdate { id: Some(Default::default()), points, scale, columns: columns.into(), ..Default::default() };
        prop_assert!(decode(&update).is_err());
    }

    #[test]
    fn damage_is_refused(chunk in any_chunk(150), at in any::<prop::sample::Index>(), bit in 0..8_u32) {
        let sent = encode(&chunk, 1, 1).expect("a valid chunk").update;
        let mut flipped = sent.columns.to_vec();
        let at = at.index(flipped.len());
        flipped[at] ^= 1 << bit;
        let refused = decode(&ChunkUpdate { columns: flipped.into(), ..sent.clone() });
        // A flipped bit of the coder's last state may change no symbol; what it must not do is change the content.
        let harmless = refused.as_ref().is_ok_and(|d| Ok(d) == decode(&sent).as_ref());
        prop_assert!(harmless || matches!(refused, Err(WireError::Field { field: "columns", .. })), "{refused:?}");
        let cut = decode(&ChunkUpdate { columns: sent.columns.slice(..at), ..sent.clone() });
        prop_assert!(cut.is_err());
        let mut longer = sent.columns.to_vec();
        longer.extend([0, 0]);
        let longer = decode(&ChunkUpdate { columns: longer.into(), ..sent });
        prop_assert!(longer.is_err());
    }

    #[test]
    fn model_hash_does_not_depend_on_order(
        chunks in btree_map([-9_i32..9, -9_i32..9, -9_i32..9], any::<u64>(), 0..20),
    ) {
        let forward = chunk::model_hash(chunks.iter().map(|(&id, &hash)| (id, hash)));
        prop_assert_eq!(forward, chunk::model_hash(chunks.iter().rev().map(|(&id, &hash)| (id, hash))));
        let mut other: Vec<_> = chunks.into_iter().collect();
        if let Some((_, hash)) = other.first_mut() {
            *hash ^= 1;
            prop_assert_ne!(forward, chunk::model_hash(other));
        }
    }
}

#[test]
fn a_full_chunk_and_a_single_point_come_back() {
    let every = (0..32_u8).flat_map(|z| (0..32).flat_map(move |y| (0..32).map(move |x| [x, y, z])));
    let seeded = every.zip((1_u64..).map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    let (mut encoder, mut decoder) = (ChunkEncoder::default(), ChunkDecoder::default());
    for chunk in [chunk([-1, 0, 7], 0.002, seeded), chunk([0, 0, 0], 0.002, [([31, 0, 31], 5)])] {
        let sent = encoder.encode(&chunk, 1, 1).expect("a valid chunk");
        let got = decoder.decode(&sent.update).expect("own bytes");
        assert_eq!((got.cloud.len(), got.hash), (chunk.voxels.len(), sent.hash));
        // A used encoder writes what a new one does.
        assert_eq!(encode(&chunk, 1, 1), Ok(sent));
    }
}

#[test]
fn what_is_no_chunk_is_not_encoded() {
    let good = chunk([0; 3], 0.002, [([1, 2, 3], 1), ([1, 2, 4], 2)]);
    let field = |chunk: &VoxelChunk| match encode(chunk, 1, 1) {
        Err(WireError::Field { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    let mut bad = good.clone();
    bad.voxels[1].0 = [1, 2, 3];
    bad.voxels[1].1.position = bad.voxels[0].1.position;
    assert_eq!(field(&bad), "voxels");
    bad.voxels[1].0 = [1, 2, 32];
    assert_eq!(field(&bad), "voxels");
    assert_eq!(field(&VoxelChunk { voxels: vec![], ..good.clone() }), "voxels");
    for voxel in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(field(&VoxelChunk { voxel, ..good.clone() }), "voxel");
    }
    for x in [f32::NAN, 1.0, -0.001] {
        let mut bad = good.clone();
        bad.voxels[0].1.position[0] = x;
        assert_eq!(field(&bad), "position");
    }
}

#[test]
fn a_refusal_names_the_field() {
    let good = encode(&chunk([0; 3], 0.002, [([1, 2, 3], 1), ([1, 2, 4], 2)]), 1, 1).expect("a valid chunk").update;
    let field = |update: ChunkUpdate| match decode(&update) {
        Err(WireError::Field { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    assert_eq!(field(ChunkUpdate { id: None, ..good.clone() }), "id");
    for points in [0, 32_769, u32::MAX] {
        assert_eq!(field(ChunkUpdate { points, ..good.clone() }), "points");
    }
    assert_eq!(field(ChunkUpdate { points: 3, ..good.clone() }), "columns");
    assert_eq!(field(ChunkUpdate { origin_y: f32::NAN, ..good.clone() }), "origin");
    for scale in [0.0, -0.1, f32::NAN, f32::INFINITY, f32::MAX] {
        assert_eq!(field(ChunkUpdate { scale, ..good.clone() }), "scale");
    }
    let mut columns = good.columns.to_vec();
    columns[0] = 2;
    assert_eq!(field(ChunkUpdate { columns: columns.into(), ..good }), "columns");
}
