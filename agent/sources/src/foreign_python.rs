//! Software that nobody here wrote, to compare with: scripts of `fixtures/` in the Python that `SEMASCAN_FOREIGN_PYTHON` names.

use std::path::Path;
use std::process::Command;

/// Names a Python that may have the packages that the scripts need.
const PYTHON: &str = "SEMASCAN_FOREIGN_PYTHON";
/// What a script ends with where they are not there.
const NOT_HERE: i32 = 77;

/// Runs a script over a folder; why it cannot, where a package is missing. Panics where the script fails.
pub(crate) fn run(script: &str, folder: &Path) -> Result<(), String> {
    let python = std::env::var_os(PYTHON).filter(|python| !python.is_empty());
    let python = python.ok_or_else(|| format!("{PYTHON} is not set"))?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(script);
    let output = Command::new(python).arg(script).arg(folder).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    if output.status.code() == Some(NOT_HERE) {
        return Err(said);
    }
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{said}");
    Ok(())
}
