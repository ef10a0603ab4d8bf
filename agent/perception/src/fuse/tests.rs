//! What must hold of the map whatever it is fed.

use super::{LabelledView, MapConfig, SemanticMap, Uncertain, UncertaintyRule};
use crate::organized::OrganizedCloud;
use crate::segment::{ClassField, Segmentation};
use crate::view::{DepthImage, Intrinsics};
use image::RgbImage;
use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use semascan_model::PointFlags;

const K: Intrinsics = Intrinsics { width: 80, height: 60, fx: 90.0, fy: 90.0, cx: 39.5, cy: 29.5 };

fn cloud(metres: Vec<f32>) -> OrganizedCloud {
    OrganizedCloud::new(K, &DepthImage { width: 80, height: 60, metres }, None)
}

/// A wall with a bump, left half class 1 and right half class 2.
fn view(index: u32, shift: f64) -> LabelledView {
    let pixels = 80 * 60;
    let metres = (0..pixels).map(|i| 0.5 + 0.02 * ((i % 80) as f32 * 0.2).sin()).collect();
    let labels = (0..pixels).map(|i| if i % 80 < 40 { 1 } else { 2 }).collect();
    LabelledView {
        index,
        cloud: cloud(metres),
        rgb: std::sync::Arc::new(RgbImage::from_fn(80, 60, |x, y| image::Rgb([x as u8, y as u8, 7]))),
        segmentation: Segmentation {
            components: ClassField::Hard(labels),
            defects: ClassField::Hard(vec![0; pixels]),
            instances: vec![1; pixels],
            network: None,
        },
        table_from_camera: Isometry3::new(Vector3::new(shift, 0.0, 0.0), Vector3::zeros()),
    }
}

fn map() -> SemanticMap {
    SemanticMap::new(MapConfig::new(0.008, 3, 1)).expect("valid settings")
}

fn filled() -> SemanticMap {
    let mut map = map();
    for i in 0..3 {
        map.integrate(&view(i, 0.01 * f64::from(i))).expect("integrates");
    }
    map
}

#[test]
fn one_and_many_threads_give_the_same_model() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| filled().cloud())
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn a_rebuild_with_the_same_poses_gives_the_same_model_in_a_new_epoch() {
    let mut map = filled();
    let before = map.cloud();
    let poses = map.kept_views().poses();
    map.rebuild(&poses).expect("rebuilds");
    assert_eq!(map.cloud(), before);
    assert_eq!(map.epoch(), 2);
    let moved: Vec<_> = poses.iter().map(|p| Isometry3::translation(0.1, 0.0, 0.0) * p).collect();
    map.rebuild(&moved).expect("rebuilds");
    assert_ne!(map.cloud(), before);
    assert!(map.rebuild(&poses[1..]).is_err());
}

#[test]
fn views_come_back_plain_packed_and_from_disk() {
    // A view takes 62 kB: the first limit holds them plain, the second packed, the third sends them to disk.
    let models = [1 << 20, 100_000, 0].map(|limit| {
        let mut config = MapConfig::new(0.008, 3, 1);
        config.keep_in_memory = limit;
        let mut map = SemanticMap::new(config).expect("valid settings");
        for i in 0..3 {
            map.integrate(&view(i, 0.02 * f64::from(i))).expect("integrates");
        }
        let kept = map.kept_views();
        let bytes = (kept.bytes_in_memory(), kept.bytes_on_disk());
        for i in 0..3 {
            let (depth, whole) = (kept.depth(i).expect("kept"), kept.restore(i).expect("kept"));
            assert_eq!(depth.metres.as_ref(), whole.cloud.depth);
            let (defects, measured) = (kept.defects(i).expect("kept"), whole.cloud.depth.iter().map(|z| *z > 0.0));
            assert!(measured.enumerate().all(|(k, m)| !m || defects.best(k) == whole.segmentation.defects.best(k)));
            assert_eq!((depth.index, depth.table_from_camera), (whole.index, whole.table_from_camera));
            let picture = kept.picture(i).expect("kept");
            assert_eq!((&picture.depth.metres, &picture.rgb), (&depth.metres, &whole.rgb));
            assert_eq!(picture.is_whole, limit == 1 << 20, "packed views lose what has no depth");
        }
        let poses = kept.poses();
        map.rebuild(&poses).expect("rebuilds");
        (bytes, map.cloud())
    });
    let [(plain, model), (packed, second), (spilled, third)] = models;
    assert!(plain.0 > 150_000 && plain.1 == 0, "{plain:?}");
    assert!(packed.0 > 0 && packed.0 < 100_000 && packed.1 == 0, "{packed:?}");
    assert!(spilled.0 == 0 && spilled.1 > 0, "{spilled:?}");
    assert_eq!(model, second);
    assert_eq!(model, third);
}

#[test]
fn chunks_hold_every_point_of_the_model_once() {
    let map = filled();
    let chunks: usize = map.chunk_ids().into_iter().map(|id| map.chunk(id).voxels.len()).sum();
    assert_eq!(chunks, map.len());
    assert_eq!(map.cloud().len(), map.len());
}

#[test]
fn labels_are_shares_of_the_evidence() {
    let cloud = filled().cloud();
    let inside = cloud.iter().filter(|p| p.label == 1 && p.confidence == 1.0).count();
    assert!(inside > cloud.len() / 4);
    assert!(cloud.iter().all(|p| p.views >= 1 && p.views <= 3 && (0.0..=1.0).contains(&p.confidence)));
}

#[test]
fn uncertain_pixels_give_geometry_without_evidence() {
    let mut uncertain = view(0, 0.0);
    let pixels = 80 * 60;
    uncertain.segmentation.components = ClassField::Soft {
        classes: 3,
        probabilities: (0..pixels).flat_map(|_| [0, 255, 0]).collect(),
        sigma: vec![200; pixels],
        model_sigma: Vec::new(),
    };
    let mut map = map();
    map.integrate(&uncertain).expect("integrates");
    assert!(map.cloud().iter().all(|p| p.label == 0 && p.flags.has(PointFlags::UNLABELLED) && p.sigma > 0.7));
}

#[test]
fn dropped_pixels_move_nothing_and_mark_what_they_alone_have_seen() {
    let mut rule = UncertaintyRule { threshold: 0.4, uncertain: Uncertain::Drop, ..UncertaintyRule::default() };
    let with = |rule: UncertaintyRule, sigma: u8| {
        let mut config = map().config().clone();
        config.uncertainty = rule;
        let mut map = SemanticMap::new(config).expect("in range");
        let mut first = view(0, 0.0);
        let pixels = first.segmentation.instances.len();
        let soft = |sigma: u8| ClassField::Soft {
            classes: 3,
            probabilities: (0..pixels).flat_map(|_| [0, 255, 0]).collect(),
            sigma: vec![sigma; pixels],
            model_sigma: Vec::new(),
        };
        first.segmentation.components = soft(0);
        map.integrate(&first).expect("integrates");
        // The same surface from a little aside, of which only a part was seen before.
        let mut second = view(1, 0.004);
        second.segmentation.components = soft(sigma);
        map.integrate(&second).expect("integrates");
        map.cloud()
    };
    let (kept, dropped) = (with(UncertaintyRule { uncertain: Uncertain::Geometry, ..rule }, 150), with(rule, 150));
    let marked = dropped.iter().filter(|p| p.flags.has(PointFlags::UNCERTAIN)).count();
    assert_eq!(kept.len(), dropped.len(), "completeness needs the points that are dropped");
    assert!(kept.iter().all(|p| !p.flags.has(PointFlags::UNCERTAIN)));
    assert!(marked > 20 && marked < dropped.len() / 2, "{marked} of {}", dropped.len());
    let moved = |a: [f32; 3], b: [f32; 3]| (0..3).any(|i| (a[i] - b[i]).abs() > 1e-6);
    let alone = with(rule, 0);
    assert!(alone.iter().all(|p| !p.flags.has(PointFlags::UNCERTAIN)));
    for (p, q) in dropped.iter().zip(kept.iter()) {
        assert_eq!(p.flags.has(PointFlags::UNCERTAIN), p.confidence == 0.0);
        assert_eq!(p.confidence, q.confidence, "neither way gives evidence");
    }
    assert!(dropped.iter().zip(kept.iter()).any(|(p, q)| moved(p.position, q.position)), "kept pixels move voxels");
    rule.threshold = f32::NAN;
    let mut config = map().config().clone();
    config.uncertainty = rule;
    assert!(SemanticMap::new(config).expect_err("no threshold").to_string().contains("uncertainty"));
}

#[test]
fn views_that_do_not_fit_together_are_refused_and_leave_no_trace() {
    let mut bad = view(4, 0.0);
    bad.rgb = RgbImage::new(10, 10).into();
    let mut empty = view(5, 0.0);
    empty.cloud = cloud(vec![0.0; 80 * 60]);
    let mut map = map();
    assert!(map.integrate(&bad).expect_err("size").to_string().contains("view 4"));
    assert!(map.integrate(&empty).expect_err("empty").to_string().contains("view 5"));
    assert!(map.is_empty() && map.kept_views().is_empty());
    assert!(SemanticMap::new(MapConfig::new(f64::NAN, 3, 1)).is_err());
}

#[test]
fn a_stray_point_is_marked_and_kept() {
    let mut stray = view(0, 0.0);
    // A lone pixel half way to the wall, everything around it masked out.
    let mut metres = stray.cloud.depth;
    for (i, z) in metres.iter_mut().enumerate() {
        let (u, v) = (i % 80, i / 80);
        if u.abs_diff(10) < 6 && v.abs_diff(10) < 6 {
            *z = if (u, v) == (10, 10) { 0.25 } else { 0.0 };
        }
    }
    stray.cloud = cloud(metres);
    let mut map = map();
    map.integrate(&stray).expect("integrates");
    let before = map.len();
    let changed = map.mark_outliers(&super::OutlierFilter::default());
    assert!(!changed.is_empty());
    assert_eq!(map.len(), before);
    let cloud = map.cloud();
    let marked: Vec<_> = cloud.iter().filter(|p| p.flags.has(PointFlags::OUTLIER)).collect();
    assert!(marked.iter().any(|p| p.position[2] < 0.3), "the stray point is marked");
    assert!(marked.len() < cloud.len() / 20, "{} of {} marked", marked.len(), cloud.len());
    assert!(map.mark_outliers(&super::OutlierFilter::default()).is_empty(), "marking again changes nothing");
}

/// A wall 1 m away with a step of 60 mm in its middle, seen with depth noise of `noise` metres.
fn noisy_step(index: u32, noise: f32) -> LabelledView {
    let mut random = rand_pcg::Pcg32::seed_from_u64(u64::from(index));
    let mut normal = || (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
    let metres = (0..80 * 60).map(|i| if i % 80 < 40 { 1.0 } else { 1.06 } + noise * normal()).collect();
    LabelledView { cloud: cloud(metres), ..view(index, 0.0) }
}

fn map_of_steps(noise: f32) -> SemanticMap {
    let mut map = map();
    for i in 0..12 {
        map.integrate(&noisy_step(i, noise)).expect("integrates");
    }
    map
}

/// Mean and largest distance of the points that are not left out from the nearer of the two walls, and their number.
fn off_the_walls(map: &SemanticMap) -> (f32, f32, usize) {
    let cloud = map.cloud();
    let kept = cloud.positions.iter().zip(&cloud.flags).filter(|(_, flags)| !flags.has(PointFlags::LEFT_OUT));
    let off: Vec<f32> = kept.map(|(p, _)| (p[2] - 1.0).abs().min((p[2] - 1.06).abs())).collect();
    (off.iter().sum::<f32>() / off.len() as f32, off.iter().copied().fold(0.0, f32::max), off.len())
}

#[test]
fn a_noisy_surface_becomes_one_layer_and_a_step_stays() {
    let mut map = map_of_steps(0.012);
    let (mean, _, count) = off_the_walls(&map);
    let classes = map.config.components + map.config.defects;
    let evidence = |map: &SemanticMap| -> f32 {
        let of =
            |b: &super::brick::Brick| (0..b.voxels.len()).map(|s| b.evidence(s, classes).iter().sum::<f32>()).sum();
        map.bricks.iter().map(|b| -> f32 { of(b) }).sum()
    };
    let before = evidence(&map);
    let changed = map.finish(&super::OutlierFilter::default());
    assert!(!changed.is_empty());
    assert!((evidence(&map) / before - 1.0).abs() < 1e-4, "evidence moves, none is lost");
    let (thin, _, left) = off_the_walls(&map);
    assert!(thin < 0.6 * mean, "{thin} m off on the mean, {mean} before");
    assert!(left < 2 * count / 3, "{left} points, {count} before");
    let cloud = map.cloud();
    for (p, label) in cloud.positions.iter().zip(&cloud.labels) {
        // Two voxels beside the step belong to either.
        if p[0].abs() > 0.016 {
            assert_eq!(*label, if p[0] < 0.0 { 1 } else { 2 }, "at {p:?}");
        }
    }
    assert!(map.consolidate().is_empty(), "once is enough");
}

#[test]
fn views_go_into_a_surface_that_was_made_thin() {
    let mut map = map_of_steps(0.012);
    map.consolidate();
    let thin = map.len();
    for i in 12..24 {
        map.integrate(&noisy_step(i, 0.012)).expect("integrates");
    }
    map.finish(&super::OutlierFilter::default());
    assert!(map.len() < thin + thin / 3, "{} voxels, {thin} half-way", map.len());
    assert!(map.cloud().views.iter().all(|views| *views <= 24));
}

#[test]
fn a_map_that_is_too_large_for_the_time_stays_thick_and_says_so() {
    let filter = super::OutlierFilter::default();
    let mut map = map_of_steps(0.012);
    let voxels = map.len();
    let (marked, thinned) = map.finish_in_short_time(&filter, voxels - 1);
    assert!(!thinned && map.len() == voxels && !marked.is_empty());
    let (_, thinned) = map.finish_in_short_time(&filter, voxels);
    assert!(thinned && map.len() < 2 * voxels / 3, "{} of {voxels} voxels", map.len());
}

#[test]
fn a_quiet_surface_does_not_move() {
    let mut map = map_of_steps(0.001);
    let before = map.cloud();
    assert!(map.consolidate().is_empty());
    assert_eq!(map.cloud(), before);
}

#[test]
fn a_noisy_surface_is_the_same_on_one_and_many_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| {
            let mut map = map_of_steps(0.012);
            map.finish(&super::OutlierFilter::default());
            map.cloud()
        })
    };
    assert_eq!(run(1), run(4));
}
