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
    // The scene is the mesh, by component.
    let mesh = std::fs::read(out.join("mesh.ply")).expect("reads");
    let faces = semascan_shared::import::ply::read(&mesh).expect("own file").mesh.triangles.len();
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

/// A motor's model and its truth, in a folder of their own.
fn inspected(folder: &Path) -> (String, String) {
    let out = folder.join("motor");
    let motor = "virtual:starter-motor?seed=3&views=6&size=320x240&cell=1.5&errors=none";
    let output = semascan(&["inspect", motor, "--out", out.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let file = |name: &str| out.join(name).to_str().expect("UTF-8").to_owned();
    (file("cloud.ply"), file("truth.ply"))
}

fn evaluated(args: &[&str]) -> serde_json::Value {
    let output = semascan(&[&["evaluate"], args, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", stderr(&output));
    assert!(stderr(&output).contains("95th percentile"), "every figure has its convention: {}", stderr(&output));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn evaluate_finds_what_the_inspection_says_of_its_truth() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let (cloud, truth) = inspected(dir.path());
    let text = std::fs::read_to_string(dir.path().join("motor/inspection.json")).expect("reads");
    let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let report = evaluated(&[&cloud, &truth]);
    for (figure, of) in [("hd95", "hd95"), ("mean_error", "mean_error")] {
        let (a, b) = (&report["metrics"]["a_to_b"][figure], &record["truth"][of]);
        let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
        assert!((a - b).abs() < 1e-7, "{figure}: {a} and {b}");
    }
    let solenoid = |classes: &serde_json::Value| classes.as_array().expect("classes")[1]["iou"].clone();
    let (a, b) = (solenoid(&report["classes"]), solenoid(&record["truth"]["components"]));
    assert!((a.as_f64().expect("IoU") - b.as_f64().expect("IoU")).abs() < 1e-9, "{a} and {b}");

    // A cloud against itself is exact, and so is its mirror image's distance both ways.
    let same = evaluated(&[&cloud, &cloud]);
    assert_eq!(same["metrics"]["chamfer"], 0.0);
    assert_eq!(same["metrics"]["f_score"], 1.0);
}

#[test]
fn alignment_undoes_a_motion() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let (cloud, truth) = inspected(dir.path());
    // The model's points, turned by 90 degrees about x and moved by a metre.
    let bytes = std::fs::read(&cloud).expect("reads");
    let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    let header = String::from_utf8_lossy(&bytes[..end]);
    let count: usize =
        header.lines().find_map(|l| l.strip_prefix("element vertex ")).and_then(|n| n.parse().ok()).expect("a count");
    let stride = (bytes.len() - end) / count;
    let mut lines = String::new();
    let mut kept = 0;
    for point in bytes[end..].chunks_exact(stride) {
        let c = |k: usize| f32::from_le_bytes([point[k], point[k + 1], point[k + 2], point[k + 3]]);
        // The flags come last; the turntable and strays are no part of the model.
        if point[stride - 2] & 7 == 0 {
            lines += &format!("{} {} {}\n", c(0) + 1.0, -c(8), c(4));
            kept += 1;
        }
    }
    let moved = format!(
        "ply\nformat ascii 1.0\nelement vertex {kept}\nproperty float x\nproperty float y\nproperty float z\nend_header\n{lines}"
    );
    let elsewhere = dir.path().join("moved.ply");
    std::fs::write(&elsewhere, moved).expect("writes");
    let elsewhere = elsewhere.to_str().expect("UTF-8");
    let apart = evaluated(&[elsewhere, &truth]);
    assert!(apart["metrics"]["a_to_b"]["mean_error"].as_f64() > Some(0.5), "{apart}");
    let report = evaluated(&[elsewhere, &truth, "--align", "--samples", "60000"]);
    assert_eq!(report["alignments"].as_array().map(Vec::len), Some(10), "{}", report["without_match"]);
    let range = &report["ranges"]["mean_error_a_to_b"];
    let (min, max) = (range["min"].as_f64().expect("min"), range["max"].as_f64().expect("max"));
    assert!(min <= max && max < 4e-4, "mean error from {min} to {max} m");
}

#[test]
fn evaluate_tells_bad_files_from_bad_calls() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let write = |name: &str, content: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, content).expect("writes");
        path.to_str().expect("UTF-8").to_owned()
    };
    let good = write("good.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let header = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
    let nowhere = dir.path().join("nan.ply");
    let binary = header.replace("ascii", "binary_little_endian") + "end_header\n";
    std::fs::write(&nowhere, [binary.as_bytes(), &f32::NAN.to_le_bytes().repeat(6)].concat()).expect("writes");
    for bad in [
        write("empty.ply", &format!("{}end_header\n", header.replace("vertex 2", "vertex 0"))),
        nowhere.to_str().expect("UTF-8").to_owned(),
        write("cut.ply", &format!("{header}end_header\n0 0 0\n")),
        write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        write("nothing.pcd", ""),
        write("nothing.stl", ""),
        write("nothing.glb", "glTF"),
    ] {
        let name = Path::new(&bad).file_name().expect("a name").to_string_lossy().into_owned();
        for args in [["evaluate", &bad, &good], ["evaluate", &good, &bad]] {
            let output = semascan(&args);
            assert_eq!(output.status.code(), Some(1), "{args:?}: {}", stderr(&output));
            assert!(stderr(&output).contains(&name), "{args:?}: {}", stderr(&output));
        }
    }
    let text = write("a.txt", "0 0 0");
    for args in [
        &["evaluate", &good][..],
        &["evaluate", &good, "/no/such.ply"],
        &["evaluate", &good, &text],
        &["evaluate", &good, &good, "--tau", "-1"],
        &["evaluate", &good, &good, "--samples", "0"],
        &["evaluate", &good, &good, "--scale-a", "nan"],
    ] {
        let output = semascan(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
    }
    // One triangle is no surface that could be aligned: said with both names, not a panic.
    let point = write("point.ply", &format!("{header}end_header\n0 0 0\n0 0 0\n"));
    let output = semascan(&["evaluate", &point, &good, "--align"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("point.ply") && stderr(&output).contains("good.obj"), "{}", stderr(&output));
}

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
