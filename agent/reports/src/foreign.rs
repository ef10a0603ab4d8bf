//! QIF and DFQ as others read them: `fixtures/by_others.py`, in the Python that `SEMASCAN_FOREIGN_PYTHON` names. The schemas
//! of QIF 3.0 are in `fixtures/`, with their licence.

use crate::characteristics::{Characteristic, Limit, of_measurements, of_part};
use crate::fixtures::{angle, cylinder, distance, plane, record};
use crate::{dfq, qif};
use serde_json::json;
use std::process::Command;

/// Names a Python that may have lxml and aqdefreader.
const PYTHON: &str = "SEMASCAN_FOREIGN_PYTHON";
/// What the script ends with where it has them not.
const NOT_HERE: i32 = 77;

#[test]
fn qif_is_valid_and_dfq_comes_back() {
    let Some(python) = std::env::var_os(PYTHON).filter(|p| !p.is_empty()) else {
        eprintln!("SKIPPED: {PYTHON} is not set: QIF and DFQ are not read by others");
        return;
    };
    let mut record = record();
    record.part = "motor <7> & \"co\"".into();
    let kept = [distance(), cylinder(), plane(), angle()];
    let ended = record.ended.expect("it ended");
    let characteristic = |c: Characteristic| {
        let shown = |value: f64| value * c.measure.factor();
        let most = match c.limit {
            Some(Limit::Most(most)) => Some(shown(most)),
            _ => None,
        };
        let time = c.taken.as_ref().map_or(ended, |taken| taken.at).strftime("%Y-%m-%dT%H:%M:%S").to_string();
        json!({ "name": c.name, "unit": c.measure.unit(), "most": most, "value": shown(c.value.value), "time": time })
    };
    let expected = json!({
        "part": record.part,
        "characteristics": of_part(&record).into_iter().chain(of_measurements(&kept)).map(characteristic).collect::<Vec<_>>(),
    });
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
    write("expected.json", expected.to_string().as_bytes());
    write("report.dfq", &dfq(&record, &kept).expect("figures"));
    write("report.qif", &qif(&record, &kept).expect("figures"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/by_others.py");
    let output = Command::new(python).arg(script).arg(folder.path()).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout);
    if output.status.code() == Some(NOT_HERE) {
        eprintln!("SKIPPED: {}", said.trim());
        return;
    }
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{said}");
}
