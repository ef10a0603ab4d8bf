//! `semascan calibrate`: captures of a board become the place of the camera, or the call is refused with a reason.

use crate::{semascan, stderr};
use serde_json::{Value, json};

/// Captures of a simulated cell, with what OpenCV makes of them.
const CAPTURES: &str = include_str!("../../../calibration/fixtures/hand_eye_by_opencv.json");

#[test]
fn captures_of_a_board_give_the_camera_on_the_robot() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (captures, out) = (path("captures.json"), path("calibration.json"));
    let by_opencv: Value = serde_json::from_str(CAPTURES).expect("JSON");
    let content = json!({ "working_distance_m": 0.5, "captures": by_opencv["captures"] });
    std::fs::write(&captures, content.to_string()).expect("written");

    let output = semascan(&["calibrate", &captures, "--out", &out, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("camera on the end effector"), "{}", stderr(&output));
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let written: Value = serde_json::from_slice(&std::fs::read(&out).expect("written")).expect("JSON");
    assert_eq!(printed, written);
    assert_eq!(written["captures"].as_array().map(Vec::len), Some(14));
    let ours = &written["ee_from_camera"]["pose"]["translation"];
    let theirs = &by_opencv["ee_from_camera"]["andreff"]["translation"];
    for axis in 0..3 {
        let (ours, theirs) = (ours[axis].as_f64().expect("a number"), theirs[axis].as_f64().expect("a number"));
        assert!((ours - theirs).abs() < 2e-4, "{ours} and {theirs}");
    }

    let refused = |arguments: &[&str], code: i32, words: &str| {
        let output = semascan(&[&["calibrate"], arguments].concat());
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(words), "{}", stderr(&output));
    };
    refused(&[&captures, "--out", &out], 2, "--overwrite");
    refused(&[&path("none.json")], 2, "none.json");
    let write = |content: &Value| std::fs::write(&captures, content.to_string()).expect("written");
    write(&json!({ "captures": [{ "base_from_ee": {} }] }));
    refused(&[&captures], 2, "captures[0].base_from_ee");
    let few = by_opencv["captures"].as_array().expect("captures")[..2].to_vec();
    write(&json!({ "captures": few }));
    refused(&[&captures], 1, "2 captures");
    let still: Value = serde_json::from_slice(&std::fs::read(&out).expect("still there")).expect("JSON");
    assert_eq!(still, written);
}
