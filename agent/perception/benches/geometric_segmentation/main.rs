//! Supervoxels and LCCP / LCCCP beside PCL's, on the same clouds with the same parameters.
//!
//! `cargo bench -p semascan-perception --bench geometric_segmentation -- [PCL_PROGRAM]`, where PCL_PROGRAM is
//! `pcl_segmentation.cpp`, compiled (`cargo xtask bench` does it); without it ours alone is measured. Clouds are the
//! labelled ones of `SEMASCAN_DATA`, or a view of the virtual cell. Times are CPU time of the cheapest of several runs,
//! each from the points in memory to the segment of every supervoxel. A table goes to stderr, one JSON object to stdout.
#![allow(clippy::print_stdout)]

#[path = "../../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;

use cpu::cheapest;
use semascan_evaluation::{PartitionScore, compare_partitions};
use semascan_formats::offset::single;
use semascan_formats::pcd;
use semascan_inspection::source::Source;
use semascan_perception::segment::geometric::lcccp::ColorCriterion;
use semascan_perception::segment::geometric::lccp::LccpConfig;
use semascan_perception::segment::geometric::vccs::VccsConfig;
use semascan_perception::segment::geometric::{ColoredPoints, GeometricConfig, NONE, SegmentedCloud};
use semascan_simulation as virtual_cell;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs of which the cheapest counts.
const REPEATS: u32 = 9;

/// PCL's common settings for tabletop scenes.
fn vccs() -> VccsConfig {
    VccsConfig { voxel: 0.0075, seed: 0.03, color: 0.0, spatial: 1.0, normal: 4.0, refinements: 0 }
}

/// A cloud with its true regions.
struct Scene {
    name: String,
    width: u32,
    height: u32,
    points: ColoredPoints,
    truth: Vec<Option<u32>>,
}

fn main() {
    let pcl = std::env::args().skip(1).find(|a| !a.starts_with("--")).map(PathBuf::from);
    let mut report = serde_json::Map::new();
    for scene in scenes() {
        report.insert(scene.name.clone(), measure(&scene, pcl.as_deref()));
    }
    println!("{}", Value::Object(report));
}

fn scenes() -> Vec<Scene> {
    let Some(data) = std::env::var_os("SEMASCAN_DATA") else {
        eprintln!("SEMASCAN_DATA is not set: measuring a view of the virtual cell");
        return vec![virtual_scene()];
    };
    let folder = Path::new(&data).join("point-clouds/tabletop-labelled");
    ["learn0", "learn9", "learn17"].iter().map(|name| labelled(&folder, name)).collect()
}

fn labelled(folder: &Path, name: &str) -> Scene {
    let cloud = pcd::read_file(&folder.join(format!("{name}.pcd"))).expect("a labelled cloud");
    let labels = cloud.labels.expect("the cloud has labels");
    Scene {
        name: name.to_owned(),
        width: cloud.width,
        height: cloud.height,
        points: ColoredPoints {
            positions: single(&cloud.positions),
            colors: cloud.colors.expect("the cloud has colours"),
        },
        // Label 0 marks points that are not there.
        truth: labels.iter().map(|&l| (l != 0).then_some(l)).collect(),
    }
}

fn virtual_scene() -> Scene {
    let uri = "virtual:starter-motor?seed=7&views=1&size=640x480";
    let spec = virtual_cell::VirtualCellSpec::parse(uri).expect("a valid URI");
    let mut cell = virtual_cell::VirtualCell::open(&spec).expect("needs no file");
    let view = cell.next_view().expect("a view").expect("renders");
    let points = ColoredPoints::of_depth(&view.intrinsics, &view.depth.metres, &view.rgb);
    let labels = view.labels.as_ref().expect("the cell knows the labels").components.clone();
    Scene {
        name: "virtual starter motor".into(),
        width: view.depth.width,
        height: view.depth.height,
        truth: labels.iter().map(|&l| Some(l.into())).collect(),
        points,
    }
}

fn measure(scene: &Scene, pcl: Option<&Path>) -> Value {
    let lccp = GeometricConfig { vccs: vccs(), lccp: LccpConfig::default(), color: None };
    let lcccp = GeometricConfig { color: Some(ColorCriterion::default()), ..lccp };
    let (lccp_took, ours) = cheapest(REPEATS, || SegmentedCloud::new(&scene.points, &lccp));
    let (lcccp_took, colored) = cheapest(REPEATS, || SegmentedCloud::new(&scene.points, &lcccp));
    let [lccp_ms, lcccp_ms] = [lccp_took, lcccp_took].map(|took| took.cpu_s * 1e3);
    let (segments, colored_segments) = (known(ours.of_point()), known(colored.of_point()));
    let (score, colored_score) =
        (compare_partitions(&segments, &scene.truth), compare_partitions(&colored_segments, &scene.truth));
    eprintln!("{} ({}x{}, {} points)", scene.name, scene.width, scene.height, score.points);
    row("ours, LCCP", lccp_ms, &score);
    row("ours, LCCCP", lcccp_ms, &colored_score);
    let mut report = json!({
        "ours_lccp": figures(lccp_ms, &score),
        "ours_lcccp": figures(lcccp_ms, &colored_score),
        "supervoxels": ours.supervoxels.patches.len(),
    });
    let Some(program) = pcl else { return report };
    let rival = run_pcl(program, scene);
    let pcl_score = compare_partitions(&rival.segments, &scene.truth);
    row(&format!("PCL {}", rival.version), rival.cpu_ms, &pcl_score);
    let (same_supervoxels, same_segments) = (
        compare_partitions(&known(ours.supervoxels.of_point), &rival.supervoxels).adjusted_rand,
        compare_partitions(&segments, &rival.segments).adjusted_rand,
    );
    let speed = rival.cpu_ms / lcccp_ms;
    eprintln!(
        "  VCCS + LCCCP takes {speed:.1} times less CPU than PCL's VCCS + LCCP; adjusted Rand index of our segments \
         against PCL's {same_segments:.3}, of the supervoxels {same_supervoxels:.3}"
    );
    let added = json!({
        "pcl_version": rival.version,
        "pcl_lccp": figures(rival.cpu_ms, &pcl_score),
        "pcl_supervoxels": rival.count,
        "adjusted_rand_against_pcl": same_segments,
        "adjusted_rand_of_supervoxels": same_supervoxels,
        "times_less_cpu_than_pcl": speed,
    });
    if let (Some(report), Value::Object(added)) = (report.as_object_mut(), added) {
        report.extend(added);
    }
    report
}

fn known(labels: Vec<u32>) -> Vec<Option<u32>> {
    labels.into_iter().map(|l| (l != NONE).then_some(l)).collect()
}

fn figures(cpu_ms: f64, score: &PartitionScore) -> Value {
    json!({
        "cpu_ms": cpu_ms, "segments": score.segments, "over_segmentation": score.over_segmentation,
        "under_segmentation": score.under_segmentation, "adjusted_rand_against_labels": score.adjusted_rand,
    })
}

fn row(name: &str, cpu_ms: f64, score: &PartitionScore) {
    eprintln!(
        "  {name:<12} {cpu_ms:>8.1} ms CPU  {:>5} segments  over {:>6.2} %  under {:>6.2} %  ARI to labels {:.3}",
        score.segments,
        score.over_segmentation * 100.0,
        score.under_segmentation * 100.0,
        score.adjusted_rand
    );
}

struct Rival {
    version: String,
    cpu_ms: f64,
    count: u64,
    supervoxels: Vec<Option<u32>>,
    segments: Vec<Option<u32>>,
}

/// PCL on the same points: see `pcl_segmentation.cpp` for the files.
fn run_pcl(program: &Path, scene: &Scene) -> Rival {
    let folder = tempfile::tempdir().expect("a folder");
    let (cloud, labels) = (folder.path().join("cloud"), folder.path().join("labels"));
    let mut bytes: Vec<u8> = [scene.width, scene.height].iter().flat_map(|n| n.to_le_bytes()).collect();
    for (p, [r, g, b]) in scene.points.positions.iter().zip(&scene.points.colors) {
        p.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend([*b, *g, *r, 0]);
    }
    std::fs::write(&cloud, bytes).expect("writes the cloud");
    let (v, l) = (vccs(), LccpConfig::default());
    let tolerance = l.concavity_tolerance.to_degrees();
    let settings = [v.voxel, v.seed, v.color, v.spatial, v.normal, tolerance].map(|x| x.to_string());
    let output = Command::new(program)
        .args([&cloud, &labels])
        .args(settings)
        .args([l.k, u32::from(l.sanity)].map(|x| x.to_string()))
        .args([l.smoothness.unwrap_or(-1.0).to_string(), l.small.to_string(), REPEATS.to_string()])
        .output()
        .expect("PCL's program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).expect("PCL's program prints JSON");
    let found: Vec<Option<u32>> = std::fs::read(&labels)
        .expect("PCL's labels")
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| Some(u32::from_le_bytes(*b)).filter(|&l| l != 0))
        .collect();
    let (supervoxels, segments) = found.split_at(scene.points.len());
    Rival {
        version: said["version"].as_str().unwrap_or_default().to_owned(),
        cpu_ms: said["cpu_ms"].as_f64().expect("a time"),
        count: said["supervoxels"].as_u64().expect("a number"),
        supervoxels: supervoxels.to_vec(),
        segments: segments.to_vec(),
    }
}
