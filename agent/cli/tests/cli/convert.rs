//! `semascan convert`: what is inspected of the copy is what is inspected of the source.

use crate::{MOTOR, semascan, stderr, without_generation};
use std::path::Path;

fn cloud_of(source: &str, out: &Path) -> Vec<u8> {
    let output = semascan(&["inspect", source, "--out", out.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(0), "{source}: {}", stderr(&output));
    without_generation(std::fs::read(out.join("cloud.ply")).expect("a cloud"))
}

#[test]
fn a_capture_of_a_source_gives_its_model_bit_for_bit_and_a_scene_is_inspected_too() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name);
    let text = |name: &str| path(name).to_str().expect("UTF-8").to_owned();
    let (capture, scene) = (text("motor.mcap"), text("scene"));

    let made = semascan(&["convert", MOTOR, &capture]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    assert!(stderr(&made).contains("motor.mcap: 3 views"), "{}", stderr(&made));
    assert_eq!(cloud_of(&capture, &path("copy")), cloud_of(MOTOR, &path("original")));

    // Of the capture again, and only a part of it.
    let made = semascan(&["convert", &capture, &scene, "--first", "2"]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    assert!(!cloud_of(&scene, &path("of-scene")).is_empty());
    assert_eq!(std::fs::read_dir(path("scene/rgb")).expect("a folder").count(), 2);
}

#[test]
fn nothing_is_replaced_unasked_and_a_call_that_is_wrong_is_refused() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let (capture, other) = (path("motor.mcap"), path("other.mcap"));
    let run = |arguments: &[&str]| {
        let output = semascan(&[&["convert"], arguments].concat());
        (output.status.code(), stderr(&output))
    };
    assert_eq!(run(&[MOTOR, &capture, "--first", "1"]).0, Some(0));
    let before = std::fs::read(&capture).expect("reads");
    let (code, text) = run(&[MOTOR, &capture]);
    assert!(code == Some(2) && text.contains("--overwrite"), "{text}");
    let (code, text) = run(&[&capture, &capture, "--overwrite"]);
    assert!(code == Some(2) && text.contains("the source itself"), "{text}");
    let (code, text) = run(&[&path("missing"), &other]);
    assert!(code == Some(2) && text.contains("missing"), "{text}");
    assert_eq!(std::fs::read(&capture).expect("reads"), before);
    assert!(!Path::new(&other).exists());
    assert_eq!(run(&[MOTOR, &capture, "--first", "2", "--overwrite"]).0, Some(0));
    assert_ne!(std::fs::read(&capture).expect("reads"), before);

    // A source with no view that can be read is not a copy.
    std::fs::write(path("empty.mcap"), b"\x89MCAP0\r\n").expect("written");
    let (code, text) = run(&[&path("empty.mcap"), &other]);
    assert!(code != Some(0) && text.contains("empty.mcap"), "{text}");
}
