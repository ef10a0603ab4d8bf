//! Tests of what all layouts have in common: steps, gaps, lenses and second cameras, and damaged files.

use super::fixtures::{
    FRAMES, NUMBERS, SIZE, check, check_pictures, log, plain, pose, setting, views, write_camera, write_color,
    write_depth, write_pictures, write_seven_scenes, write_tum,
};
use crate::OpenOptions;
use semascan_inspection::spec::CameraMask;
use semascan_model::LengthUnit;
use semascan_perception::view::PoseEvidence;
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};

#[test]
fn every_so_many_frames_are_taken_and_numbered_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    write_seven_scenes(folder.path(), SIZE);
    let options = OpenOptions { every: 3, intrinsics: Some(NUMBERS), ..plain() };
    let (mut source, found) = views(folder.path(), options).expect("views");
    assert_eq!(found.iter().map(|view| view.index).collect::<Vec<_>>(), [0, 1]);
    check(&found[0], 0);
    check(&found[1], 3);
    assert!(setting(source.as_ref(), "frames").contains("one of every 3: 2 of 4"));
    assert_eq!(source.info().view_count, Some(2));
    assert!(source.rewind() && source.next_view().expect("again").is_ok());
}

#[test]
fn a_gap_of_the_tracking_is_left_out_and_no_trajectory_gives_unposed_views() {
    let folder = tempfile::tempdir().expect("a folder");
    write_seven_scenes(folder.path(), SIZE);
    write_camera(folder.path());
    fs::write(folder.path().join("frame-000001.pose.txt"), "nan nan nan nan\n".repeat(4)).expect("written");
    let (source, found) = views(folder.path(), plain()).expect("views");
    assert_eq!(found.len(), 3);
    check(&found[1], 2);
    assert!(setting(source.as_ref(), "poses").contains("1 of 4 frames"), "{:?}", source.info().settings);
    for frame in 0..FRAMES {
        fs::remove_file(folder.path().join(format!("frame-{frame:06}.pose.txt"))).expect("removed");
    }
    let (source, found) = views(folder.path(), plain()).expect("views");
    assert!(found.len() == 4 && found.iter().all(|view| view.pose == PoseEvidence::None));
    assert!(setting(source.as_ref(), "poses").contains("no trajectory"));
}

#[test]
fn units_that_are_said_go_before_those_of_the_layout() {
    let folder = tempfile::tempdir().expect("a folder");
    write_seven_scenes(folder.path(), SIZE);
    write_camera(folder.path());
    let options = OpenOptions { unit: Some(LengthUnit::Millimetres), depth_scale: Some(0.25), ..plain() };
    let (source, found) = views(folder.path(), options).expect("views");
    let pose_found = found[0].pose.table_from_camera().expect("a pose");
    assert!((pose_found.translation.x - 0.2e-3).abs() < 1e-12);
    assert!((found[0].depth.at(5, 5).expect("depth") - 0.125).abs() < 1e-6);
    assert!(setting(source.as_ref(), "depth_unit").contains("0.2500 mm, as said"));
}

/// A lens and a depth camera of its own: colour is undistorted, depth is registered.
#[test]
fn a_lens_and_a_second_camera_are_brought_to_one_pinhole() {
    let folder = tempfile::tempdir().expect("a folder");
    for frame in 0..FRAMES {
        write_color(&folder.path().join(format!("color/{frame}.png")), (32, 24), frame);
        write_depth(&folder.path().join(format!("depth/{frame}.png")), SIZE, frame, 1000.0);
    }
    let color = json!({
        "width": 32, "height": 24, "intrinsic_matrix": [30.0, 0, 0, 0, 30.0, 0, 15.5, 11.5, 1],
        "distortion_model": "plumb_bob", "distortion_coefficients": [-0.05, 0.01, 0.001, 0.001, 0.0],
    });
    let mut depth = json!({
        "width": 16, "height": 12, "intrinsic_matrix": [15.0, 0, 0, 0, 15.0, 0, 7.5, 5.5, 1],
        "color_from_depth": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.02, 0, 0, 1],
    });
    let write = |name: &str, text: String| fs::write(folder.path().join(name), text).expect("written");
    write("intrinsic.json", color.to_string());
    let error = views(folder.path(), plain()).err().expect("sizes differ").to_string();
    assert!(error.contains("depth/0.png") && error.contains("depth_intrinsic.json"), "{error}");
    write("depth_intrinsic.json", depth.to_string());
    let (source, found) = views(folder.path(), plain()).expect("views");
    let view = &found[0];
    assert_eq!((view.depth.width, view.depth.height), (32, 24));
    let measured = view.depth.metres.iter().filter(|z| **z > 0.0).count();
    assert!(measured > 600 && view.depth.metres.iter().all(|z| *z == 0.0 || (z - 0.5).abs() < 1e-5), "{measured}");
    let said = setting(source.as_ref(), "intrinsics");
    assert!(said.contains("undistorted") && said.contains("registered"), "{said}");
    depth["color_from_depth"] = json!([1, 2, 3]);
    write("depth_intrinsic.json", depth.to_string());
    let error = views(folder.path(), plain()).err().expect("no pose").to_string();
    assert!(error.contains("depth_intrinsic.json") && error.contains("color_from_depth"), "{error}");
}

#[test]
fn a_mask_from_a_file_takes_its_pixels() {
    let folder = tempfile::tempdir().expect("a folder");
    write_seven_scenes(folder.path(), SIZE);
    write_camera(folder.path());
    let mask = folder.path().join("mask.png");
    image::GrayImage::from_fn(SIZE.0, SIZE.1, |u, _| image::Luma([if u < 8 { 255 } else { 0 }]))
        .save(&mask)
        .expect("written");
    let options = OpenOptions { camera_mask: CameraMask::File(mask), ..OpenOptions::default() };
    let (_, found) = views(folder.path(), options).expect("views");
    assert!(found[0].depth.at(7, 5).is_none() && found[0].depth.at(8, 5).is_some());
    // Looking for one costs no view.
    let (source, found) = views(folder.path(), OpenOptions::default()).expect("views");
    assert_eq!(found.len(), 4);
    assert!(setting(source.as_ref(), "camera_mask").contains("pixels ignored"));
}

#[test]
fn a_view_that_cannot_be_read_does_not_end_the_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    write_pictures(folder.path(), "color", SIZE);
    write_camera(folder.path());
    fs::write(folder.path().join("trajectory.log"), log()).expect("written");
    fs::write(folder.path().join("depth/00001.png"), b"\x89PNG\r\n\x1a\n").expect("written");
    let mut source = crate::open(folder.path().to_str().expect("UTF-8"), plain()).expect("opens");
    let read: Vec<_> = std::iter::from_fn(|| source.next_view()).collect();
    assert_eq!(read.iter().map(Result::is_ok).collect::<Vec<_>>(), [true, false, true, true]);
    let error = read[1].as_ref().expect_err("an error").to_string();
    assert!(error.contains("00001.png"), "{error}");
    check_pictures(read[2].as_ref().expect("a view"), 2);
}

/// Recordings of all layouts, each with every kind of damage to every file: an error names a file of the folder, or the views
/// that are left are those that were recorded.
#[test]
fn damaged_and_foreign_files_are_named() {
    type Write = fn(&Path);
    let layouts: [Write; 4] = [
        |folder| {
            write_tum(folder, SIZE);
            write_camera(folder);
        },
        |folder| {
            write_seven_scenes(folder, SIZE);
            let text = format!("{} 0 {}\n0 {} {}\n0 0 1\n", NUMBERS[0], NUMBERS[2], NUMBERS[1], NUMBERS[3]);
            fs::write(folder.join("camera-intrinsics.txt"), text).expect("written");
        },
        |folder| {
            write_pictures(folder, "image", SIZE);
            write_camera(folder);
            fs::create_dir(folder.join("scene")).expect("made");
            fs::write(folder.join("scene/trajectory.log"), log()).expect("written");
        },
        |folder| {
            write_pictures(folder, "rgb", SIZE);
            write_camera(folder);
            let extrinsic = |frame: u32| json!({ "extrinsic": pose(frame).inverse().to_homogeneous().as_slice() });
            let json = json!({ "parameters": (0..FRAMES).map(extrinsic).collect::<Vec<_>>() });
            fs::write(folder.join("trajectory.json"), json.to_string()).expect("written");
        },
    ];
    let (mut opened, mut errors) = (0, 0);
    for write in layouts {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path());
        let (_, whole) = views(folder.path(), plain()).expect("whole");
        assert_eq!(whole.len(), FRAMES as usize);
        for path in files(folder.path()) {
            let bytes = fs::read(&path).expect("reads");
            for damaged in damages(&bytes) {
                fs::write(&path, damaged).expect("written");
                match crate::open(folder.path().to_str().expect("UTF-8"), plain()) {
                    Ok(mut source) => {
                        opened += 1;
                        while let Some(view) = source.next_view() {
                            match view {
                                Ok(view) => view.check_sizes().expect("one size"),
                                Err(error) => {
                                    errors += 1;
                                    assert!(
                                        error.to_string().contains(folder.path().to_str().expect("UTF-8")),
                                        "{error}"
                                    );
                                }
                            }
                        }
                    }
                    Err(error) => {
                        errors += 1;
                        assert!(error.to_string().contains(folder.path().to_str().expect("UTF-8")), "{error}");
                    }
                }
            }
            fs::write(&path, bytes).expect("written");
        }
    }
    assert!(opened > 100 && errors > 100, "{opened} opened, {errors} errors");
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut left = vec![folder.to_owned()];
    while let Some(folder) = left.pop() {
        for entry in fs::read_dir(folder).expect("lists") {
            let path = entry.expect("an entry").path();
            if path.is_dir() { left.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    found
}

/// Cut, with flipped bits, and replaced by other content.
fn damages(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut damaged: Vec<Vec<u8>> =
        [0, 1, bytes.len() / 3, bytes.len().saturating_sub(1)].map(|end| bytes[..end].to_vec()).to_vec();
    for part in 0..8 {
        let mut flipped = bytes.to_vec();
        let at = part * bytes.len() / 8;
        if let Some(byte) = flipped.get_mut(at) {
            *byte ^= 1 << (part % 8);
        }
        damaged.push(flipped);
    }
    damaged.push(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\xff\xff\xff\xff\xff\xff\xff\xff\x10\0\0\0\0".to_vec());
    damaged.push(b"{\"width\": 1e300, \"height\": -5, \"intrinsic_matrix\": [[[[]]]], \"parameters\": 7}".to_vec());
    damaged.push("9".repeat(5000).into_bytes());
    damaged.push("1 2 3\n4 5 6 7\n".repeat(200).into_bytes());
    damaged
}
