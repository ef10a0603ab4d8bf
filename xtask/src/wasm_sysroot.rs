//! A standard library for the web without rustup: the distribution ships its sources (`rust-web-src`), and its cargo
//! builds them once into a private sysroot.
//!
//! A standard library loads only in the rustc that built it, so the cache is keyed on `rustc -vV`. It is compiled with
//! bitcode, else a viewer with link-time optimisation could not use it.

use crate::packages;
use crate::process::{capture, exists, run};
use crate::report::note;
use crate::wasm_target::TARGET;
use crate::workspace::Workspace;
use anyhow::{Context, Result};
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Debian's Rust for the web: a newer compiler than its default one, with sources and the linker of WebAssembly.
const PACKAGES: [&str; 5] = ["rustc-web", "cargo-web", "rust-web-src", "rust-web-llvm", "lld-22"];
const RUSTC: &str = "/usr/bin/rustc";
const CARGO: &str = "/usr/bin/cargo";

/// A private sysroot and the folder that builds with it use.
pub(crate) struct Sysroot {
    sysroot: PathBuf,
    target: PathBuf,
}

impl Sysroot {
    /// The distribution's cargo, told to use the distribution's rustc.
    pub(crate) fn cargo(&self) -> Command {
        distribution_cargo()
    }

    /// Cargo configuration that points the web target, and only it, at the sysroot; flags of the repository's own
    /// configuration stay.
    pub(crate) fn cargo_config(&self) -> String {
        format!("target.{TARGET}.rustflags=['--sysroot', '{}']", self.sysroot.display())
    }

    /// Target folder of its own: two compilers in one folder would undo each other's caches.
    pub(crate) fn target_dir(&self) -> &Path {
        &self.target
    }
}

/// Makes the sysroot, or takes the one made before.
pub(crate) fn prepare(workspace: &Workspace) -> Result<Sysroot> {
    if !has_sources() {
        packages::install("the distribution's Rust compiles the viewer", &PACKAGES)?;
    }
    let version = capture(Command::new(RUSTC).arg("-vV"))?;
    let home = workspace.target.join("wasm-packages");
    let sysroot = home.join(format!("sysroot-{:016x}", key(&version)));
    if !sysroot.exists() {
        note(format!(
            "building a standard library for {TARGET} once, with {}",
            version.lines().next().unwrap_or("rustc")
        ));
        let unfinished = sysroot.with_extension("unfinished");
        build(&home.join("seed"), &unfinished)?;
        fs::rename(&unfinished, &sysroot).with_context(|| format!("cannot move to {}", sysroot.display()))?;
    }
    Ok(Sysroot { sysroot, target: home.join("target") })
}

fn has_sources() -> bool {
    let sources =
        || capture(Command::new(RUSTC).args(["--print", "sysroot"])).map(|root| library_sources(Path::new(&root)));
    exists(RUSTC) && exists(CARGO) && sources().is_ok_and(|path| path.exists())
}

fn library_sources(sysroot: &Path) -> PathBuf {
    sysroot.join("lib/rustlib/src/rust/library/std/Cargo.toml")
}

fn key(version: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    version.hash(&mut hasher);
    hasher.finish()
}

fn distribution_cargo() -> Command {
    let mut command = Command::new(CARGO);
    // The toolchain that runs xtask must not leak into the other one's build.
    command.env("RUSTC", RUSTC).env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTDOC");
    command
}

/// Builds std for an empty crate in `seed` and lays the result out as a sysroot.
fn build(seed: &Path, sysroot: &Path) -> Result<()> {
    write_empty_crate(seed)?;
    // -Zbuild-std is not stable, hence the bootstrap switch; the viewer itself is compiled without it.
    run(distribution_cargo()
        .current_dir(seed)
        .env("RUSTC_BOOTSTRAP", "1")
        .env("RUSTFLAGS", "-Cembed-bitcode=yes -Ctarget-feature=+simd128")
        .args(["build", "--release", "--target", TARGET, "-Zbuild-std=std,panic_abort", "--target-dir", "target"]))?;

    let _ = fs::remove_dir_all(sysroot);
    let libraries = sysroot.join("lib/rustlib").join(TARGET).join("lib");
    fs::create_dir_all(&libraries)?;
    let built = seed.join("target").join(TARGET).join("release/deps");
    for entry in fs::read_dir(&built).with_context(|| format!("no {}", built.display()))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let library = name.starts_with("lib") && (name.ends_with(".rlib") || name.ends_with(".rmeta"));
        if library && !name.starts_with("libseed-") {
            fs::copy(&path, libraries.join(&name))?;
        }
    }
    link_host(sysroot)
}

/// Procedural macros run on this machine: its own standard library lies beside the new one.
fn link_host(sysroot: &Path) -> Result<()> {
    let system = PathBuf::from(capture(Command::new(RUSTC).args(["--print", "sysroot"]))?).join("lib/rustlib");
    for entry in fs::read_dir(&system).with_context(|| format!("no {}", system.display()))? {
        let entry = entry?;
        let link = sysroot.join("lib/rustlib").join(entry.file_name());
        if !link.exists() {
            std::os::unix::fs::symlink(entry.path(), &link)?;
        }
    }
    Ok(())
}

fn write_empty_crate(seed: &Path) -> Result<()> {
    fs::create_dir_all(seed.join("src"))?;
    // An own workspace: the folder lies inside the repository's.
    let manifest = "[package]\nname = \"seed\"\nversion = \"0.0.0\"\nedition = \"2021\"\n\n[workspace]\n";
    fs::write(seed.join("Cargo.toml"), manifest)?;
    fs::write(seed.join("src/lib.rs"), "")?;
    Ok(())
}
