//! Time to fuse a 2.3 M point view into a model, to mark its outliers, to render it for registration, to fit normals.
//!
//! `cargo bench -p semascan-perception --bench integrate`. A seeded synthetic surface fills the whole picture, so that every
//! pixel has depth; labels come hard and as six class probabilities. A table goes to stderr, one JSON object to stdout;
//! each figure is that of the cheapest of five runs.
#![allow(clippy::print_stdout)]

#[path = "../../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;
mod synthetic;

use cpu::{Seconds, cheapest, measure};
use nalgebra::Isometry3;
use semascan_perception::fuse::{MapConfig, OutlierFilter, SemanticMap};
use semascan_perception::organized::OrganizedCloud;
use serde_json::json;
use synthetic::{Labels, SyntheticScene};

const RUNS: u32 = 5;

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
        let mut best: Option<Seconds> = None;
        let mut last = None;
        for _ in 0..RUNS {
            let mut map = empty_map();
            for view in &views[..2] {
                map.integrate(view).expect("integrates");
            }
            let (cost, done) = measure(|| map.integrate(&views[2]).expect("integrates"));
            best = Some(best.map_or(cost, |best| best.min(cost)));
            last = Some((map, done));
        }
        let ((mut map, done), best) = last.zip(best).expect("ran");
        let (voxels, chunks, made) = (map.len(), done.touched.len(), done.points_added);
        note(
            &format!("integrate_{}", labels.name()),
            json!({
                "cpu_ms": best.cpu_s * 1e3, "wall_ms": best.wall_s * 1e3,
                "points": points, "voxels": voxels, "chunks": chunks, "made": made,
            }),
        );
        if labels == Labels::Soft {
            let filter = OutlierFilter::default();
            let cost = cheapest(RUNS, || map.mark_outliers(&filter).len()).0;
            note("mark_outliers", figures(cost, "voxels", voxels));
            let pose = views[1].table_from_camera * Isometry3::translation(0.004, -0.002, 0.001);
            let k = map.model_camera(&scene.intrinsics, 0.55);
            let cost = cheapest(RUNS, || map.render(k, &pose).labels.len()).0;
            note("render", figures(cost, "pixels", (k.width * k.height) as usize));
        }
    }

    let depth = scene.depth(0);
    let cost = cheapest(RUNS, || OrganizedCloud::new(scene.intrinsics, &depth, None).normals.len()).0;
    note("normals_of_the_picture", figures(cost, "points", depth.metres.len()));
    // A disc of a tenth of the picture, as large as a part is in it.
    let ignored: Vec<bool> =
        (0..1920 * 1200).map(|i| f64::hypot((i % 1920) as f64 - 960.0, (i / 1920) as f64 - 600.0) > 270.0).collect();
    let points = ignored.iter().filter(|i| !**i).count();
    let cost = cheapest(RUNS, || OrganizedCloud::new(scene.intrinsics, &depth, Some(&ignored)).normals.len()).0;
    note("normals_of_an_object", figures(cost, "points", points));
    println!("{}", serde_json::Value::Object(report));
}

fn empty_map() -> SemanticMap {
    SemanticMap::new(MapConfig::new(0.5e-3, 6, 4)).expect("valid settings")
}

/// Milliseconds for so many of `what`.
fn figures(took: Seconds, what: &str, count: usize) -> serde_json::Value {
    json!({ "cpu_ms": took.cpu_s * 1e3, "wall_ms": took.wall_s * 1e3, what: count })
}
