//! Metrics of 500 k points against 500 k points both ways, and of 500 k points against a mesh of 173 k triangles.
//!
//! `cargo bench -p semascan-geometry --bench metrics -- [FOLDER]`; with a folder, the inputs are left there for
//! `rivals.py`, which measures Open3D on them. Indices are built anew in each run. One JSON object goes to stdout, a
//! table to stderr.
#![allow(clippy::print_stdout)]

mod cpu;
mod part;

use cpu::cheapest;
use semascan_geometry::measure::{Comparison, NearestPoints, OneWay, SurfaceIndex};
use std::path::Path;

/// Points of each cloud.
const POINTS: usize = 500_000;
/// Distance of precision and recall, metres.
const TAU: f64 = 1e-3;

fn main() {
    let part = part::part(434, 200);
    let (a, b) = (part.sample(POINTS, 0.0, 1), part.sample(POINTS, 1e-4, 2));
    if let Some(folder) = std::env::args().skip(1).find(|a| !a.starts_with("--")) {
        leave(Path::new(&folder), &part, &a, &b).expect("the inputs can be written");
    }
    let clouds = || Comparison::of_clouds(&NearestPoints::new(&a), &NearestPoints::new(&b), TAU).expect("points");
    let surface = || -> Vec<f64> {
        let index = SurfaceIndex::new(&part.positions, &part.triangles);
        index.closest_of_all(&b).iter().map(|n| n.map_or(f64::NAN, |n| f64::from(n.distance))).collect()
    };
    let index = || NearestPoints::new(&b);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (clouds_1, comparison) = one.install(|| cheapest(5, clouds));
    let (surface_1, distances) = one.install(|| cheapest(5, surface));
    let (index_1, built) = one.install(|| cheapest(5, index));
    let (neighbourhoods_1, _) = one.install(|| cheapest(2, || built.neighbourhoods(20)));
    let (clouds_all, _) = cheapest(5, clouds);
    let (surface_all, _) = cheapest(5, surface);
    let to_mesh = OneWay::of(&distances).expect("points");
    eprintln!("{POINTS} against {POINTS} points, both ways: {clouds_1:?} on one thread, {clouds_all:?} on all");
    eprintln!(
        "{POINTS} points against {} triangles: {surface_1:?} on one thread, {surface_all:?} on all",
        part.triangles.len()
    );
    eprintln!("index of {POINTS} points: {index_1:?}; 20 neighbours of each: {neighbourhoods_1:?}, one thread");
    println!(
        "{}",
        serde_json::json!({
            "points": POINTS, "triangles": part.triangles.len(),
            "clouds": { "one_thread": clouds_1, "all_threads": clouds_all, "metrics": comparison },
            "mesh": { "one_thread": surface_1, "all_threads": surface_all, "metrics": to_mesh },
            "index": index_1, "neighbourhoods_20": neighbourhoods_1,
        })
    );
}

/// Writes the inputs as raw little-endian numbers.
fn leave(folder: &Path, part: &part::Part, a: &[[f32; 3]], b: &[[f32; 3]]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for (name, points) in [("a.f32", a), ("b.f32", b), ("positions.f32", &part.positions)] {
        std::fs::write(folder.join(name), bytemuck::cast_slice(points))?;
    }
    std::fs::write(folder.join("triangles.u32"), bytemuck::cast_slice(&part.triangles))
}
