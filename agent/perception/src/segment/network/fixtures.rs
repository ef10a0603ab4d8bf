//! Models for tests: folders with a manifest and tiny networks. Other crates' tests take this file in by its path.

#[path = "fixtures/onnx.rs"]
pub(crate) mod onnx;

use image::{Rgb, RgbImage};
use semascan_perception::segment::network::engine::{Engine, EngineChoice, EngineError, OnnxRuntime, Provider, open};
use semascan_perception::segment::network::{FILE_NAME, Manifest, NetworkFile};
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, View};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A manifest for colour classifiers (see [`onnx::classifier`]) of `task` and `classes`, without files.
pub(crate) fn manifest(task: &str, classes: &[&str]) -> Manifest {
    let output = match task {
        "instance" => "centres = \"centres\"\noffsets = \"offsets\"",
        _ => "tensor = \"probabilities\"",
    };
    let classes: String = classes
        .iter()
        .enumerate()
        .map(|(i, name)| format!("[[classes]]\nname = \"{name}\"\ncolour = \"#{i:02x}{i:02x}{i:02x}\"\n"))
        .collect();
    let text = format!(
        "schema = 1\nname = \"fixture\"\nversion = \"1\"\ntask = \"{task}\"\nfusion = \"none\"\nlicence = \"MIT\"\n\
         [[network]]\nfile = \"member-0.onnx\"\nsha256 = \"{:064}\"\n\
         [input]\ntensor = \"image\"\nchannels = [\"red\", \"green\", \"blue\"]\n\
         [input.colour]\nmean = [0, 0, 0]\nstd = [1, 1, 1]\n[output]\n{output}\n{classes}",
        0
    );
    Manifest::parse(&text).expect("a right manifest")
}

/// Writes a model: the manifest with the names and checksums of `networks`, and these.
pub(crate) fn write(folder: &Path, mut manifest: Manifest, networks: &[Vec<u8>]) -> PathBuf {
    std::fs::create_dir_all(folder).expect("a folder");
    manifest.networks = networks
        .iter()
        .enumerate()
        .map(|(i, bytes)| {
            let file = format!("member-{i}.onnx");
            std::fs::write(folder.join(&file), bytes).expect("writes");
            let sha256 = Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
            NetworkFile { file, sha256 }
        })
        .collect();
    std::fs::write(folder.join(FILE_NAME), toml::to_string(&manifest).expect("writes")).expect("writes");
    folder.to_owned()
}

/// The engines there are: ONNX Runtime where it is found, tract where it is built in; at least one.
pub(crate) fn engines() -> Vec<Box<dyn Engine>> {
    let mut engines: Vec<Box<dyn Engine>> = Vec::new();
    match OnnxRuntime::open(None, Provider::Cpu) {
        Ok(runtime) => engines.push(Box::new(runtime)),
        Err(EngineError::NotFound { .. }) => eprintln!("SKIPPED: ONNX Runtime is not there"),
        Err(error) => panic!("{error}"),
    }
    match open(EngineChoice::Tract, None, Provider::Cpu) {
        Ok(tract) => engines.push(tract),
        Err(EngineError::NotBuilt(_)) => eprintln!("SKIPPED: tract is not built in"),
        Err(error) => panic!("{error}"),
    }
    assert!(!engines.is_empty(), "nothing runs networks here: `cargo xtask onnxruntime` fetches ONNX Runtime");
    engines
}

/// A picture of `width` by `height` without a pose, 0.5 m away.
pub(crate) fn view(width: u32, height: u32, colour: impl Fn(u32, u32) -> [u8; 3]) -> View {
    let (w, h) = (f64::from(width), f64::from(height));
    View {
        index: 0,
        stamp: None,
        intrinsics: Intrinsics { width, height, fx: w, fy: w, cx: w / 2.0, cy: h / 2.0 },
        rgb: Arc::new(RgbImage::from_fn(width, height, |u, v| Rgb(colour(u, v)))),
        depth: Arc::new(DepthImage { width, height, metres: vec![0.5; (width * height) as usize] }),
        pose: PoseEvidence::None,
        labels: None,
        truth: None,
    }
}
