//! Small recordings in the layouts that there are, for tests: a wall that a camera comes nearer to, 1 cm a frame.

use crate::OpenOptions;
use image::{ImageBuffer, Luma, Rgb, RgbImage};
use nalgebra::{Isometry3, Vector3};
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::CameraMask;
use semascan_perception::view::View;
use serde_json::json;
use std::fs;
use std::path::Path;

pub(crate) const SIZE: (u32, u32) = (16, 12);
pub(crate) const NUMBERS: [f64; 4] = [15.0, 15.5, 7.25, 5.75];
/// Frames of a recording.
pub(crate) const FRAMES: u32 = 4;

/// Distance of the wall in metres.
pub(crate) fn distance(frame: u32) -> f64 {
    0.5 - 0.01 * f64::from(frame)
}

/// `table_from_camera`.
pub(crate) fn pose(frame: u32) -> Isometry3<f64> {
    let angle = 0.1 * f64::from(frame);
    Isometry3::new(Vector3::new(0.2, -0.1, 0.01 * f64::from(frame)), Vector3::new(0.02, angle, -0.3))
}

/// Rows of `table_from_camera`.
pub(crate) fn matrix(pose: &Isometry3<f64>) -> String {
    let matrix = pose.to_homogeneous();
    let row = |row: usize| (0..4).map(|column| matrix[(row, column)].to_string()).collect::<Vec<_>>().join(" ") + "\n";
    (0..4).map(row).collect()
}

/// A colour picture whose red is the frame's number.
pub(crate) fn write_color(path: &Path, size: (u32, u32), frame: u32) {
    make_folder(path);
    RgbImage::from_pixel(size.0, size.1, Rgb([frame as u8, 200, 100])).save(path).expect("written");
}

/// A depth picture of the wall, with a unit of `per_metre`; the first pixel is 0, the second the largest number.
pub(crate) fn write_depth(path: &Path, size: (u32, u32), frame: u32, per_metre: f64) {
    make_folder(path);
    let number = |u: u32, v: u32| match (u, v) {
        (0, 0) => 0,
        (1, 0) => u16::MAX,
        _ => (distance(frame) * per_metre).round() as u16,
    };
    ImageBuffer::<Luma<u16>, Vec<u16>>::from_fn(size.0, size.1, |u, v| Luma([number(u, v)]))
        .save(path)
        .expect("written");
}

fn make_folder(path: &Path) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("made");
}

/// The camera's file in Open3D's form.
pub(crate) fn write_camera(folder: &Path) {
    let [fx, fy, cx, cy] = NUMBERS;
    let camera = json!({ "width": SIZE.0, "height": SIZE.1, "intrinsic_matrix": [fx, 0, 0, 0, fy, 0, cx, cy, 1] });
    fs::write(folder.join("camera_intrinsic.json"), camera.to_string()).expect("written");
}

/// TUM: colour at 30 Hz, depth 8 ms later, poses at 100 Hz.
pub(crate) fn write_tum(folder: &Path, size: (u32, u32)) {
    let (mut colors, mut depths, mut poses) = (String::from("# colour\n"), String::new(), String::from("# poses\n"));
    for frame in 0..FRAMES {
        let stamp = 1_305_031_102.175_3 + f64::from(frame) / 30.0;
        let (color, depth) = (format!("rgb/{stamp:.6}.png"), format!("depth/{:.6}.png", stamp + 0.008));
        write_color(&folder.join(&color), size, frame);
        write_depth(&folder.join(&depth), size, frame, 5000.0);
        colors += &format!("{stamp:.6} {color}\n");
        depths += &format!("{:.6} {depth}\n", stamp + 0.008);
        let pose = pose(frame);
        let (t, q) = (pose.translation, pose.rotation.coords);
        poses += &format!("{:.4} {} {} {} {} {} {} {}\n", stamp + 0.008, t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    fs::write(folder.join("rgb.txt"), colors).expect("written");
    fs::write(folder.join("depth.txt"), depths).expect("written");
    fs::write(folder.join("groundtruth.txt"), poses).expect("written");
}

/// 7-Scenes.
pub(crate) fn write_seven_scenes(folder: &Path, size: (u32, u32)) {
    for frame in 0..FRAMES {
        let name = |kind: &str| folder.join(format!("frame-{frame:06}.{kind}"));
        write_color(&name("color.png"), size, frame);
        write_depth(&name("depth.png"), size, frame, 1000.0);
        fs::write(name("pose.txt"), matrix(&pose(frame)).replace(' ', "\t ")).expect("written");
    }
}

/// Colour and depth folders, as Open3D and Redwood have them.
pub(crate) fn write_pictures(folder: &Path, color: &str, size: (u32, u32)) {
    for frame in 0..FRAMES {
        write_color(&folder.join(format!("{color}/{frame:05}.jpg")), size, frame);
        write_depth(&folder.join(format!("depth/{frame:05}.png")), size, frame, 1000.0);
    }
}

/// A `.log` trajectory.
pub(crate) fn log() -> String {
    (0..FRAMES).map(|frame| format!("{frame} {frame} {}\n{}", frame + 1, matrix(&pose(frame)))).collect()
}

/// Options that look for no robot.
pub(crate) fn plain() -> OpenOptions {
    OpenOptions { camera_mask: CameraMask::None, ..OpenOptions::default() }
}

/// The source at `folder` and its views.
pub(crate) fn views(folder: &Path, options: OpenOptions) -> Result<(Box<dyn Source>, Vec<View>), SourceError> {
    let mut source = crate::open(folder.to_str().expect("UTF-8"), options)?;
    let mut views = Vec::new();
    while let Some(view) = source.next_view() {
        let view = view?;
        view.check_sizes().expect("one size");
        views.push(view);
    }
    Ok((source, views))
}

/// A setting of a source.
pub(crate) fn setting(source: &dyn Source, name: &str) -> String {
    source.info().settings.iter().find(|(key, _)| key == name).map(|(_, value)| value.clone()).unwrap_or_default()
}

/// Checks that `view` is the wall of `frame` with its pose.
pub(crate) fn check(view: &View, frame: u32) {
    let found = view.pose.table_from_camera().expect("a pose");
    let off = found.inverse() * pose(frame);
    assert!(off.translation.vector.norm() < 1e-6 && off.rotation.angle() < 1e-6, "frame {frame}: {found}");
    check_pictures(view, frame);
}

/// Checks that `view` is the wall of `frame`.
pub(crate) fn check_pictures(view: &View, frame: u32) {
    let red = i32::from(view.rgb.get_pixel(3, 3).0[0]);
    assert!((red - frame as i32).abs() <= 3, "frame {frame}: red {red}");
    assert_eq!([view.depth.at(0, 0), view.depth.at(1, 0)], [None, None], "unmeasured");
    let depth = view.depth.at(5, 5).expect("depth");
    assert!((f64::from(depth) - distance(frame)).abs() < 1e-6, "frame {frame}: {depth} m");
}
