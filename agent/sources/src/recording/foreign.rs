//! Recordings by software that nobody here wrote: `fixtures/recordings_of_others.py`, in the Python that
//! `SEMASCAN_FOREIGN_PYTHON` names, makes them (ROS 2, ROS 1 and Foxglove in MCAP files, bags of ROS 1 and ROS 2, RealSense's
//! recorder). What they show is known, and every view of every file is held against it.

use super::*;
use crate::foreign_python;
use nalgebra::{Isometry3, Vector3};
use semascan_perception::view::PoseEvidence;

/// Time of the first colour picture, seconds.
const START: f64 = 1_700_000_000.0;

/// The recordings, or why they are not here.
fn recordings() -> Result<tempfile::TempDir, String> {
    let folder = tempfile::tempdir().expect("a folder");
    foreign_python::run("recordings_of_others.py", folder.path())?;
    Ok(folder)
}

fn views(source: &mut dyn Source) -> Vec<View> {
    std::iter::from_fn(|| source.next_view()).map(|view| view.expect("a view")).collect()
}

fn setting<'a>(source: &'a dyn Source, name: &str) -> &'a str {
    let found = source.info().settings.iter().find(|(key, _)| key == name);
    found.map_or("", |(_, value)| value.as_str())
}

/// Holds a view against what the script says that it shows.
fn assert_shows(view: &View, number: usize, name: &str) {
    let k = view.intrinsics;
    let lens = [k.fx - 60.0, k.fy - 60.0, k.cx - 31.5, k.cy - 23.5];
    assert!(lens.iter().all(|off| off.abs() < 1e-3) && (k.width, k.height) == (64, 48), "{name}: {k:?}");
    for (u, v) in [(0, 0), (63, 0), (5, 47), (40, 20)] {
        let millimetres = 500 + 2 * u + v + 10 * number as u32;
        let depth = view.depth.at(u, v).expect("measured");
        assert!((f64::from(depth) - 1e-3 * f64::from(millimetres)).abs() < 1e-6, "{name} {number}: {depth}");
        assert_eq!(view.rgb.get_pixel(u, v).0, [200, 3 * u as u8, 5 * number as u8], "{name} {number}");
    }
    view.check_sizes().expect("sizes fit");
}

/// Holds the pose of a view against the base's motion at the time of its depth.
fn assert_moved(view: &View, number: usize, name: &str) {
    let stamp = view.stamp.expect("a time") - START;
    assert!((stamp - (0.1 * number as f64 + 0.005)).abs() < 1e-6, "{name}: {stamp}");
    let map_from_base = Isometry3::new(Vector3::new(0.1 * stamp, 0.0, 0.0), Vector3::z() * 0.2 * stamp);
    let base_from_camera = Isometry3::new(Vector3::new(0.0, 0.0, 0.5), Vector3::x() * std::f64::consts::FRAC_PI_2);
    let found = view.pose.table_from_camera().unwrap_or_else(|| panic!("{name}: view {number} has no pose"));
    let off = found.inverse() * map_from_base * base_from_camera;
    let (shift, turn) = (off.translation.vector.norm(), off.rotation.angle());
    assert!(shift < 1e-6 && turn < 1e-6, "{name} {number}: {shift} m, {turn} rad off");
}

#[test]
fn recordings_of_others_give_the_views_that_they_show() {
    let folder = match recordings() {
        Ok(folder) => folder,
        Err(why) => {
            eprintln!("SKIPPED: {why}: no recordings of others are read");
            return;
        }
    };
    let open = |name: &str| {
        let uri = folder.path().join(name).display().to_string();
        crate::open(&uri, OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"))
    };
    let names = [
        "ros2_none.mcap",
        "ros2_lz4.mcap",
        "ros2_zstd.mcap",
        "ros2_float.mcap",
        "ros2_compressed.mcap",
        "ros2_cloud.mcap",
        "bag_database",
        "bag_database/bag_database.db3",
        "bag_database_zstd",
        "bag_mcap",
        "bag_big_endian",
        "ros1.bag",
        "ros1_bz2.bag",
        "ros1_lz4.bag",
        "ros1.mcap",
        "foxglove.mcap",
        "foxglove_json.mcap",
    ];
    for name in names {
        let mut source = open(name);
        let found = views(source.as_mut());
        assert_eq!((found.len(), source.info().view_count), (6, Some(6)), "{name}: {:?}", source.info().settings);
        for (number, view) in found.iter().enumerate() {
            assert_shows(view, number, name);
            assert_moved(view, number, name);
        }
        assert_eq!(setting(source.as_ref(), "recording"), "", "{name}: no fault");
        assert!(setting(source.as_ref(), "poses").contains("\"map\""), "{name}");
        assert!(source.rewind() && views(source.as_mut()).len() == 6, "{name}: again");
    }
    assert!(setting(open("ros1.bag").as_ref(), "pairs").ends_with("alone stay 1 colour and 0 depth pictures"));
    // Fewer views, in another frame.
    let query = "ros2_none.mcap?fixed_frame=base&color=/camera/color/image_raw";
    let mut source = open(query);
    let found = views(source.as_mut());
    assert_eq!(found.len(), 6);
    let pose = found[2].pose.table_from_camera().expect("a pose");
    assert!((pose.translation.vector - Vector3::new(0.0, 0.0, 0.5)).norm() < 1e-9);
    assert!(source.info().uri.ends_with(query));
    assert_eq!(views(open("ros1.bag?shift_mm=25").as_mut()).len(), 2, "0, 30 mm");
    assert_eq!(views(open("ros1.bag?color=/camera/infra1/image_rect_raw").as_mut()).len(), 6);
}

#[test]
fn recordings_of_realsense_are_read_without_its_software() {
    let folder = match recordings() {
        Ok(folder) => folder,
        Err(why) => {
            eprintln!("SKIPPED: {why}: no recordings of RealSense's recorder are read");
            return;
        }
    };
    let path = |name: &str| folder.path().join(name);
    if !path("realsense.db3").exists() {
        eprintln!("SKIPPED: the foreign Python has no pyrealsense2: no recordings of its recorder are read");
        return;
    }
    let mut source = RecordingSource::open(&path("realsense.db3"), OpenOptions::default()).expect("a recording");
    let found = views(&mut source);
    assert!(found.len() >= 3, "{:?}", source.info().settings);
    for view in &found {
        // A frame may have been dropped while it was recorded: the colours say which one it is.
        assert_shows(view, usize::from(view.rgb.get_pixel(0, 0).0[2]) / 5, "realsense.db3");
        assert_eq!(view.pose, PoseEvidence::None, "a camera alone does not know where it is");
    }
    assert!(setting(&source, "depth_unit").contains("0.5 mm"), "{:?}", source.info().settings);
    assert!(setting(&source, "poses").contains("fixed"), "{:?}", source.info().settings);
    let mut apart = RecordingSource::open(&path("realsense_apart.db3"), OpenOptions::default()).expect("a recording");
    // The depth of a camera 15 mm beside lies in the colour camera: a part of it is seen by that one alone.
    let view = match apart.next_view().expect("a pair") {
        Ok(view) => view,
        Err(error) => panic!("{error}"),
    };
    assert_eq!((view.intrinsics.fx, view.intrinsics.cx), (60.0, 31.5));
    let unmeasured = view.depth.metres.iter().filter(|z| **z == 0.0).count();
    assert!(unmeasured > 48 && unmeasured < view.depth.metres.len() / 10, "{unmeasured} pixels without depth");
}
