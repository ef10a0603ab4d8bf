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
    assert_eq!(child.wait().expect("ends").code(), Some(1));
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
    std::fs::write(dir.path().join("notes.txt"), "mine").expect("written");
    let again = semascan(&["inspect", MOTOR, "--out", out, "--overwrite", "--labels", "none"]);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    assert_ne!(record(dir.path()).expect("a record").id, before.id);
    assert!(dir.path().join("notes.txt").is_file(), "what is not ours stays");
    assert!(!dir.path().join("views/000000.ply").exists(), "the clouds were of the earlier inspection");
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
