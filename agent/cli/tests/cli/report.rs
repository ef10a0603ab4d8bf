//! `report.html` in the files of an inspection, and `semascan report`.

use crate::{semascan, stderr};
use std::fs;
use std::path::Path;

const MOTOR: &str = "virtual:starter-motor?seed=3&views=3&size=320x240&cell=2.5";

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_report_stands_in_the_set_follows_the_verdict_and_can_be_written_again() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name);
    let text = |name: &str| path(name).to_str().expect("UTF-8").to_owned();
    let motor = text("motor");
    let output = semascan(&["inspect", MOTOR, "--out", &motor]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let record: serde_json::Value = serde_json::from_str(&read(&path("motor/inspection.json"))).expect("JSON");
    assert!(record["files"]["names"].as_array().expect("a list").contains(&"report.html".into()));
    let findings = record["findings"]["list"].as_array().expect("a list").len();
    assert!(findings > 3, "{findings} findings");

    // Every finding is shown, with photographs of the views that were inspected.
    let first = read(&path("motor/report.html"));
    assert_eq!(first.matches("<article class=\"finding\"").count(), findings);
    let photographs = |report: &str| report.matches("<figure class=\"picture photograph\"").count();
    assert!(photographs(&first) >= findings, "{} photographs", photographs(&first));
    assert!(first.contains("not judged") && !first.contains("<script"));

    // A verdict is in the report as soon as it is in the record; the photographs are those of the first report.
    let criteria = path("strict.toml");
    let head = "version = 1\nname = \"<b>strict</b>\"\nrevision = \"7\"\n";
    let rules = ["corrosion", "wear", "crack"]
        .map(|d| format!("[[defect]]\ndefect = \"{d}\"\nlargest_area_mm2 = 1\nthen = \"reject\"\n"));
    fs::write(&criteria, format!("{head}{}", rules.concat())).expect("written");
    let output = semascan(&["judge", &motor, "--criteria", &text("strict.toml")]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let judged = read(&path("motor/report.html"));
    assert!(judged.contains("<div class=\"seal reject\">") && judged.contains("&lt;b&gt;strict&lt;/b&gt;"));
    assert_eq!(photographs(&judged), photographs(&first));

    // Written again from the folder, it is the same; without the earlier one the photographs come out of the source again.
    let again = text("again.html");
    let output = semascan(&["report", &motor, "--out", &again]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(read(&path("again.html")) == judged, "another report of the same record");
    fs::remove_file(path("motor/report.html")).expect("removed");
    let output = semascan(&["report", &motor]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let anew = read(&path("motor/report.html"));
    assert_eq!(photographs(&anew), photographs(&first));
    // A source that is gone costs the photographs, which the report says.
    fs::remove_file(path("motor/report.html")).expect("removed");
    let record = read(&path("motor/inspection.json")).replace("virtual:starter-motor", "nowhere:starter-motor");
    fs::write(path("motor/inspection.json"), record).expect("written");
    let output = semascan(&["report", &motor]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let without = read(&path("motor/report.html"));
    assert!(photographs(&without) == 0 && without.contains("Photographs: the source cannot be opened again"));
}

#[test]
fn tables_are_written_and_an_inspection_with_them_can_be_replaced() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name);
    let motor = path("motor").to_str().expect("UTF-8").to_owned();
    let inspect = ["inspect", MOTOR, "--out", &motor, "--overwrite"];
    assert_eq!(semascan(&inspect).status.code(), Some(0));
    for format in ["csv", "dfq", "qif"] {
        let output = semascan(&["report", &motor, "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{format}: {}", stderr(&output));
    }
    let record: serde_json::Value = serde_json::from_str(&read(&path("motor/inspection.json"))).expect("JSON");
    let findings = record["findings"]["list"].as_array().expect("a list");
    let table = read(&path("motor/findings.csv"));
    assert_eq!(table.matches("\r\n").count(), findings.len() + 1);
    assert!(findings.iter().all(|finding| table.contains(finding["id"].as_str().expect("text"))));
    let components = record["components"].as_array().expect("a list").len();
    assert_eq!(read(&path("motor/components.csv")).matches("\r\n").count(), components + 1);
    assert!(read(&path("motor/report.dfq")).starts_with("K0100 "));
    assert!(read(&path("motor/report.qif")).contains("<QIFDocument "));
    // They are ours: a new inspection takes their place.
    let output = semascan(&inspect);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(!path("motor/findings.csv").exists() && !path("motor/report.qif").exists());

    let nowhere = semascan(&["report", path("nothing").to_str().expect("UTF-8")]);
    assert_eq!(nowhere.status.code(), Some(2), "{}", stderr(&nowhere));
    let file = path("a-file");
    fs::write(&file, "").expect("written");
    let output = semascan(&["report", &motor, "--format", "csv", "--out", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}
