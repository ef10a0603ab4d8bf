//! `semascan tables`.

use crate::{semascan, stderr};
use std::process::Command;

#[test]
fn the_tables_of_p1_are_rerun() {
    let run = || {
        let args = ["tables", "P1", "--seeds", "2", "--views", "3", "--only", "cuboid", "--json"];
        let output = Command::new(env!("CARGO_BIN_EXE_semascan")).args(args).env_remove("SEMASCAN_DATA").output();
        let output = output.expect("the binary starts");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains("LCCCP + SICP"), "{}", stderr(&output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("one JSON object")
    };
    let (report, again) = (run(), run());
    assert_eq!(report["objects"][0]["object"], "cuboid");
    assert_eq!(report["objects"][0]["published_c2c_mm"][0], 4.806);
    let figures = |report: &serde_json::Value| -> Vec<[f64; 3]> {
        let methods = report["runs"].as_array().into_iter().flatten().flat_map(|run| run["methods"].as_array());
        let keys = ["c2c_mm", "precision_1mm", "mask_iou"];
        methods.flatten().map(|m| keys.map(|k| m[k].as_f64().expect("a number"))).collect()
    };
    assert_eq!(figures(&report).len(), 8);
    assert_eq!(figures(&report), figures(&again), "the same seeds give the same figures");
    assert!(report["mask_iou_gain_points"].as_f64().is_some_and(|g| g > 3.0), "{report}");
    let unknown = semascan(&["tables", "P1", "--only", "no such object"]);
    assert_eq!(unknown.status.code(), Some(2), "{}", stderr(&unknown));
}
