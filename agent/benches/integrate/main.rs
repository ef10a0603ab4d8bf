//! Time to fuse a 2.3 M point view into a model, to mark its outliers, to render it for registration, to fit normals.
//!
//! `cargo bench -p semascan-agent --bench integrate`. A seeded synthetic surface fills the whole picture, so that every
//! pixel has depth; labels come hard and as six class probabilities. A table goes to stderr, one JSON object to stdout;
//! each figure is that of the cheapest of five runs.
#![allow(clippy::print_stdout)]

mod synthetic;

use nalgebra::Isometry3;
use semascan_agent::fuse::{MapConfig, OutlierFilter, SemanticMap};
use semascan_agent::register::OrganizedCloud;
use serde_json::json;
use std::time::Instant;
use synthetic::{Labels, SyntheticScene};

const RUNS: usize = 5;

fn main() {
    let scene = SyntheticScene::new(7, 1920, 1200);
    let mut report = serde_json::Map::new();
    report.insert("threads".into(), rayon::current_num_threads().into());
    let mut note = |name: &str, figures: serde_json::Value| {
        eprintln!("{name}: {figures}");
        report.insert(name.into(), figures);
    };

    for labels in [Labels::Hard, Labels::Soft] {
        let views: Vec<_> = (0..3).map(|i| scene.view(i, labels)).collect();
        let points = views[2].cloud.len();
        let mut best = Cost::WORST;
        let mut last = None;
        for _ in 0..RUNS {
            let mut map = empty_map();
            for view in &views[..2] {
                map.integrate(view).expect("integrates");
            }
            let (cost, done) = Cost::of(|| map.integrate(&views[2]).expect("integrates"));
            best = best.min(cost);
            last = Some((map, done));
        }
        let (mut map, done) = last.expect("ran");
        let (voxels, chunks, made) = (map.len(), done.touched.len(), done.points_added);
        note(
            &format!("integrate_{}", labels.name()),
            json!({ "cpu_ms": best.cpu, "wall_ms": best.wall, "points": points, "voxels": voxels, "chunks": chunks, "made": made }),
        );
        if labels == Labels::Soft {
            let filter = OutlierFilter::default();
            let cost = Cost::least(|| map.mark_outliers(&filter).len());
            note("mark_outliers", json!({ "cpu_ms": cost.cpu, "wall_ms": cost.wall, "voxels": voxels }));
            let pose = views[1].table_from_camera * Isometry3::translation(0.004, -0.002, 0.001);
            let k = map.model_camera(&scene.intrinsics, 0.55);
            let cost = Cost::least(|| map.render(k, &pose).labels.len());
            note("render", json!({ "cpu_ms": cost.cpu, "wall_ms": cost.wall, "voxels": voxels, "width": k.width }));
        }
    }

    let depth = scene.depth(0);
    let cost = Cost::least(|| OrganizedCloud::new(scene.intrinsics, &depth, None).normals.len());
    note("normals_of_the_picture", json!({ "cpu_ms": cost.cpu, "wall_ms": cost.wall, "points": depth.metres.len() }));
    // A disc of a tenth of the picture, as large as a part is in it.
    let ignored: Vec<bool> =
        (0..1920 * 1200).map(|i| f64::hypot((i % 1920) as f64 - 960.0, (i / 1920) as f64 - 600.0) > 270.0).collect();
    let points = ignored.iter().filter(|i| !**i).count();
    let cost = Cost::least(|| OrganizedCloud::new(scene.intrinsics, &depth, Some(&ignored)).normals.len());
    note("normals_of_an_object", json!({ "cpu_ms": cost.cpu, "wall_ms": cost.wall, "points": points }));
    println!("{}", serde_json::Value::Object(report));
}

fn empty_map() -> SemanticMap {
    SemanticMap::new(MapConfig::new(0.5e-3, 6, 4)).expect("valid settings")
}

/// Milliseconds of all threads together, and on the wall.
#[derive(Clone, Copy)]
struct Cost {
    cpu: f64,
    wall: f64,
}

impl Cost {
    const WORST: Self = Self { cpu: f64::INFINITY, wall: f64::INFINITY };

    fn of<T>(work: impl FnOnce() -> T) -> (Self, T) {
        let (cpu, wall) = (synthetic::cpu_seconds(), Instant::now());
        let result = work();
        let wall = wall.elapsed().as_secs_f64();
        let cpu = cpu.zip(synthetic::cpu_seconds()).map_or(wall, |(start, end)| end - start);
        (Self { cpu: cpu * 1e3, wall: wall * 1e3 }, result)
    }

    fn min(self, other: Self) -> Self {
        Self { cpu: self.cpu.min(other.cpu), wall: self.wall.min(other.wall) }
    }

    fn least<T>(mut work: impl FnMut() -> T) -> Self {
        (0..RUNS).fold(Self::WORST, |best, _| best.min(Self::of(&mut work).0))
    }
}
