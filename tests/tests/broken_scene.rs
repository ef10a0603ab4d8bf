//! Broken BOP scenes: each view that cannot be used says which file or field is at fault, and the others go on.

use semascan_tests::inspect::inspect;
use semascan_tests::scene;
use semascan_tests::sources::open;
use std::path::Path;

/// Breaks view 1 of three, inspects, and returns why it was left out.
fn reason_for(break_view_1: impl FnOnce(&Path)) -> String {
    let dir = tempfile::tempdir().expect("temporary folder");
    scene::write(dir.path(), 3).expect("scene");
    break_view_1(dir.path());
    let source = open(dir.path().to_str().expect("UTF-8")).expect("the scene opens");
    let inspected = inspect(source).expect("two good views");
    assert_eq!(inspected.model.read().kept_views().len(), 2, "the other views are fused");
    let reasons = inspected.recorded.rejections();
    assert_eq!(reasons.len(), 1, "{reasons:?}");
    reasons.into_iter().next().unwrap_or_default()
}

fn truncate(file: &Path) {
    let bytes = std::fs::read(file).expect("reads");
    std::fs::write(file, &bytes[..bytes.len() / 2]).expect("writes");
}

#[test]
fn a_truncated_picture_is_named() {
    for kind in ["rgb", "depth"] {
        let reason = reason_for(|dir| truncate(&dir.join(kind).join("000001.png")));
        assert!(reason.contains(&format!("{kind}/000001.png")), "{reason}");
    }
    let reason = reason_for(|dir| truncate(&dir.join("mask_visib/000001_000000.png")));
    assert!(reason.contains("mask_visib/000001_000000.png"), "{reason}");
}

#[test]
fn depth_of_the_wrong_size_is_named_with_both_sizes() {
    let reason = reason_for(|dir| {
        let small: image::ImageBuffer<image::Luma<u16>, Vec<u16>> = image::ImageBuffer::new(10, 10);
        small.save(dir.join("depth/000001.png")).expect("saves");
    });
    assert!(reason.contains("depth/000001.png") && reason.contains("10x10") && reason.contains("64x48"), "{reason}");
}

#[test]
fn depth_that_is_not_16_bit_is_named() {
    let reason = reason_for(|dir| {
        std::fs::copy(dir.join("rgb/000001.png"), dir.join("depth/000001.png")).expect("copies");
    });
    assert!(reason.contains("depth/000001.png") && reason.contains("16-bit"), "{reason}");
}

#[test]
fn a_missing_camera_entry_is_named() {
    let reason = reason_for(|dir| scene::edit(&dir.join("scene_camera.json"), "\"1\":", "\"x\":").expect("edits"));
    assert!(reason.contains("scene_camera.json") && reason.contains("field 1"), "{reason}");
}

#[test]
fn a_pose_that_is_no_number_is_named() {
    let reason = reason_for(|dir| scene::edit(&dir.join("scene_camera.json"), "-10.0", "NaN").expect("edits"));
    assert!(reason.contains("scene_camera.json") && reason.contains("1.cam_t_w2c[0]"), "{reason}");
}

#[test]
fn a_missing_picture_is_named() {
    let reason = reason_for(|dir| std::fs::remove_file(dir.join("rgb/000001.png")).expect("removes"));
    assert!(reason.contains("rgb/000001.png"), "{reason}");
}

#[test]
fn a_view_without_any_depth_is_left_out() {
    let reason = reason_for(|dir| {
        let empty: image::ImageBuffer<image::Luma<u16>, Vec<u16>> =
            image::ImageBuffer::new(scene::SIZE.0, scene::SIZE.1);
        empty.save(dir.join("depth/000001.png")).expect("saves");
    });
    assert!(reason.contains("no depth"), "{reason}");
}

#[test]
fn a_scene_whose_own_files_are_broken_does_not_open() {
    let dir = tempfile::tempdir().expect("temporary folder");
    scene::write(dir.path(), 2).expect("scene");
    std::fs::write(dir.path().join("scene_camera.json"), "{ \"0\": ").expect("writes");
    let error = open(dir.path().to_str().expect("UTF-8")).err().expect("refused");
    assert!(error.to_string().contains("scene_camera.json"), "{error}");
}
