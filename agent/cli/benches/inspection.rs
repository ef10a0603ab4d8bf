//! A whole inspection as a cell does it: five recorded views at 640x480, segmented by the installed networks, registered,
//! fused and meshed; from the start of the program, which reads the first byte, to `mesh.ply` and to the end.
//!
//! `cargo bench -p semascan-cli --bench inspection`. The recording is of a simulated motor that no network was trained
//! on. [Remanufacturing paper] takes 15 to 20 s, its robot's motion included.
#![allow(clippy::print_stdout)]

use nalgebra::Isometry3;
use semascan_inspection::source::Source;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_sources::bop::SceneWriter;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;
use std::time::{Instant, SystemTime};

const MOTOR: &str = "virtual:starter-motor?seed=1001&views=5&size=640x480";
const RUNS: usize = 3;

fn main() {
    let scratch = tempfile::tempdir().expect("a folder");
    let recording = scratch.path().join("recording");
    record(&recording);
    let mut runs: Vec<(f64, f64, Value)> =
        (0..RUNS).map(|_| inspect(&recording, &scratch.path().join("out"))).collect();
    runs.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (to_mesh, to_end, record) = &runs[RUNS / 2];
    let figures = json!({
        "views": 5, "threads": std::thread::available_parallelism().map_or(1, usize::from),
        "engine": record["segmentation"]["engine"], "models": names(record),
        "to_mesh_s": to_mesh, "to_end_s": to_end, "stages_s": stages(record),
    });
    println!("{figures}");
}

/// Writes the motor's views as a recording without labels.
fn record(folder: &Path) {
    let cell = VirtualCell::open(&VirtualCellSpec::parse(MOTOR).expect("a valid source")).expect("opens");
    let scene = SceneWriter::create(folder, &cell.info().taxonomy, Isometry3::identity()).expect("a folder");
    let view = |index| {
        let mut view = cell.view(index).expect("a view");
        view.labels = None;
        scene.write(&view).expect("writes")
    };
    let entries: Vec<_> = (0..5).map(view).collect();
    scene.finish(&entries).expect("writes");
}

/// Seconds from the start to the mesh and to the end, and the record.
fn inspect(recording: &Path, out: &Path) -> (f64, f64, Value) {
    let (start, began) = (Instant::now(), SystemTime::now());
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    let output = command
        .arg("inspect")
        .arg(recording)
        .args(["--labels", "network", "--json", "--overwrite", "--out"])
        .arg(out)
        .output();
    let (to_end, output) = (start.elapsed().as_secs_f64(), output.expect("starts"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let written = out.join("mesh.ply").metadata().and_then(|m| m.modified()).expect("a mesh");
    let to_mesh = written.duration_since(began).expect("a clock that goes forward").as_secs_f64();
    (to_mesh, to_end, serde_json::from_slice(&output.stdout).expect("a record"))
}

/// Seconds of each stage, all views together; stages of different views overlap.
fn stages(record: &Value) -> Value {
    let mut sums = serde_json::Map::new();
    for time in record["views"].as_array().into_iter().flatten().flat_map(|v| v["timings"].as_array()).flatten() {
        let (Some(stage), Some(seconds)) = (time["stage"].as_str(), time["seconds"].as_f64()) else { continue };
        let sum = sums.get(stage).and_then(Value::as_f64).unwrap_or(0.0) + seconds;
        sums.insert(stage.to_owned(), json!(sum));
    }
    Value::Object(sums)
}

fn names(record: &Value) -> Vec<Value> {
    record["segmentation"]["models"].as_array().into_iter().flatten().map(|m| m["name"].clone()).collect()
}
