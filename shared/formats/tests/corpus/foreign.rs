//! The same files read by others: `foreign.py`, in the Python that `SEMASCAN_FOREIGN_PYTHON` names (`cargo xtask test` sets
//! it up).

use super::corpus;
use serde_json::json;
use std::process::Command;

/// Names a Python with numpy, plyfile, trimesh and pypcd4.
const PYTHON: &str = "SEMASCAN_FOREIGN_PYTHON";

#[test]
fn readers_of_others_find_the_same_values() {
    let Some(python) = std::env::var_os(PYTHON).filter(|p| !p.is_empty()) else {
        eprintln!("SKIPPED: {PYTHON} is not set: the corpus is read by our readers only");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut expected = Vec::new();
    for variant in corpus().iter().filter(|variant| variant.foreign) {
        std::fs::write(folder.path().join(&variant.name), &variant.bytes).expect("written");
        expected.push(json!({
            "file": variant.name, "positions": variant.positions, "triangles": variant.triangles,
            "columns": variant.columns,
        }));
    }
    assert!(expected.len() >= 300, "{} files", expected.len());
    let list = serde_json::to_vec(&expected).expect("JSON");
    std::fs::write(folder.path().join("expected.json"), list).expect("written");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/corpus/foreign.py");
    let output = Command::new(python).arg(script).arg(folder.path()).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{said}");
}
