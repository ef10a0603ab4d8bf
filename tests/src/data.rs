//! Real captures, found through the environment alone.

use std::path::PathBuf;

/// Folder `name` of the real captures.
///
/// # Errors
/// If `SEMASCAN_DATA` is not set or holds no such folder.
pub fn folder(name: &str) -> anyhow::Result<PathBuf> {
    let root = std::env::var_os("SEMASCAN_DATA").ok_or_else(|| anyhow::anyhow!("SEMASCAN_DATA is not set"))?;
    let folder = PathBuf::from(root).join(name);
    anyhow::ensure!(folder.is_dir(), "{} is missing", folder.display());
    Ok(folder)
}
