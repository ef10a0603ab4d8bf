//! The download budget: what a browser must fetch before the viewer runs, as served (brotli).

use crate::dist::compressed_sibling;
use crate::report::note;
use crate::web::VIEWER;
use crate::workspace::Workspace;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::Path;

/// Largest sum of the viewer's WebAssembly and JavaScript, in bytes after brotli: with the page, its style sheet and another language
/// it stays below 1.6 MB.
const LIMIT: u64 = 1_580_000;

/// Prints the figures; an error when the viewer is over its budget.
pub(crate) fn check(workspace: &Workspace) -> Result<()> {
    let files = [format!("{VIEWER}_bg.wasm"), format!("{VIEWER}.js")];
    let sizes = files.iter().map(|name| measure(&workspace.dist(), name)).collect::<Result<Vec<_>>>()?;
    within(sizes.iter().sum())
}

fn measure(dist: &Path, name: &str) -> Result<u64> {
    let path = dist.join(name);
    let size = |path: &Path| anyhow::Ok(fs::metadata(path).with_context(|| format!("no {}", path.display()))?.len());
    let (plain, brotli) = (size(&path)?, size(&compressed_sibling(&path, "br"))?);
    let gzip = size(&compressed_sibling(&path, "gz"))?;
    note(format!("{name:<26} {plain:>9} B plain {gzip:>9} B gzip {brotli:>9} B brotli"));
    Ok(brotli)
}

fn within(total: u64) -> Result<()> {
    note(format!("{:<26} {total:>9} B of {LIMIT} B ({:.0} %)", "viewer, brotli", 100.0 * total as f64 / LIMIT as f64));
    if total > LIMIT {
        bail!("the viewer is {} B over its budget of {LIMIT} B", total - LIMIT);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_is_a_limit() {
        assert!(within(LIMIT).is_ok());
        let error = within(LIMIT + 5).expect_err("over the budget");
        assert!(error.to_string().contains("5 B over"), "{error}");
    }
}
