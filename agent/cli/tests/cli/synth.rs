//! `semascan synth`.

use crate::{semascan, stderr};
use std::path::Path;
use std::process::Output;

#[test]
fn synth_writes_a_set_goes_on_with_it_and_refuses_another() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("set");
    let out = out.to_str().expect("UTF-8");
    let synth = |more: &[&str]| {
        let call = ["synth", "--out", out, "--views", "2", "--size", "128x96", "--window", "64x80", "--json"];
        semascan(&[&call, more].concat())
    };
    let summary = |output: &Output| -> serde_json::Value {
        assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
        serde_json::from_slice(&output.stdout).expect("one JSON object")
    };
    let first = summary(&synth(&["--parts", "1", "--seed", "3"]));
    assert_eq!((&first["parts_written"], &first["views_written"]), (&1.into(), &2.into()));
    for file in ["dataset.json", "000000/rgb/000001.png", "000000/labels/000001.png", "000000/scene_camera.json"] {
        assert!(Path::new(out).join(file).is_file(), "{file}");
    }
    let picture = std::fs::read(Path::new(out).join("000000/rgb/000001.png")).expect("reads");
    let next = synth(&["--parts", "2", "--seed", "3"]);
    assert!(stderr(&next).contains("1 of 2 parts are there already"), "{}", stderr(&next));
    assert_eq!(summary(&next)["parts_written"], 1);
    assert_eq!(std::fs::read(Path::new(out).join("000000/rgb/000001.png")).expect("reads"), picture);
    let apart = summary(&synth(&["--parts", "1", "--first-part", "1", "--seed", "3"]));
    assert_eq!((&apart["parts_kept"], &apart["dataset"]["parts"]), (&1.into(), &2.into()));
    let other = synth(&["--parts", "1", "--seed", "4"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(stderr(&other).contains("seed") && stderr(&other).contains("dataset.json"), "{}", stderr(&other));
}

#[test]
fn synth_refuses_wrong_calls_and_names_what_it_cannot_write() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let file = dir.path().join("file");
    std::fs::write(&file, b"in the way").expect("written");
    let synth = |out: &Path, more: &[&str]| {
        let call = ["synth", "--out", out.to_str().expect("UTF-8"), "--seed", "3"];
        semascan(&[&call, more].concat())
    };
    for (more, word) in [
        (&["--parts", "0", "--views", "1"][..], "--parts"),
        (&["--parts", "1"][..], "--views"),
        (&["--parts", "1", "--views", "1", "--size", "640"][..], "WIDTHxHEIGHT"),
        (&["--parts", "1", "--views", "1", "--window", "800x256"][..], "--window"),
        (&["--parts", "1", "--views", "1", "--threads", "0"][..], "--threads"),
    ] {
        let output = synth(&dir.path().join("set"), more);
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert!(stderr(&output).contains(word), "{more:?}: {}", stderr(&output));
    }
    assert!(!dir.path().join("set").exists(), "a wrong call leaves nothing behind");
    let output = synth(&file.join("set"), &["--parts", "1", "--views", "1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("file/set"), "{}", stderr(&output));
}

#[test]
fn synth_writes_turntables_without_poses_and_their_truth_beside() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("set");
    let call = ["synth", "--turntable", "can", "--disc", "plain", "--parts", "1", "--views", "3", "--seed", "5"];
    let more = ["--size", "64x48", "--step", "-20", "--json", "--out", out.to_str().expect("UTF-8")];
    let output = semascan(&[&call[..], &more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let scene = out.join("000000");
    let read = |file: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(scene.join(file)).expect("reads")).expect("JSON")
    };
    let cameras = read("scene_camera.json");
    assert_eq!(cameras.as_object().map(|c| c.len()), Some(3));
    assert!(cameras["0"].get("cam_t_w2c").is_none(), "a recording holds no poses");
    let truth = read("truth.json");
    assert_eq!(truth["simulated"], true);
    assert_eq!(truth["table_from_camera"].as_array().map(Vec::len), Some(3));
    assert!((truth["step_deg"].as_f64().expect("a number").abs() - 20.0).abs() < 1e-9);
    for wrong in [&["--step", "0"][..], &["--step", "nan"], &["--turntable", "teapot"]] {
        let line = [
            &["synth", "--parts", "1", "--views", "3", "--seed", "5", "--out", "x"][..],
            &["--turntable", "can"],
            wrong,
        ];
        assert_eq!(semascan(&line.concat()).status.code(), Some(2), "{wrong:?}");
    }
}
