//! A compiler for `wasm32-unknown-unknown`, got in the cheapest way that works here:
//!
//! 1. the toolchain in use already has the target's standard library;
//! 2. rustup adds it (a machine that reaches package registries only may refuse: hence the time limit);
//! 3. the distribution's Rust compiles a standard library of its own ([`crate::wasm_sysroot`]).
//!
//! `XTASK_WASM_TOOLCHAIN=packages` goes straight to the third way.

use crate::process::{capture, exists, run_within};
use crate::report::note;
use crate::wasm_sysroot::{self, Sysroot};
use crate::workspace::{Workspace, cargo};
use anyhow::Result;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The target of the viewer.
pub(crate) const TARGET: &str = "wasm32-unknown-unknown";

/// How long rustup may take for a download of about 20 MB.
const RUSTUP_LIMIT: Duration = Duration::from_secs(60);

/// What compiles the viewer.
pub(crate) enum Toolchain {
    /// The cargo and rustc in use.
    Current,
    /// The distribution's cargo and rustc with a private standard library.
    Packages(Sysroot),
}

impl Toolchain {
    /// Finds or makes a compiler for the web.
    pub(crate) fn prepare(workspace: &Workspace) -> Result<Self> {
        if std::env::var_os("XTASK_WASM_TOOLCHAIN").is_some_and(|choice| choice == "packages") {
            note("XTASK_WASM_TOOLCHAIN=packages: using the distribution's Rust");
            return Ok(Self::Packages(wasm_sysroot::prepare(workspace)?));
        }
        if has_target() {
            return Ok(Self::Current);
        }
        match add_by_rustup() {
            Ok(()) => Ok(Self::Current),
            Err(error) => {
                note(format!("no {TARGET} from rustup ({error:#}); falling back to the distribution's Rust"));
                Ok(Self::Packages(wasm_sysroot::prepare(workspace)?))
            }
        }
    }

    /// `cargo build` for the web; the caller adds package and profile.
    pub(crate) fn cargo_build(&self) -> Command {
        let mut command = match self {
            Self::Current => cargo(),
            Self::Packages(sysroot) => sysroot.cargo(),
        };
        command.arg("build");
        if let Self::Packages(sysroot) = self {
            command.arg("--config").arg(sysroot.cargo_config()).arg("--target-dir").arg(sysroot.target_dir());
        }
        command.args(["--target", TARGET]);
        command
    }

    /// Where that build puts its target folder.
    pub(crate) fn target_dir<'a>(&'a self, workspace: &'a Workspace) -> &'a Path {
        match self {
            Self::Current => &workspace.target,
            Self::Packages(sysroot) => sysroot.target_dir(),
        }
    }
}

/// Whether the rustc in use has a standard library for the target: true for rustup's and for a distribution's.
fn has_target() -> bool {
    let libraries = capture(Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]));
    libraries.is_ok_and(|path| Path::new(&path).read_dir().is_ok_and(|mut entries| entries.next().is_some()))
}

fn add_by_rustup() -> Result<()> {
    if !exists("rustup") {
        anyhow::bail!("rustup is not installed");
    }
    note(format!("the viewer is compiled for {TARGET}, which this toolchain lacks: asking rustup"));
    run_within(Command::new("rustup").args(["target", "add", TARGET]), RUSTUP_LIMIT)?;
    if !has_target() {
        anyhow::bail!("rustup is content but rustc has no {TARGET} (is rustc another one than rustup's?)");
    }
    Ok(())
}
