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

#[test]
fn captures_that_were_kept_back_decide_whether_a_result_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let by_opencv: Value = serde_json::from_str(CAPTURES).expect("JSON");
    let all = by_opencv["captures"].as_array().expect("captures");
    let write = |name: &str, captures: &[Value]| {
        let content = json!({ "temperature_c": 21.5, "captures": captures });
        std::fs::write(path(name), content.to_string()).expect("written");
    };
    write("captures.json", &all[..11]);
    write("verify.json", &all[11..]);
    let mut moved = all[11..].to_vec();
    moved[1]["camera_from_board"]["translation"][0] = json!(0.2);
    write("moved.json", &moved);
    std::fs::write(path("cell.toml"), "# Ours\n[cell]\nframes.ee = \"tool0\" # fine\n").expect("written");

    let [captures, out, report, cell] = ["captures.json", "calibration.json", "report.html", "cell.toml"].map(path);
    let call = |verify: &str, more: &[&str]| {
        let verify = path(verify);
        semascan(&[&["calibrate", &captures, "--verify", &verify, "--out", &out, "--write", &cell], more].concat())
    };
    let beyond = call("moved.json", &["--report", &report]);
    assert_eq!(beyond.status.code(), Some(1), "{}", stderr(&beyond));
    assert!(stderr(&beyond).contains("1 of 3 verification captures are beyond"), "{}", stderr(&beyond));
    assert!(!std::path::Path::new(&out).exists());
    assert!(std::fs::read_to_string(&report).expect("written all the same").contains("beyond the limits"));
    assert!(!std::fs::read_to_string(&cell).expect("still there").contains("calibration"));

    let within = call("verify.json", &[]);
    assert_eq!(within.status.code(), Some(0), "{}", stderr(&within));
    assert!(stderr(&within).contains("a capture that would help most"), "{}", stderr(&within));
    let named = std::fs::read_to_string(&cell).expect("written");
    let name = format!("calibration = \"{out}\"\n");
    assert_eq!(named.replace(&name, ""), "# Ours\n[cell]\nframes.ee = \"tool0\" # fine\n");

    // The doctor reads it, and reminds of the temperature.
    let doctor = semascan(&["doctor", "--config", &cell, "--temperature", "30"]);
    assert!(stderr(&doctor).contains("calibrated at 21.5 degrees Celsius and has 30.0"), "{}", stderr(&doctor));
}

#[test]
fn the_board_is_found_in_pictures() {
    use nalgebra::{Isometry3, Vector3};
    use semascan_boards::{Exposure, Renderer};
    use semascan_perception::view::{CameraModel, Distortion, Intrinsics};

    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let board = json!({ "type": "charuco", "columns": 7, "rows": 5, "square_mm": 20, "marker_mm": 15, "dictionary": "DICT_4X4_50" });
    let printed = serde_json::from_value(board.clone()).expect("a board");
    let pinhole = Intrinsics { width: 480, height: 360, fx: 470.0, fy: 470.0, cx: 240.0, cy: 180.0 };
    let renderer = Renderer::new(&CameraModel::new(pinhole, Distortion::None).expect("a camera"));
    let ee_from_camera = Isometry3::new(Vector3::new(0.02, 0.03, 0.05), Vector3::new(0.1, 0.0, 0.3));
    let mut captures = Vec::new();
    let tilts = [[0.0, 0.0, 0.1], [0.5, 0.0, 0.0], [-0.5, 0.1, 0.3], [0.1, 0.5, -0.3], [0.0, -0.5, 0.2]];
    for (k, tilt) in tilts.into_iter().enumerate() {
        let turned = Isometry3::rotation(Vector3::from(tilt));
        let camera_from_board =
            Isometry3::translation(0.0, 0.0, 0.3) * turned * Isometry3::translation(-0.07, -0.05, 0.0);
        let base_from_ee = camera_from_board.inverse() * ee_from_camera.inverse();
        let picture = format!("{k}.png");
        renderer
            .picture(&printed, &camera_from_board, Exposure { blur: 0.7, noise: 3.0, seed: k as u64 })
            .expect("a known dictionary")
            .save(path(&picture))
            .expect("written");
        let (q, t) = (base_from_ee.rotation.coords, base_from_ee.translation.vector);
        captures.push(json!({
            "base_from_ee": { "translation": [t.x, t.y, t.z], "rotation": { "x": q.x, "y": q.y, "z": q.z, "w": q.w } },
            "picture": picture
        }));
    }
    // One without a board is left out.
    image::GrayImage::from_pixel(480, 360, image::Luma([90])).save(path("grey.png")).expect("written");
    let mut grey = captures[0].clone();
    grey["picture"] = json!("grey.png");
    captures.insert(2, grey);
    let file = json!({
        "camera": { "width": 480, "height": 360, "fx": 470.0, "fy": 470.0, "cx": 240.0, "cy": 180.0 },
        "board": board, "captures": captures
    });
    let [captures, report] = ["captures.json", "report.html"].map(path);
    std::fs::write(&captures, file.to_string()).expect("written");
    let output = semascan(&["calibrate", &captures, "--report", &report, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("capture 2: grey.png: no board was found"), "{}", stderr(&output));
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for (axis, there) in [0.02, 0.03, 0.05].into_iter().enumerate() {
        let here = found["ee_from_camera"]["pose"]["translation"][axis].as_f64().expect("a number");
        assert!((here - there).abs() < 5e-4, "{here} and {there}");
    }
    assert_eq!(std::fs::read_to_string(&report).expect("written").matches("data:image/jpeg").count(), 5);

    let mut wrong = file;
    wrong["camera"]["width"] = json!(640);
    std::fs::write(&captures, wrong.to_string()).expect("written");
    let refused = semascan(&["calibrate", &captures]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("480 x 360 pixels, and the camera of 640 x 360"), "{}", stderr(&refused));
}
