//! `cargo xtask fuzz`: every parser of bytes from outside, with libFuzzer. The counters that it steers by come from flags of the
//! stable compiler (those that cargo-fuzz sets), so nothing has to be installed.

use crate::process::{capture, run};
use crate::report::{heading, note};
use crate::workspace::{Workspace, cargo};
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Coverage of edges and compared values, as cargo-fuzz asks for them.
const FLAGS: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Clink-dead-code";
/// Valid inputs that lie elsewhere in the repository: target, file.
const SEEDS: &[(&str, &str)] = &[
    ("record", "shared/model/src/record/fixtures/version1.json"),
    ("record", "shared/model/src/record/fixtures/version1_networks.json"),
    ("criteria", "agent/cli/src/commands/criteria.sample.toml"),
    ("manifest", "agent/models/ud-net-edge/model.toml"),
];

/// What is fuzzed, and how long.
#[derive(Args)]
pub(crate) struct Options {
    /// Seconds for each target
    #[arg(long, default_value_t = 60)]
    seconds: u32,
    /// Targets (files of tests/fuzz/fuzz_targets); all without any
    targets: Vec<String>,
}

/// Builds the targets and runs them one after the other. An input that crashes one, takes longer than 20 s or more than 2 GB
/// is kept and named.
pub(crate) fn run_all(options: &Options) -> Result<()> {
    let workspace = Workspace::find()?;
    let package = workspace.root.join("tests/fuzz");
    let all = targets(&package)?;
    for target in &options.targets {
        ensure!(all.contains(target), "no target {target}; there are {}", all.join(", "));
    }
    let chosen = if options.targets.is_empty() { &all } else { &options.targets };

    heading("Fuzz targets");
    let folder = workspace.target.join("fuzz");
    let host = host()?;
    // With --target the flags are those of the targets, not of build scripts.
    run(cargo()
        .current_dir(&package)
        .env("RUSTFLAGS", FLAGS)
        .args(["build", "--release", "--bins", "--target", &host, "--target-dir"])
        .arg(&folder))?;
    let crashes = folder.join("crashes");
    fs::create_dir_all(&crashes).with_context(|| format!("cannot make {}", crashes.display()))?;
    let mut failed = Vec::new();
    for target in chosen {
        heading(target);
        let corpus = corpus(&workspace, &package, &folder, target)?;
        let mut fuzzer = Command::new(folder.join(&host).join("release").join(target));
        fuzzer.current_dir(&folder).arg(&corpus).args(["-timeout=20", "-rss_limit_mb=2048", "-print_final_stats=1"]);
        fuzzer.args(["-verbosity=0", "-print_funcs=0", "-close_fd_mask=1"]);
        fuzzer.arg(format!("-max_total_time={}", options.seconds));
        fuzzer.arg(format!("-artifact_prefix={}", crashes.join(format!("{target}-")).display()));
        if let Err(error) = run(&mut fuzzer) {
            note(format!("{error:#}"));
            failed.push(target.as_str());
        }
    }
    ensure!(failed.is_empty(), "failed: {}; the inputs lie in {}", failed.join(", "), crashes.display());
    note(format!("{} targets, {} s each: no crash", chosen.len(), options.seconds));
    Ok(())
}

/// Names of the targets, sorted.
fn targets(package: &Path) -> Result<Vec<String>> {
    let folder = package.join("fuzz_targets");
    let files = fs::read_dir(&folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let mut names = Vec::new();
    for file in files {
        names.extend(file?.path().file_stem().map(|stem| stem.to_string_lossy().into_owned()));
    }
    names.sort();
    Ok(names)
}

/// The folder in which a target's inputs are kept from run to run, with the valid ones that it begins with.
fn corpus(workspace: &Workspace, package: &Path, folder: &Path, target: &str) -> Result<PathBuf> {
    let corpus = folder.join("corpus").join(target);
    fs::create_dir_all(&corpus).with_context(|| format!("cannot make {}", corpus.display()))?;
    let mut seeds: Vec<PathBuf> =
        SEEDS.iter().filter(|(of, _)| *of == target).map(|(_, file)| workspace.root.join(file)).collect();
    if let Ok(files) = fs::read_dir(package.join("seeds").join(target)) {
        seeds.extend(files.flatten().map(|file| file.path()));
    }
    for seed in seeds {
        let name = seed.file_name().context("a seed has a name")?;
        fs::copy(&seed, corpus.join(name)).with_context(|| format!("cannot copy {}", seed.display()))?;
    }
    Ok(corpus)
}

/// The platform that the compiler runs on.
fn host() -> Result<String> {
    let version = capture(Command::new("rustc").arg("-vV"))?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("`rustc -vV` names no host")?.to_owned())
}
