//! Two 1920x1200 views of a starter motor, 30 degrees apart, aligned as unorganized clouds: GICP from the kinematic
//! prior, and global registration from nothing. Everything that it needs is counted: thinning, normals, index, alignment.
//!
//! `cargo bench -p semascan-perception --bench gicp -- [FOLDER]`; with a folder, the clouds are left there for `rivals.py`,
//! which measures small_gicp on them at the same voxel size. One JSON object goes to stdout, a table to stderr.
#![allow(clippy::print_stdout)]

#[path = "../../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;

use cpu::cheapest;
use nalgebra::{Isometry3, Point3};
use semascan_perception::register::gicp::{GicpConfig, align};
use semascan_perception::register::global::{CloudInput, GlobalConfig, register_globally};
use semascan_perception::register::{Facing, SurfelCloud};
use semascan_perception::view::{PoseEvidence, View};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde_json::json;
use std::path::Path;

/// Edge of the grid, metres.
const VOXEL: f64 = 1e-3;
/// Neighbours of a normal.
const NEIGHBOURS: usize = 10;
/// Farthest partners, metres.
const REACH: f64 = 5e-3;

fn main() {
    let uri = "virtual:starter-motor?seed=7&views=12&size=1920x1200&noise=zivid";
    let cell = VirtualCell::open(&VirtualCellSpec::parse(uri).expect("a valid URI")).expect("a motor needs no file");
    let [target, source] = [3, 4].map(|i| cell.view(i).expect("a view"));
    let (q, p) = (points(&target), points(&source));
    let truth = pose(&target, true).inverse() * pose(&source, true);
    let prior = pose(&target, false).inverse() * pose(&source, false);
    let middle = Point3::from(
        p.iter().map(|c| Point3::from(c.map(f64::from)).coords).sum::<nalgebra::Vector3<f64>>() / p.len() as f64,
    );
    if let Some(folder) = std::env::args().skip(1).find(|a| !a.starts_with("--")) {
        leave(Path::new(&folder), &q, &p, &prior, &truth).expect("the inputs can be written");
    }
    let facing = Facing::From(Point3::origin());
    let surfels = |points: &[[f32; 3]]| SurfelCloud::new(points, facing, VOXEL, NEIGHBOURS).expect("a surface");
    let local = || align(&surfels(&p), &surfels(&q), &prior, &GicpConfig::within(REACH)).expect("aligned");
    let input = |points| CloudInput { points, facing };
    let global = || register_globally(&input(&p), &input(&q), &GlobalConfig::default()).expect("a match");
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (local_1, fit) = one.install(|| cheapest(5, local));
    let (prepared_1, clouds) = one.install(|| cheapest(5, || (surfels(&p), surfels(&q))));
    let (global_1, found) = one.install(|| cheapest(2, global));
    let (local_all, _) = cheapest(5, local);
    let error = |pose: &Isometry3<f64>| {
        let turn = pose.rotation.angle_to(&truth.rotation).to_degrees();
        json!({ "deg": turn, "mm_at_centroid": (pose * middle - truth * middle).norm() * 1e3 })
    };
    let report = json!({
        "source_points": p.len(), "target_points": q.len(), "voxel_m": VOXEL, "source_surfels": clouds.0.points.len(),
        "prior_error": error(&prior),
        "gicp": {
            "one_thread": local_1, "all_threads": local_all, "preparation_one_thread": prepared_1,
            "iterations": fit.iterations, "error": error(&fit.target_from_source),
        },
        "global": {
            "one_thread": global_1, "voxel_m": found.voxel, "overlap": found.overlap,
            "error": error(&found.target_from_source),
        },
    });
    eprintln!("{report:#}");
    println!("{report}");
}

/// Points of the motor in the camera frame, row-major.
fn points(view: &View) -> Vec<[f32; 3]> {
    let labels = &view.labels.as_ref().expect("the cell labels its views").components;
    let width = view.depth.width;
    let depth = view.depth.metres.iter().zip(labels).enumerate();
    depth
        .filter(|(_, (z, label))| **z > 0.0 && **label > 0)
        .map(|(i, (z, _))| {
            let (u, v) = (i as u32 % width, i as u32 / width);
            let p = view.intrinsics.unproject(u.into(), v.into(), f64::from(*z));
            [p.x as f32, p.y as f32, p.z as f32]
        })
        .collect()
}

fn pose(view: &View, truth: bool) -> Isometry3<f64> {
    match &view.pose {
        PoseEvidence::Chain { chain, .. } if !truth => chain.table_from_camera(),
        _ => view.truth.as_ref().expect("the cell knows the truth").table_from_camera,
    }
}

/// Writes the clouds and poses as raw little-endian numbers; matrices row by row.
fn leave(
    folder: &Path,
    target: &[[f32; 3]],
    source: &[[f32; 3]],
    prior: &Isometry3<f64>,
    truth: &Isometry3<f64>,
) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for (name, points) in [("target.f32", target), ("source.f32", source)] {
        let bytes: Vec<u8> = points.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        std::fs::write(folder.join(name), bytes)?;
    }
    for (name, pose) in [("prior.f64", prior), ("truth.f64", truth)] {
        let bytes: Vec<u8> = pose.to_homogeneous().transpose().iter().flat_map(|c| c.to_le_bytes()).collect();
        std::fs::write(folder.join(name), bytes)?;
    }
    Ok(())
}
