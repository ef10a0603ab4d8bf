//! `semascan evaluate`.

use crate::{semascan, stderr};
use std::path::Path;

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
fn poses_are_judged_by_the_pictures() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let file = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    // Neighbouring views see the same ground; the robot is off, and the inspection refines its poses.
    let motor = "virtual:starter-motor?seed=3&views=30&size=640x480&cell=1.5";
    let out = file("motor");
    let output = semascan(&["inspect", motor, "--out", &out]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("pictures: the poses agree with them to"), "{}", stderr(&output));
    let text = std::fs::read_to_string(dir.path().join("motor/inspection.json")).expect("reads");
    let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let of_record = &record["photometric"];
    let (error, prior) =
        (of_record["error"].as_f64().expect("known"), of_record["prior_error"].as_f64().expect("known"));
    assert!(error < 1.0 && prior > error, "{error} px, kinematic {prior} px");
    assert!(of_record["matches"].as_u64().expect("a count") >= 30 && of_record["pairs"].as_u64().expect("a count") > 3);

    // The same from the recorded poses and the source, and poses of another program on the same matches: ours, but each
    // second camera half a centimetre aside.
    let mut views = record["views"].clone();
    for view in views.as_array_mut().expect("views").iter_mut().step_by(2) {
        let x = &mut view["pose"]["translation"][0];
        *x = (x.as_f64().expect("metres") + 5e-3).into();
    }
    std::fs::write(file("other.json"), serde_json::json!({ "views": views }).to_string()).expect("writes");
    let arguments = ["evaluate", "--photometric", &out, motor, "--poses", &file("other.json"), "--json"];
    let output = semascan(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let errors: Vec<f64> =
        report["poses"].as_array().expect("poses").iter().map(|p| p["error"].as_f64().expect("known")).collect();
    let [ours, other, kinematic] = errors[..] else { panic!("{errors:?}") };
    assert!((ours - error).abs() < 0.2 && kinematic > ours, "{errors:?}, recorded {error}");
    assert!(other > ours + 2.0, "{errors:?}");

    // Poses of another source, and what is no file of poses, are refused by name.
    let elsewhere =
        semascan(&["evaluate", "--photometric", &out, "virtual:starter-motor?seed=3&views=2&size=96x72&cell=4"]);
    assert_eq!(elsewhere.status.code(), Some(1));
    assert!(stderr(&elsewhere).contains("30 views") && stderr(&elsewhere).contains("inspection.json"));
    std::fs::write(file("broken.json"), "{\"views\": [{\"index\": 0}]}").expect("writes");
    let broken = semascan(&["evaluate", "--photometric", &file("broken.json"), motor]);
    assert!(broken.status.code() == Some(1) && stderr(&broken).contains("accepted"), "{}", stderr(&broken));
    assert_eq!(semascan(&["evaluate", "--photometric", &file("missing"), motor]).status.code(), Some(2));
}
