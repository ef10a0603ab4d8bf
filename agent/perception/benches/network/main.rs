//! Networks at 640x480: one asked once in ONNX Runtime and in tract, and an ensemble asked about two augmentations of a
//! view, as an inspection does.
//!
//! `cargo bench -p semascan-perception --bench network -- [FOLDER] [MODEL]`. MODEL is a model's folder; without it the installed
//! model for components, or, where there is none, five networks of the compact kind with random weights. The network,
//! its input and its output are left in FOLDER for Python's onnxruntime (`rivals.py`).
#![allow(clippy::print_stdout)]

#[path = "../../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;
#[path = "../../src/segment/network/fixtures/onnx.rs"]
#[allow(dead_code)]
mod onnx;
mod synthetic;

use cpu::cheapest;
use semascan_inspection::source::{Source, SourceInfo};
use semascan_model::Taxonomy;
use semascan_perception::segment::Segmenter;
use semascan_perception::segment::network::engine::{self, Engine, EngineChoice, OnnxRuntime, Tensor};
use semascan_perception::segment::network::{
    Manifest, NetworkConfig, NetworkModel, NetworkSegmenter, Provider, Region, extended, select,
};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const RUNS: u32 = 20;
const SIZE: (usize, usize) = (640, 480);
/// Threads of a single network; an ensemble has all.
const THREADS: usize = 1;

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| !a.starts_with("--")).map(PathBuf::from);
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = arguments.next().unwrap_or_else(|| scratch.path().to_owned());
    let model = arguments.next().or_else(installed).unwrap_or_else(|| synthetic::write(&folder.join("model")));
    let manifest = Manifest::read(&model).expect("a model");
    let runtime = OnnxRuntime::open(None, Provider::Cpu).expect("ONNX Runtime: run `cargo xtask onnxruntime`");
    let mut report = json!({
        "model": manifest.name, "members": manifest.networks.len(), "threads_single": THREADS,
        "threads_ensemble": rayon::current_num_threads(), "onnxruntime": runtime.description().version,
    });
    let single = single(&runtime, &model, &manifest, Some(&folder));
    // Beside it tract, where the bench is built with it.
    if let Ok(tract) = engine::open(EngineChoice::Tract, None, Provider::Cpu) {
        let pure = self::single(tract.as_ref(), &model, &manifest, None);
        report["tract_ratio"] = json!(pure["cpu_s"].as_f64().zip(single["cpu_s"].as_f64()).map(|(t, o)| t / o));
        report["single_tract"] = pure;
    }
    report["single"] = single;
    for (name, region) in [("ensemble_whole", Region::Whole), ("ensemble_region", Region::Volume)] {
        report[name] = ensemble(&runtime, &model, region);
    }
    eprintln!("{report}");
    println!("{report}");
}

fn installed() -> Option<PathBuf> {
    select(&[], &Taxonomy::from_names::<&str>(&[], &[]))
        .ok()?
        .into_iter()
        .find(|(_, m)| m.output.tensor.is_some())
        .map(|(folder, _)| folder)
}

/// The first member alone, asked once; its file, input and output are left in `folder`.
fn single(engine: &dyn Engine, model: &Path, manifest: &Manifest, folder: Option<&Path>) -> Value {
    let file = model.join(&manifest.networks[0].file);
    let mut network = engine.load(&file, THREADS).expect("loads");
    let channels = manifest.input.channels.len();
    let data: Vec<f32> = (0..channels * SIZE.0 * SIZE.1).map(|i| (i * 7919 % 1009) as f32 / 1009.0).collect();
    let input = Tensor { shape: vec![1, channels, SIZE.1, SIZE.0], data };
    let output = manifest.output.tensor.as_deref().expect("a network that labels pixels");
    let runs = if folder.is_some() { RUNS } else { RUNS / 4 };
    network.run(&input, &[output]).expect("runs");
    let (seconds, outputs) = cheapest(runs, || network.run(&input, &[output]).expect("runs"));
    if let Some(folder) = folder {
        std::fs::copy(&file, folder.join("network.onnx")).expect("copies");
        let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        std::fs::write(folder.join("input.f32"), bytes(&input.data)).expect("writes");
        std::fs::write(folder.join("output.f32"), bytes(&outputs[0].data)).expect("writes");
        let about = json!({
            "shape": input.shape, "input": manifest.input.tensor, "output": output, "threads": THREADS, "runs": RUNS,
        });
        std::fs::write(folder.join("network.json"), about.to_string()).expect("writes");
    }
    json!(seconds)
}

/// A view from pixels to class fields: all members, two augmentations.
fn ensemble(engine: &dyn Engine, folder: &Path, region: Region) -> Value {
    let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=7&views=1&size=640x480").expect("a valid source");
    let mut cell = VirtualCell::open(&spec).expect("opens");
    let view = cell.next_view().expect("a view").expect("renders");
    let model = NetworkModel::load(folder, engine, rayon::current_num_threads()).expect("loads");
    let taxonomy = extended(&cell.info().taxonomy, &[model.manifest()]);
    let info = SourceInfo { taxonomy, ..cell.info().clone() };
    let config = NetworkConfig { region, ..NetworkConfig::default() };
    let mut segmenter = NetworkSegmenter::new(vec![model], engine.description(), &info.taxonomy, info.volume, config)
        .expect("goes together");
    segmenter.segment(&view).expect("runs");
    let (seconds, said) = cheapest(5, || segmenter.segment(&view).expect("runs"));
    let window = said.network.and_then(|n| n.window).map_or(0, |w| w.pixels());
    json!({ "cpu_s": seconds.cpu_s, "wall_s": seconds.wall_s, "pixels": window })
}
