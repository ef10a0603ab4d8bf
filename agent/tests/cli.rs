//! The binary as a script sees it: files, exit codes, messages.

use std::path::Path;
use std::process::{Command, Output};

const MOTOR: &str = "virtual:starter-motor?seed=3&views=3&size=160x120&cell=2.5";

fn semascan(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_semascan")).args(args).output().expect("the binary starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn inspect_writes_the_whole_folder() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("motor");
    let output = semascan(&["inspect", MOTOR, "--out", out.to_str().expect("UTF-8"), "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for file in ["inspection.json", "cloud.ply", "mesh.ply", "scene.glb", "truth.ply"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let text = std::fs::read_to_string(out.join("inspection.json")).expect("reads");
    let written: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(printed, written);
    assert_eq!(written["schema_version"], 1);
    assert_eq!(written["views"].as_array().map(Vec::len), Some(3));
    // Robot errors are on by default: what they cost is told.
    assert!(written["truth"]["at_true_poses"]["label_accuracy"].is_number(), "{text}");
    assert!(stderr(&output).contains("with the true poses"), "{}", stderr(&output));
    // Poses are judged as they are and after one rigid alignment.
    let aligned = &written["truth"]["aligned"];
    assert_eq!(aligned["poses"].as_array().map(Vec::len), Some(3), "{text}");
    assert_ne!(aligned["prior_poses"], aligned["poses"], "the views were registered");
    assert_ne!(aligned["poses"], written["truth"]["poses"], "{text}");
    let registration = |i: usize| &written["views"][i]["registration"];
    assert_eq!(registration(0)["method"], "kinematic", "the first view has nothing to be aligned with");
    assert_eq!(registration(1)["method"], "kept prior", "it looks from the other side");
    assert!(registration(1)["reason"].as_str().is_some_and(|r| r.contains("lie on the model")), "{text}");
    assert_eq!(registration(2)["method"], "icp", "{text}");
    assert!(written["base_from_table"]["rotation"].is_array(), "P0 step 5");
    assert!(stderr(&output).contains("after one rigid alignment"), "{}", stderr(&output));
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
        &["inspect", MOTOR, "--out", out, "--labels", "network"],
        &["inspect", MOTOR],
        &["no-such-command"],
    ] {
        let output = semascan(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(!output.stderr.is_empty());
    }
    assert!(!Path::new(out).exists());

    // The folder cannot be made where a file stands.
    let file = dir.path().join("file");
    std::fs::write(&file, "in the way").expect("writes");
    let output = semascan(&["inspect", MOTOR, "--out", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("file"), "{}", stderr(&output));
}

#[test]
fn one_and_two_threads_write_the_same_cloud() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let cloud = |threads: &str| {
        let out = dir.path().join(threads);
        let output = semascan(&["inspect", MOTOR, "--out", out.to_str().expect("UTF-8"), "--threads", threads]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        std::fs::read(out.join("cloud.ply")).expect("reads")
    };
    assert!(cloud("1") == cloud("2"), "cloud.ply depends on the number of threads");
}

#[test]
fn export_writes_every_format_and_the_same_mesh_as_inspect() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let (motor, out) = (path("motor"), path("out"));
    assert_eq!(semascan(&["inspect", MOTOR, "--out", &motor]).status.code(), Some(0));
    let output = semascan(&["export", &motor, "--format", "ply,obj,stl,glb", "--out", &out, "--threads", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let bytes = |folder: &str, file: &str| std::fs::read(Path::new(folder).join(file)).expect("reads");
    assert!(bytes(&motor, "mesh.ply") == bytes(&out, "mesh.ply"), "the mesh differs from that of inspect");
    assert!(bytes(&out, "mesh.glb").starts_with(b"glTF"));
    let geometry = String::from_utf8(bytes(&out, "mesh.obj")).expect("text");
    let materials = String::from_utf8(bytes(&out, "mesh.mtl")).expect("text");
    for name in ["housing", "solenoid"] {
        assert!(geometry.contains(&format!("\ng {name}\nusemtl {name}\n")), "{name}");
        assert!(materials.contains(&format!("newmtl {name}\n")), "{name}");
        assert!(bytes(&out, &format!("mesh-{name}.stl")).len() > 84, "{name}");
    }

    // Fewer triangles and fewer points, where that is asked for.
    let faces = |folder: &str| {
        let text = String::from_utf8_lossy(&bytes(folder, "mesh.ply")).into_owned();
        let line = text.lines().find_map(|l| l.strip_prefix("element face ")).expect("faces");
        line.parse::<usize>().expect("a number")
    };
    let small = path("small");
    let simplified = ["export", &motor, "--format", "cloud,ply", "--simplify", "2000", "--out", &small];
    assert_eq!(semascan(&simplified).status.code(), Some(0));
    assert!(faces(&out) > 2000 && faces(&small) <= 2000, "{} and {}", faces(&out), faces(&small));
    assert!(String::from_utf8_lossy(&bytes(&small, "cloud.ply")).contains("element vertex 2000\n"));

    // The source is not overwritten, and what is wrong with a call is said.
    assert_eq!(semascan(&["export", &motor, "--format", "cloud"]).status.code(), Some(2));
    assert_eq!(semascan(&["export", &motor, "--format", "ply", "--pitch", "99"]).status.code(), Some(2));
    assert_eq!(semascan(&["export", &path("nowhere"), "--format", "ply"]).status.code(), Some(1));
}
