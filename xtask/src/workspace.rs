//! Where things are: the repository, cargo's target folder, and the cargo that runs us.

use crate::process::capture;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The repository's folders.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    /// The repository.
    pub(crate) root: PathBuf,
    /// Cargo's target folder, wherever configuration or environment put it.
    pub(crate) target: PathBuf,
}

impl Workspace {
    /// Asks cargo.
    pub(crate) fn find() -> Result<Self> {
        let answer = capture(
            cargo().args(["metadata", "--format-version=1", "--no-deps", "--manifest-path"]).arg(own_manifest()),
        )?;
        let metadata: serde_json::Value = serde_json::from_str(&answer).context("cargo metadata is not JSON")?;
        let folder = |key: &str| {
            let text = metadata[key].as_str().with_context(|| format!("cargo metadata has no `{key}`"))?;
            anyhow::Ok(PathBuf::from(text))
        };
        Ok(Self { root: folder("workspace_root")?, target: folder("target_directory")? })
    }

    /// The skeleton of the page and its styles, as people write them.
    pub(crate) fn www(&self) -> PathBuf {
        self.root.join("www")
    }

    /// The built web files that the agent serves and embeds.
    pub(crate) fn dist(&self) -> PathBuf {
        self.root.join("www/dist")
    }
}

/// The cargo that runs xtask, so that a `cargo +toolchain xtask` is kept.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

fn own_manifest() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")
}
