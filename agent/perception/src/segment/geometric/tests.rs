//! The whole of it: synthetic scenes cut into their things, and hostile clouds.

use super::*;
use proptest::prelude::*;

/// A table with two boxes of the given colours on it, one pushed against the other, as pixels of a camera above.
fn boxes(colors: [[u8; 3]; 2]) -> (ColoredPoints, Vec<u32>) {
    let (width, height, f) = (320, 240, 520.0_f32);
    let (mut points, mut truth) = (ColoredPoints::default(), Vec::new());
    // The camera stands 0.5 m above the table and looks 40 degrees off the vertical.
    let (sin, cos) = 40_f32.to_radians().sin_cos();
    for v in 0..height {
        for u in 0..width {
            let ray = [(u as f32 - 159.5) / f, (v as f32 - 119.5) / f, 1.0];
            // World axes: x right, y away, z up.
            let d = [ray[0], sin - cos * ray[1], -cos - sin * ray[1]];
            let eye = [0.0, -0.42, 0.5];
            let mut hit = (-eye[2] / d[2], 0_u32);
            for (k, low) in [[-0.08, -0.05], [0.0, -0.05]].iter().enumerate() {
                let (lo, hi) = ([low[0], low[1], 0.0], [low[0] + 0.08, low[1] + 0.1, 0.06]);
                let (mut near, mut far) = (f32::NEG_INFINITY, f32::INFINITY);
                for a in 0..3 {
                    let (t0, t1) = ((lo[a] - eye[a]) / d[a], (hi[a] - eye[a]) / d[a]);
                    near = near.max(t0.min(t1));
                    far = far.min(t0.max(t1));
                }
                if near < far && near > 0.0 && near < hit.0 {
                    hit = (near, k as u32 + 1);
                }
            }
            points.positions.push(ray.map(|c| c * hit.0));
            points.colors.push(if hit.1 == 0 { [90, 90, 90] } else { colors[hit.1 as usize - 1] });
            truth.push(hit.1);
        }
    }
    (points, truth)
}

/// The segment that holds most points of `thing`, and their share.
fn held(of_point: &[u32], truth: &[u32], thing: u32) -> (u32, f64) {
    let mut counts = std::collections::BTreeMap::new();
    for (&s, _) in of_point.iter().zip(truth).filter(|(s, t)| **t == thing && **s != NONE) {
        *counts.entry(s).or_insert(0_u32) += 1;
    }
    let (&segment, &n) = counts.iter().max_by_key(|(_, n)| **n).expect("the thing has points");
    (segment, f64::from(n) / truth.iter().filter(|t| **t == thing).count() as f64)
}

#[test]
fn convexity_parts_boxes_from_the_table_and_color_parts_them_from_each_other() {
    let (points, truth) = boxes([[200, 30, 30], [30, 30, 200]]);
    let config = GeometricConfig::new(0.004);
    let by_color = SegmentedCloud::new(&points, &config).of_point();
    let found = [0, 1, 2].map(|thing| held(&by_color, &truth, thing));
    for (thing, (_, share)) in found.iter().enumerate() {
        // A box may fall into its faces: at a sharp ridge few patches have a common neighbour.
        assert!(*share > 0.6, "thing {thing}: {share:.2}");
    }
    assert!(found[0].0 != found[1].0 && found[1].0 != found[2].0 && found[0].0 != found[2].0);
    let mut majority = std::collections::BTreeMap::new();
    for (s, t) in by_color.iter().zip(&truth) {
        majority.entry(*s).or_insert([0_u32; 3])[*t as usize] += 1;
    }
    let pure: u32 = majority.values().filter_map(|counts| counts.iter().max()).sum();
    assert!(f64::from(pure) > 0.995 * truth.len() as f64, "{pure} of {} points", truth.len());
    // Without colour the flush boxes are one convex body.
    let by_shape = SegmentedCloud::new(&points, &GeometricConfig { color: None, ..config }).of_point();
    let [table, left, right] = [0, 1, 2].map(|thing| held(&by_shape, &truth, thing).0);
    assert!(table != left && left == right);
}

#[test]
fn the_same_points_give_the_same_segments_whatever_the_threads() {
    let (points, _) = boxes([[200, 30, 30], [30, 30, 200]]);
    let config = GeometricConfig::new(0.004);
    let cut = || SegmentedCloud::new(&points, &config).of_point();
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
    assert_eq!(pool(1).install(cut), pool(3).install(cut));
}

#[test]
fn clouds_without_a_surface_have_few_or_no_segments() {
    let config = GeometricConfig::new(0.005);
    let cut = |positions: Vec<[f32; 3]>| {
        let n = positions.len();
        let cut = SegmentedCloud::new(&ColoredPoints { positions, colors: Vec::new() }, &config);
        assert_eq!(cut.of_point().len(), n);
        cut.segments.count
    };
    assert_eq!(cut(Vec::new()), 0);
    assert_eq!(cut(vec![[f32::NAN; 3]; 500]), 0);
    assert!(cut(vec![[0.1, 0.0, 0.5]]) <= 1);
    assert!(cut(vec![[0.1, 0.0, 0.5]; 1000]) <= 1);
    // A line has no normals: nothing is convex, each supervoxel stays alone or joins its neighbour.
    let line = cut((0..2000).map(|i| [i as f32 * 1e-3, 0.0, 0.5]).collect());
    assert!(line <= 200, "{line}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_cloud_is_cut(
        bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 0..50),
        near in prop::collection::vec(
            prop::array::uniform3((-100_000..100_000_i32).prop_map(|k| k as f32 / 1e6)),
            0..200,
        ),
        small in 0_u32..6,
    ) {
        let mut positions: Vec<[f32; 3]> = bits.iter().map(|p| p.map(f32::from_bits)).collect();
        positions.extend(near);
        let points = ColoredPoints { colors: vec![[7; 3]; positions.len() / 2], positions };
        let mut config = GeometricConfig::new(0.01);
        config.lccp.small = small;
        config.lccp.smoothness = Some(0.1);
        let cut = SegmentedCloud::new(&points, &config);
        prop_assert!(cut.of_point().iter().all(|&s| s == NONE || s < cut.segments.count));
    }
}
