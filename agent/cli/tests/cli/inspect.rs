//! `semascan inspect`: what it writes, and how a call ends.

use crate::{MOTOR, semascan, stderr, without_generation};
use std::path::Path;

#[test]
fn inspect_writes_the_whole_folder() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("motor");
    let output = semascan(&["inspect", MOTOR, "--out", out.to_str().expect("UTF-8"), "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for file in ["inspection.json", "cloud.ply", "mesh.ply", "report.html", "scene.glb", "truth.ply"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    // The scene is the mesh, by component.
    let mesh = std::fs::read(out.join("mesh.ply")).expect("reads");
    let faces = semascan_formats::ply::read("mesh.ply", &mesh).expect("own file").mesh.triangles.len();
    let scene = gltf::Gltf::open(out.join("scene.glb")).expect("valid");
    let root = scene.default_scene().and_then(|s| s.nodes().next()).expect("a root");
    let primitives = root.children().filter_map(|n| n.mesh()).flat_map(|m| m.primitives().collect::<Vec<_>>());
    let corners: usize = primitives.filter_map(|p| p.indices()).map(|i| i.count()).sum();
    assert_eq!((corners, faces > 1000), (3 * faces, true));
    assert!(scene.extensions_used().any(|e| e == "EXT_structural_metadata"));
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let text = std::fs::read_to_string(out.join("inspection.json")).expect("reads");
    let written: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(printed, written);
    assert_eq!((&written["schema_version"], &written["outcome"]["state"]), (&2.into(), &"finished".into()));
    assert!(semascan_model::record::InspectionRecord::from_json(&text).is_ok(), "{text}");
    assert_eq!(written["views"].as_array().map(Vec::len), Some(3));
    // Robot errors are on by default: what they cost is printed.
    assert!(written["truth"]["at_true_poses"]["label_accuracy"].is_number(), "{text}");
    assert!(stderr(&output).contains("with the true poses"), "{}", stderr(&output));
    // Poses are judged as they are and after one rigid alignment.
    let aligned = &written["truth"]["aligned"];
    assert_eq!(aligned["poses"].as_array().map(Vec::len), Some(3), "{text}");
    assert_ne!(aligned["prior_poses"], aligned["poses"], "the views were registered");
    assert_ne!(aligned["poses"], written["truth"]["poses"], "{text}");
    let registration = |i: usize| &written["views"][i]["registration"];
    assert_eq!(registration(0)["method"], "kinematic", "the first view has nothing to be aligned with");
    assert_eq!(registration(1)["method"], "kept_prior", "it looks from the other side");
    assert!(registration(1)["reason"].as_str().is_some_and(|r| r.contains("lie on the model")), "{text}");
    assert_eq!(registration(2)["method"], "icp", "{text}");
    assert!(written["base_from_table"]["rotation"]["w"].is_number(), "P0 step 5");
    assert!(stderr(&output).contains("after one rigid alignment"), "{}", stderr(&output));
}

#[test]
fn keyframes_are_counted_and_each_has_a_cloud_of_its_own() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("motor");
    let args = ["inspect", MOTOR, "--out", out.to_str().expect("UTF-8"), "--keyframes", "--view-clouds", "--json"];
    let output = semascan(&args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(record["settings"].to_string().contains("3 of 3 views"), "{}", record["settings"]);
    for view in 0..3 {
        let bytes = std::fs::read(out.join(format!("views/{view:06}.ply"))).expect("a cloud");
        let header = String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]).into_owned();
        assert!(header.contains("comment label 2 solenoid") && header.contains(&format!("comment view {view}")));
    }
}

#[test]
fn kinematics_alone_leave_the_poses_as_they_are() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("motor");
    let out = out.to_str().expect("UTF-8");
    let output = semascan(&["inspect", MOTOR, "--out", out, "--registration", "kinematic", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let aligned = &record["truth"]["aligned"];
    assert_eq!(aligned["prior_poses"], aligned["poses"]);
    assert_eq!(record["views"][1]["registration"]["method"], "kinematic");
    assert!(record["refinement"].is_null());
}

#[test]
fn wrong_calls_end_with_2_and_failed_work_with_1() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("x");
    let out = out.to_str().expect("UTF-8");
    for args in [
        &["inspect", "virtual:starter-motor?sed=7", "--out", out][..],
        &["inspect", "/no/such/folder", "--out", out],
        &["inspect", "ftp://cell", "--out", out],
        &["inspect", MOTOR, "--out", out, "--voxel", "-1"],
        &["inspect", MOTOR, "--out", out, "--labels", "network", "--models", "no-such-model"],
        &["inspect", MOTOR],
        &["no-such-command"],
    ] {
        let output = semascan(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(!output.stderr.is_empty());
    }
    assert!(!Path::new(out).exists());

    // A file where the folder should be is a wrong call too.
    let file = dir.path().join("file");
    std::fs::write(&file, "in the way").expect("writes");
    let output = semascan(&["inspect", MOTOR, "--out", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("file"), "{}", stderr(&output));
}

#[test]
fn one_and_two_threads_write_the_same_cloud() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let cloud = |threads: &str| {
        let out = dir.path().join(threads);
        let output = semascan(&["inspect", MOTOR, "--out", out.to_str().expect("UTF-8"), "--threads", threads]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        without_generation(std::fs::read(out.join("cloud.ply")).expect("reads"))
    };
    assert!(cloud("1") == cloud("2"), "cloud.ply depends on the number of threads");
}
