//! What an inspection leaves behind however it ends, and what it says of itself.

use crate::{MOTOR, semascan, stderr};
use semascan_model::record::{InspectionRecord, Outcome};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn record(folder: &Path) -> Option<InspectionRecord> {
    let text = std::fs::read_to_string(folder.join("inspection.json")).ok()?;
    Some(InspectionRecord::from_json(&text).expect("a whole record"))
}

/// An inspection that goes on until it is ended, and its record says that it runs.
fn endless(folder: &Path) -> Child {
    let source = "virtual:starter-motor?seed=3&views=200&size=64x48&cell=4";
    let child = Command::new(env!("CARGO_BIN_EXE_semascan"))
        .args(["inspect", source, "--pace", "0.5", "--registration", "kinematic", "--out"])
        .arg(folder)
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    let begun = Instant::now();
    while record(folder).is_none() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no record");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(record(folder).expect("a record").outcome, Outcome::Running);
    child
}

#[test]
fn a_killed_inspection_never_says_that_it_finished() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let mut child = endless(dir.path());
    child.kill().expect("killed");
    child.wait().expect("gone");
    let record = record(dir.path()).expect("a record");
    assert_eq!((record.outcome, record.views.len(), record.run), (Outcome::Running, 0, None));
}

#[cfg(unix)]
#[test]
fn an_interrupted_inspection_is_written_and_says_that_it_was_stopped() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let mut child = endless(dir.path());
    std::thread::sleep(Duration::from_millis(1500));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill is there");
    assert!(sent.success());
    assert_eq!(child.wait().expect("ends").code(), Some(130));
    let record = record(dir.path()).expect("a record");
    assert_eq!(record.outcome, Outcome::Stopped);
    assert!(!record.views.is_empty() && record.views.len() < 200, "{} views", record.views.len());
    assert!(dir.path().join("cloud.ply").is_file(), "the model of the views until then");
}

#[test]
fn a_failed_inspection_says_why_and_too_few_views_are_no_success() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("nothing");
    let inspect = |out: &Path, more: &[&str]| {
        semascan(&[&["inspect", MOTOR, "--out", out.to_str().expect("UTF-8")], more].concat())
    };
    let failed = inspect(&out, &["--depth", "50..60"]);
    assert_eq!(failed.status.code(), Some(1), "{}", stderr(&failed));
    assert!(stderr(&failed).contains("region of interest"), "{}", stderr(&failed));
    let failed = record(&out).expect("a record");
    assert!(matches!(&failed.outcome, Outcome::Failed { reason } if reason.contains("no view")), "{failed:?}");
    let run = failed.run.expect("it ran");
    assert_eq!((run.views, run.used, run.sufficient), (3, 0, false));
    assert!(run.region.outside_depth > 0 && run.region.outside_depth == run.region.measured);
    assert_eq!(failed.views.len(), 3);

    let out = dir.path().join("all");
    let all = inspect(&out, &["--least-views", "1"]);
    assert_eq!(all.status.code(), Some(0), "{}", stderr(&all));
    assert!(stderr(&all).contains("3 of 3 views used (100 %"), "{}", stderr(&all));
    let wrong = inspect(&dir.path().join("wrong"), &["--least-views", "1.5"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", stderr(&wrong));
}

/// A labelled scene of three views, 128 x 96 pixels.
fn synthetic_scene(folder: &Path) -> String {
    let set = folder.join("set");
    let synth = ["synth", "--out", set.to_str().expect("UTF-8"), "--views", "3", "--size", "128x96", "--seed", "2"];
    let synth = semascan(&[&synth[..], &["--parts", "1", "--window", "64x80"]].concat());
    assert_eq!(synth.status.code(), Some(0), "{}", stderr(&synth));
    set.join("000000").display().to_string()
}

#[test]
fn a_model_of_one_view_in_three_is_kept_but_is_no_success_unless_that_was_asked_for() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let scene = synthetic_scene(dir.path());
    for view in [0, 2] {
        std::fs::remove_file(Path::new(&scene).join(format!("depth/{view:06}.png"))).expect("removed");
    }
    let inspect = |name: &str, share: &str| {
        let out = dir.path().join(name);
        let output = semascan(&["inspect", &scene, "--least-views", share, "--out", out.to_str().expect("UTF-8")]);
        (output, record(&out).expect("a record"))
    };
    let (output, few) = inspect("few", "0.5");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("1 of 3 views") && text.contains("--least-views") && text.contains("000000.png"), "{text}");
    let run = few.run.expect("it ran");
    assert_eq!((few.outcome, run.views, run.used, run.sufficient), (Outcome::Finished, 3, 1, false));
    assert!(dir.path().join("few/mesh.ply").is_file());
    let (output, enough) = inspect("enough", "0.3");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(enough.run.is_some_and(|run| run.sufficient));
}

#[test]
fn a_folder_that_holds_something_is_refused_until_it_may_be_replaced() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().to_str().expect("UTF-8");
    let first = semascan(&["inspect", MOTOR, "--out", out, "--view-clouds"]);
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    let before = record(dir.path()).expect("a record");
    let refused = semascan(&["inspect", MOTOR, "--out", out]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("--overwrite") && stderr(&refused).contains(out), "{}", stderr(&refused));
    assert_eq!(record(dir.path()).expect("a record").id, before.id, "nothing was touched");
    let notes = dir.path().join("notes.txt");
    std::fs::write(&notes, "mine").expect("written");
    let foreign = semascan(&["inspect", MOTOR, "--out", out, "--overwrite"]);
    assert_eq!(foreign.status.code(), Some(2), "{}", stderr(&foreign));
    assert!(stderr(&foreign).contains("holds notes.txt"), "{}", stderr(&foreign));
    assert_eq!(record(dir.path()).expect("a record").id, before.id, "nothing was touched");
    assert_eq!(std::fs::read_to_string(&notes).expect("there"), "mine");
    std::fs::remove_file(&notes).expect("removed");
    let exported = semascan(&["export", out, "--format", "obj,stl,glb"]);
    assert_eq!(exported.status.code(), Some(0), "{}", stderr(&exported));

    // An inspection that comes to nothing does not take the earlier one away.
    let failed = semascan(&["inspect", MOTOR, "--out", out, "--overwrite", "--voxel", "1e-9"]);
    assert_eq!(failed.status.code(), Some(1), "{}", stderr(&failed));
    assert!(stderr(&failed).contains("still holds the earlier inspection"), "{}", stderr(&failed));
    assert_eq!(record(dir.path()).expect("a record").id, before.id);

    let again = semascan(&["inspect", MOTOR, "--out", out, "--overwrite", "--labels", "none"]);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    assert_ne!(record(dir.path()).expect("a record").id, before.id);
    assert!(!dir.path().join("views").exists(), "the clouds were of the earlier inspection");
    let names = || std::fs::read_dir(dir.path()).expect("reads").map(|e| e.expect("readable").file_name());
    let mut names: Vec<_> = names().map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    assert_eq!(
        names.join(" "),
        "cloud.ply inspection.json mesh.ply report.html scene.glb truth.ply",
        "nothing else stays"
    );
}

#[test]
fn files_of_two_inspections_are_never_taken_for_one() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    for name in ["one", "two"] {
        assert_eq!(semascan(&["inspect", MOTOR, "--out", &path(name)]).status.code(), Some(0));
    }
    let scene = gltf::Gltf::open(dir.path().join("one/scene.glb")).expect("valid");
    let extras: serde_json::Value =
        serde_json::from_str(scene.document.as_json().asset.extras.as_ref().expect("extras").get()).expect("JSON");
    let files = record(&dir.path().join("one")).expect("a record").files.expect("listed");
    assert_eq!(extras["generation"].as_str(), Some(files.generation.as_str()));
    for file in ["mesh.ply", "cloud.ply", "report.html", "scene.glb", "truth.ply"] {
        let mixed = path(&format!("mixed-{file}"));
        std::fs::create_dir(&mixed).expect("made");
        for name in ["inspection.json", "mesh.ply", "cloud.ply", "report.html", "scene.glb", "truth.ply"] {
            let from = if name == file { "two" } else { "one" };
            std::fs::copy(dir.path().join(from).join(name), Path::new(&mixed).join(name)).expect("copied");
        }
        let model = format!("{mixed}/{file}");
        let mut calls = vec![vec!["export", &mixed, "--format", "obj"], vec!["serve", &mixed, "--port", "0"]];
        if file.ends_with(".ply") {
            calls.push(vec!["evaluate", &model, &model]);
        }
        for call in calls {
            let output = semascan(&call);
            assert_eq!(output.status.code(), Some(1), "{call:?}: {}", stderr(&output));
            let text = stderr(&output);
            assert!(text.contains(file) && text.contains("mixed"), "{call:?}: {text}");
        }
    }
    std::fs::remove_file(dir.path().join("one/scene.glb")).expect("removed");
    let half = semascan(&["serve", &path("one"), "--port", "0"]);
    assert_eq!(half.status.code(), Some(1), "{}", stderr(&half));
    assert!(stderr(&half).contains("scene.glb") && stderr(&half).contains("missing"), "{}", stderr(&half));
}

#[test]
fn a_left_out_view_fails_a_strict_inspection() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let scene = synthetic_scene(dir.path());
    let out = dir.path().join("out");
    let inspect = || semascan(&["inspect", &scene, "--strict", "--overwrite", "--out", out.to_str().expect("UTF-8")]);
    let whole = inspect();
    assert_eq!(whole.status.code(), Some(0), "{}", stderr(&whole));
    std::fs::remove_file(Path::new(&scene).join("depth/000001.png")).expect("removed");
    let strict = inspect();
    assert_eq!(strict.status.code(), Some(1), "{}", stderr(&strict));
    assert!(stderr(&strict).contains("1 of 3 views") && stderr(&strict).contains("--strict"), "{}", stderr(&strict));
    let record = record(&out).expect("a record");
    assert!(matches!(&record.outcome, Outcome::Failed { reason } if reason.contains("1 of 3")), "{:?}", record.outcome);
    assert!(out.join("mesh.ply").is_file(), "what there is of the model is kept");
}

#[test]
fn views_without_a_point_in_the_model_are_a_failure() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let scene = synthetic_scene(dir.path());
    let file = Path::new(&scene).join("scene_camera.json");
    let mut cameras: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).expect("reads")).expect("JSON");
    for camera in cameras.as_object_mut().expect("views").values_mut() {
        for number in camera["cam_t_w2c"].as_array_mut().expect("a vector") {
            *number = (number.as_f64().expect("a number") * 1e6).into();
        }
    }
    std::fs::write(&file, cameras.to_string()).expect("written");
    let out = dir.path().join("out");
    let far = semascan(&["inspect", &scene, "--unit", "mm", "--out", out.to_str().expect("UTF-8")]);
    assert_eq!(far.status.code(), Some(1), "{}", stderr(&far));
    let record = record(&out).expect("a record");
    assert!(
        matches!(&record.outcome, Outcome::Failed { reason } if reason.contains("no view")),
        "{:?}",
        record.outcome
    );
    assert!(!out.join("cloud.ply").exists(), "there is no model");
}

#[test]
fn without_labels_no_point_carries_one() {
    let dir = tempfile::tempdir().expect("temporary folder");
    // A labelled scene on disk, and the simulated part that knows its truth.
    let scene = synthetic_scene(dir.path());
    for (name, source) in [("scene", scene.as_str()), ("motor", MOTOR)] {
        let out = dir.path().join(name);
        let output = semascan(&["inspect", source, "--labels", "none", "--out", out.to_str().expect("UTF-8")]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains("labels: none were used"), "{}", stderr(&output));
        let bytes = std::fs::read(out.join("cloud.ply")).expect("reads");
        let cloud = semascan_formats::ply::read("cloud.ply", &bytes).expect("own file").mesh.vertices;
        assert!(cloud.len() > 100);
        assert!(cloud.labels.iter().chain(&cloud.defects).all(|l| *l == 0), "{name}");
        assert!(cloud.confidence.iter().all(|c| *c == 0.0), "{name}: no evidence is no confidence");
        let record = record(&out).expect("a record");
        assert!(record.components.iter().skip(1).all(|c| c.points == 0), "{name}");
    }
    let without = |labels: &str| {
        let out = dir.path().join(labels);
        std::fs::remove_dir_all(Path::new(&scene).join("mask_visib")).unwrap_or_default();
        semascan(&["inspect", &scene, "--labels", labels, "--out", out.to_str().expect("UTF-8")])
    };
    let refused = without("source");
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    let text = stderr(&refused);
    assert!(text.contains("mask_visib") && text.contains("--labels network or --labels none"), "{text}");
    assert_eq!(without("none").status.code(), Some(0));
}
