//! `cargo xtask web`: compiles the viewer to WebAssembly, makes its JavaScript glue and lays both beside the static
//! files of `www/` in `www/dist`, ready to be served from disk or embedded in the agent.
//!
//! The glue comes from wasm-bindgen as a library: Cargo.lock then holds one version for the glue and for what is
//! compiled into the viewer, and they cannot differ.

use crate::dist::{self, Files};
use crate::process::run as run_command;
use crate::report::{heading, note, seconds};
use crate::wasm_target::{TARGET, Toolchain};
use crate::workspace::Workspace;
use crate::{compress, workspace};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::fs;
use std::path::Path;
use std::time::Instant;
use wasm_bindgen_cli_support::Bindgen;

/// Name of the built files: `semascan_viewer.js`, `semascan_viewer_bg.wasm`.
pub(crate) const VIEWER: &str = "semascan_viewer";
/// The same of the module that reads recordings, which the page loads when one is opened.
const RECORDING: &str = "semascan_recording";

/// How the viewer is built.
#[derive(Args, Clone, Copy, Default)]
pub(crate) struct Options {
    /// Build quickly and leave the files uncompressed
    #[arg(long)]
    pub(crate) dev: bool,
}

/// Builds `www/dist` and gives back where everything is.
pub(crate) fn run(options: &Options) -> Result<Workspace> {
    heading(if options.dev { "Viewer (development)" } else { "Viewer" });
    let workspace = workspace::Workspace::find()?;
    let start = Instant::now();

    let folder = compile(&workspace, options.dev)?;
    let compiled = start.elapsed();

    let mut files = dist::read(&workspace.www(), &["dist"]).context("the page of the viewer is missing")?;
    if !files.contains_key("index.html") {
        bail!("{} has no index.html", workspace.www().display());
    }
    for module in [VIEWER, RECORDING] {
        files.extend(glue(module, &folder, &workspace.target.join("web-glue"), options.dev)?);
    }
    let written = dist::update(&workspace.dist(), &files)?;
    let glued = start.elapsed();

    if options.dev {
        dist::remove_all_compressed(&workspace.dist())?;
    } else {
        compress::folder(&workspace.dist())?;
    }
    note(format!(
        "{}: {} files, {written} changed; compile {}, glue {}, compress {}, in all {}",
        workspace.dist().display(),
        files.len(),
        seconds(compiled),
        seconds(glued - compiled),
        seconds(start.elapsed() - glued),
        seconds(start.elapsed()),
    ));
    Ok(workspace)
}

/// Compiles the modules, and says which folder they are in; cargo decides whether anything has to be done.
fn compile(workspace: &Workspace, dev: bool) -> Result<std::path::PathBuf> {
    let toolchain = Toolchain::prepare(workspace)?;
    let profile = if dev { "web-dev" } else { "web" };
    run_command(toolchain.cargo_build().current_dir(&workspace.root).args([
        "--package",
        "semascan-viewer",
        "--package",
        "semascan-recording",
        "--lib",
        "--profile",
        profile,
    ]))?;
    Ok(toolchain.target_dir(workspace).join(TARGET).join(profile))
}

/// Runs wasm-bindgen over the compiled `module` in `folder` and reads back what it wrote.
fn glue(module: &str, folder: &Path, scratch: &Path, dev: bool) -> Result<Files> {
    let wasm = folder.join(format!("{module}.wasm"));
    let _ = fs::remove_dir_all(scratch);
    Bindgen::new()
        .input_path(&wasm)
        .web(true)?
        .out_name(module)
        .typescript(false)
        // `init()` without an argument finds the module beside the script, as with the command-line tool.
        .omit_default_module_path(false)
        // Names make a stack trace readable and the download larger.
        .demangle(dev)
        .remove_name_section(!dev)
        .remove_producers_section(!dev)
        .generate(scratch)
        .with_context(|| format!("wasm-bindgen cannot make glue for {}", wasm.display()))?;
    dist::read(scratch, &[])
}
