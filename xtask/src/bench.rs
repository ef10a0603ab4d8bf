//! `cargo xtask bench`: runs every benchmark of the workspace, keeps what each measured as JSON under `target/bench`
//! and prints one table.
//!
//! A benchmark is a cargo bench target that either prints one JSON object on stdout (people's text goes to stderr) or
//! uses criterion. The stream benchmark is measured on models that the agent fuses first, beside Draco; other benches are
//! compared with the peers that their `rivals.py` names, or with PCL by the program that lies beside them. Poses of the real
//! captures are judged by their pictures, ours beside the robot's and Open3D's. What networks learn from corrected labels is
//! measured where there is a Python with PyTorch.

use crate::bench_table::{self, Row};
use crate::browser::{Browser, Programs};
use crate::onnx_runtime;
use crate::pcl;
use crate::process::{capture, line, run as run_command};
use crate::report::{heading, note};
use crate::rivals;
use crate::teach;
use crate::test::ENDLESS_STREAM;
use crate::wasm_target::{TARGET, Toolchain};
use crate::web;
use crate::workspace::{Workspace, cargo};
use anyhow::{Context, Result};
use clap::Args;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The packages that have benchmarks.
const PACKAGES: [&str; 8] = [
    "semascan-protocol",
    "semascan-geometry",
    "semascan-perception",
    "semascan-boards",
    "semascan-simulation",
    "semascan-sources",
    "semascan-cli",
    "semascan-tests",
];

/// The benchmark that measures the chunk codec, on a `cloud.ply` when it is given one.
const STREAM: &str = "stream";

/// The comparison of poses on real captures.
const POSES: &str = "poses";

/// The benchmark of a camera at 30 Hz, and the variable that tells it how long.
const INGEST: &str = "ingest";
const SECONDS: &str = "SEMASCAN_BENCH_SECONDS";

/// Benchmarks that run networks, in ONNX Runtime.
const USE_NETWORKS: [&str; 2] = ["network", "inspection"];

/// Examples of shared crates (folder below `shared/`, example) that are timed in WebAssembly, each by the script of its
/// name: the chunk codec, the mesher.
const IN_WASM: [(&str, &str); 2] = [("protocol", "codec_wasm"), ("geometry", "mesh_wasm")];

/// Scripts of `tests/browser/bench` that measure the viewer in Chromium: the mesh of half a million points, the picture of
/// millions, what a page holds that is used for half an hour.
const IN_CHROMIUM: [&str; 3] = ["mesh", "render", ENDURANCE];

/// The one of them that takes half an hour, and is run by its name alone.
const ENDURANCE: &str = "endurance";

/// A 2 M voxel motor: high resolution and small voxels, so that the stream is measured at the size it must stand.
const MOTOR: [&str; 3] = ["virtual:starter-motor?seed=7&views=12&size=1920x1200", "--voxel", "0.5"];

/// What is measured.
#[derive(Args)]
pub(crate) struct Options {
    /// Run the benchmarks whose name contains NAME
    name: Option<String>,
    /// Measure the stream on its synthetic part only: do not fuse models first
    #[arg(long)]
    synthetic: bool,
    /// How long the benchmark `ingest` streams [default: 600]
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<u32>,
}

/// Measures, then prints the table.
pub(crate) fn run(options: &Options) -> Result<()> {
    let workspace = Workspace::find()?;
    let folder = workspace.target.join("bench");
    fs::create_dir_all(&folder)?;
    let mut rows = Vec::new();
    for Target { package, bench, source } in benches()? {
        if options.name.as_deref().is_some_and(|part| !bench.contains(part)) {
            continue;
        }
        heading(&format!("{package}: {bench}"));
        if bench == INGEST {
            rows.extend(ingest(&workspace, &folder, &package, options.seconds)?);
            continue;
        }
        if bench != STREAM || options.synthetic {
            rows.extend(beside_rivals(&workspace, &folder, &package, &bench, &source)?);
            continue;
        }
        for cloud in clouds(&workspace, &folder)? {
            let name = format!("{bench}-{}", stem(&cloud));
            rows.extend(measure(&workspace, &folder, &package, &bench, &name, &[&cloud])?);
            rows.extend(draco(&workspace, &folder, &cloud)?);
        }
    }
    for example in IN_WASM {
        if options.name.as_deref().is_none_or(|part| example.1.contains(part)) {
            rows.extend(in_wasm(&workspace, &folder, example)?);
        }
    }
    for script in IN_CHROMIUM {
        let name = format!("{script}_chromium");
        let is_long = script == ENDURANCE;
        if options.name.as_deref().map_or(!is_long, |part| name.contains(part)) {
            rows.extend(in_chromium(&workspace, &folder, script, &name)?);
        }
    }
    if options.name.as_deref().is_none_or(|part| POSES.contains(part)) {
        rows.extend(poses(&workspace, &folder)?);
    }
    if options.name.as_deref().is_none_or(|part| teach::NAME.contains(part)) {
        heading("training code: taught by corrected labels");
        if let Some(mut command) = teach::run(&workspace, &folder.join(teach::NAME), &|| agent(&workspace))? {
            rows.extend(keep(&mut command, &folder, teach::NAME)?);
        }
    }
    rows.extend(bench_table::criterion(&workspace.target.join("criterion"))?);
    heading("Benchmarks");
    eprint!("{}", bench_table::render(&rows));
    note(format!("kept in {}", folder.display()));
    Ok(())
}

/// A bench target.
struct Target {
    package: String,
    bench: String,
    source: PathBuf,
}

/// Every bench target, as cargo knows them.
fn benches() -> Result<Vec<Target>> {
    let metadata = capture(cargo().args(["metadata", "--format-version=1", "--no-deps"]))?;
    let metadata: Value = serde_json::from_str(&metadata).context("cargo metadata is not JSON")?;
    let mut found = Vec::new();
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let name = package["name"].as_str().unwrap_or_default();
        let targets = package["targets"].as_array().into_iter().flatten();
        let is_bench =
            |target: &&Value| target["kind"].as_array().is_some_and(|kinds| kinds.iter().any(|k| k == "bench"));
        if PACKAGES.contains(&name) {
            let target = |t: &Value| {
                let (bench, source) = (t["name"].as_str()?.to_owned(), t["src_path"].as_str()?.into());
                Some(Target { package: name.to_owned(), bench, source })
            };
            found.extend(targets.filter(is_bench).filter_map(target));
        }
    }
    anyhow::ensure!(!found.is_empty(), "no package of {PACKAGES:?} has a bench target");
    Ok(found)
}

/// Runs one bench target, and its rivals on the inputs that it leaves, if it has any.
fn beside_rivals(workspace: &Workspace, folder: &Path, package: &str, bench: &str, source: &Path) -> Result<Vec<Row>> {
    if let Some(program) = pcl::program(workspace, source)? {
        return measure(workspace, folder, package, bench, bench, &[&program]);
    }
    let Some(script) = rivals::script(source) else {
        return measure(workspace, folder, package, bench, bench, &[]);
    };
    let inputs = folder.join(bench);
    fs::create_dir_all(&inputs)?;
    let mut rows = measure(workspace, folder, package, bench, bench, &[&inputs])?;
    if rows.is_empty() {
        // What it needs is not there, which it has said, and it has left nothing.
        return Ok(rows);
    }
    let python = rivals::python(workspace)?;
    let ours = folder.join(format!("{bench}.json"));
    rows.extend(keep(Command::new(python).arg(script).arg(inputs).arg(ours), folder, &format!("{bench}-rivals"))?);
    Ok(rows)
}

/// Runs one bench target. What it prints on stdout is kept when it is a JSON object.
fn measure(
    workspace: &Workspace,
    folder: &Path,
    package: &str,
    bench: &str,
    name: &str,
    arguments: &[&Path],
) -> Result<Vec<Row>> {
    let mut command = cargo();
    command.current_dir(&workspace.root).args(["bench", "--package", package, "--bench", bench, "--"]);
    if USE_NETWORKS.contains(&bench) {
        command.env(onnx_runtime::VARIABLE, onnx_runtime::prepare(workspace)?);
    }
    keep(command.args(arguments), folder, name)
}

/// Streams a camera at 30 Hz for so many seconds.
fn ingest(workspace: &Workspace, folder: &Path, package: &str, seconds: Option<u32>) -> Result<Vec<Row>> {
    let mut command = cargo();
    command.current_dir(&workspace.root).args(["bench", "--package", package, "--bench", INGEST]);
    if let Some(seconds) = seconds {
        command.env(SECONDS, seconds.to_string());
    }
    keep(&mut command, folder, INGEST)
}

/// Runs a program that may print a JSON object, and keeps that as `target/bench/NAME.json`.
fn keep(command: &mut Command, folder: &Path, name: &str) -> Result<Vec<Row>> {
    eprintln!("   $ {}", line(command));
    let output =
        command.stderr(Stdio::inherit()).output().with_context(|| format!("cannot start `{}`", line(command)))?;
    anyhow::ensure!(output.status.success(), "`{}` ended with {}", line(command), output.status);
    let text = String::from_utf8_lossy(&output.stdout);
    match serde_json::from_str::<Value>(&text) {
        Ok(figures) if figures.is_object() => {
            fs::write(folder.join(format!("{name}.json")), serde_json::to_string_pretty(&figures)?)?;
            Ok(bench_table::flatten(name, &figures))
        }
        _ => {
            eprint!("{text}");
            Ok(Vec::new())
        }
    }
}

/// Fuses the models that the stream is measured on: the shelf, where the real captures are at hand, and the motor.
fn clouds(workspace: &Workspace, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut sources: Vec<(&str, Vec<String>)> = vec![("motor", MOTOR.map(str::to_owned).to_vec())];
    match std::env::var_os("SEMASCAN_DATA") {
        Some(data) => {
            let shelf = Path::new(&data).join("shelf-eye-in-hand").canonicalize()?;
            sources.insert(0, ("shelf", vec![shelf.display().to_string()]));
        }
        None => note("SEMASCAN_DATA is not set: the stream is not measured on the real shelf"),
    }
    let mut clouds = Vec::new();
    for (name, arguments) in sources {
        let out = folder.join(name);
        let mut inspect = Command::new(agent(workspace)?);
        inspect.arg("inspect").args(arguments).args(["--labels", "source", "--overwrite", "--out"]).arg(&out);
        run_command(&mut inspect)?;
        let cloud = folder.join(format!("{name}.ply"));
        fs::copy(out.join("cloud.ply"), &cloud).with_context(|| format!("{} has no cloud.ply", out.display()))?;
        clouds.push(cloud);
    }
    Ok(clouds)
}

/// Builds the agent as it is shipped.
fn agent(workspace: &Workspace) -> Result<PathBuf> {
    let build = ["build", "--release", "--package", "semascan-cli", "--bin", "semascan"];
    run_command(cargo().current_dir(&workspace.root).args(build))?;
    Ok(workspace.target.join("release").join(format!("semascan{}", std::env::consts::EXE_SUFFIX)))
}

/// Builds what sends a model of any size, and says where it is.
fn endless_stream(workspace: &Workspace) -> Result<PathBuf> {
    let build = ["build", "--release", "--package", "semascan-tests", "--example", ENDLESS_STREAM];
    run_command(cargo().current_dir(&workspace.root).args(build))?;
    let name = format!("{ENDLESS_STREAM}{}", std::env::consts::EXE_SUFFIX);
    Ok(workspace.target.join("release/examples").join(name))
}

/// Measures the viewer in Chromium, against the agent as it is shipped.
fn in_chromium(workspace: &Workspace, folder: &Path, script: &str, name: &str) -> Result<Vec<Row>> {
    heading(&format!("semascan-viewer: {name}"));
    let browser = Browser::prepare()?;
    web::run(&web::Options { dev: false })?;
    let programs = Programs { agent: &agent(workspace)?, endless_stream: &endless_stream(workspace)? };
    keep(&mut browser.benchmark(workspace, programs, script)?, folder, name)
}

/// Measures code of the shared crate as a browser runs it: in WebAssembly, in Node's engine.
fn in_wasm(workspace: &Workspace, folder: &Path, (room, example): (&str, &str)) -> Result<Vec<Row>> {
    let package = format!("semascan-{room}");
    heading(&format!("{package}: {example}"));
    let toolchain = Toolchain::prepare(workspace)?;
    run_command(toolchain.cargo_build().current_dir(&workspace.root).args([
        "--package",
        package.as_str(),
        "--example",
        example,
        "--release",
    ]))?;
    let built = toolchain.target_dir(workspace).join(TARGET).join("release/examples").join(format!("{example}.wasm"));
    let script = workspace.root.join("shared").join(room).join("benches").join(format!("{example}.mjs"));
    keep(Command::new("node").arg(script).arg(built), folder, example)
}

/// Judges the poses of the real captures by their pictures: ours, the robot's, Open3D's.
fn poses(workspace: &Workspace, folder: &Path) -> Result<Vec<Row>> {
    heading("real captures: poses");
    let Some(data) = std::env::var_os("SEMASCAN_DATA") else {
        note("SEMASCAN_DATA is not set: poses are not judged on real captures");
        return Ok(Vec::new());
    };
    let data = Path::new(&data).canonicalize()?;
    let inspections = folder.join(POSES);
    fs::create_dir_all(&inspections)?;
    let script = workspace.root.join("tests/benches/poses_compare.py");
    let mut compare = Command::new(rivals::python(workspace)?);
    keep(compare.arg(script).arg(agent(workspace)?).arg(data).arg(inspections), folder, POSES)
}

/// Measures Draco's kd-tree coder on the same cloud.
fn draco(workspace: &Workspace, folder: &Path, cloud: &Path) -> Result<Vec<Row>> {
    let script = workspace.root.join("shared/protocol/benches/draco_compare.py");
    let python = rivals::python(workspace)?;
    keep(Command::new(python).arg(script).arg(cloud), folder, &format!("draco-{}", stem(cloud)))
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
