//! Folders for Open3D's reconstruction system [Zhou 2018]: `color/` (or `image/`, `rgb/`) and `depth/` with aligned pictures of
//! the same numbers, `camera_intrinsic.json` or `intrinsic.json`, and, once it has run, `scene/trajectory.log`. Also what its
//! viewer saves: `trajectory.json`, a `PinholeCameraTrajectory`.
//!
//! Depth is in millimetres unless the camera's file says otherwise (`depth_scale`, units a metre, as its recorders write it).

use crate::OpenOptions;
use crate::bop::metadata::read_object;
use crate::camera_model::DepthEncoding;
use crate::rgbd_folder::{FolderCamera, Frame, Recording, RgbdFolder, from_json, from_log, paired_pictures, read_text};
use nalgebra::Isometry3;
use semascan_inspection::source::SourceError;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const ENCODING: DepthEncoding =
    DepthEncoding { name: "open3d", metres_per_unit: 1e-3, invalid: &[0], range: None, description: "Open3D: 1 mm" };
/// Folders of colour pictures.
const COLOR: [&str; 3] = ["color", "image", "rgb"];
/// Files that describe the camera.
pub(crate) const CAMERA_FILES: [&str; 5] = [
    "camera_intrinsic.json",
    "intrinsic.json",
    "camera_intrinsics.json",
    "camera_primesense.json",
    "camera-intrinsics.txt",
];
/// Files with poses, the best first.
const TRAJECTORIES: [&str; 5] =
    ["scene/trajectory.log", "trajectory.log", "scene/trajectory.json", "trajectory.json", "camera_trajectory.json"];

/// Whether `folder` has colour and depth folders.
pub(crate) fn is_recording(folder: &Path) -> bool {
    color_folder(folder).is_some() && folder.join("depth").is_dir()
}

/// Whether a file in `folder` describes a camera.
pub(crate) fn has_camera(folder: &Path) -> bool {
    CAMERA_FILES.iter().any(|file| folder.join(file).is_file())
}

/// Opens the recording.
///
/// # Errors
/// [`SourceError`] naming the file at fault.
pub(crate) fn open(folder: &Path, options: &OpenOptions) -> Result<RgbdFolder, SourceError> {
    let trajectory = TRAJECTORIES.iter().map(|file| folder.join(file)).find(|path| path.is_file());
    let (frames, said) = frames(folder, trajectory.as_deref())?;
    let camera = FolderCamera::find(folder, &CAMERA_FILES, &frames, options, None)?;
    let mut encoding = ENCODING;
    if let Some(per_metre) = camera.depth_per_metre {
        encoding.metres_per_unit = 1.0 / per_metre;
        encoding.description = "as the camera's file says";
    }
    let recording = Recording {
        path: folder.to_owned(),
        kind: "an Open3D recording",
        frames,
        has_trajectory: trajectory.is_some(),
        camera,
        encoding,
        said,
    };
    RgbdFolder::new(recording, options)
}

/// The folder with the colour pictures; `None` if there is none.
pub(crate) fn color_folder(folder: &Path) -> Option<PathBuf> {
    COLOR.iter().map(|name| folder.join(name)).find(|path| path.is_dir())
}

/// What a reader says: a name and a sentence each.
type Said = Vec<(&'static str, String)>;

/// Frames of colour and depth folders, with the poses of the file `trajectory` if there is one.
///
/// # Errors
/// [`SourceError`] naming the file at fault.
pub(crate) fn frames(folder: &Path, trajectory: Option<&Path>) -> Result<(Vec<Frame>, Said), SourceError> {
    let Some(color) = color_folder(folder) else {
        let reason = format!("none of the folders {} is in it", COLOR.join(", "));
        return Err(SourceError::Format { path: folder.to_owned(), reason });
    };
    let (pairs, unpaired) = paired_pictures(&color, &folder.join("depth"))?;
    let mut said: Said = unpaired.into_iter().map(|text| ("pairs", text)).collect();
    let poses = match trajectory {
        Some(path) => {
            let (poses, assigned) = poses(path, pairs.len())?;
            said.extend(assigned.map(|text| ("trajectory", text)));
            poses
        }
        None => HashMap::new(),
    };
    let frames = pairs.into_iter().enumerate().map(|(place, (color, depth, stamp))| Frame {
        color,
        depth,
        stamp,
        table_from_camera: poses.get(&place).copied(),
    });
    Ok((frames.collect(), said))
}

/// `table_from_camera` by the frame's place.
type PosesByPlace = HashMap<usize, Isometry3<f64>>;

/// Poses by the frame's place. Where there are as many as frames they belong to these in order; where there are fewer, the
/// numbers that stand with them are the frames' places, which is said.
fn poses(path: &Path, frames: usize) -> Result<(PosesByPlace, Option<String>), SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let listed = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        from_json(&read_object(path)?).map_err(refuse)?
    } else {
        from_log(&read_text(path)?).map_err(refuse)?
    };
    let count = listed.len();
    if count == 0 {
        return Err(refuse("there is no pose in it".into()));
    }
    if count == frames {
        let by_order = listed.into_iter().enumerate().filter_map(|(place, (_, pose))| Some((place, pose?)));
        return Ok((by_order.collect(), None));
    }
    let mut by_number = HashMap::new();
    for (number, pose) in listed {
        let place = usize::try_from(number).ok().filter(|place| *place < frames);
        let place = place.ok_or_else(|| refuse(format!("{count} poses for {frames} frames, one of frame {number}")))?;
        if by_number.insert(place, pose).is_some() {
            return Err(refuse(format!("{count} poses for {frames} frames, two of frame {number}")));
        }
    }
    let said = format!("{count} poses for {frames} frames: their numbers are taken for the frames' places, from 0");
    Ok((by_number.into_iter().filter_map(|(place, pose)| Some((place, pose?))).collect(), Some(said)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rgbd_folder::fixtures::{
        FRAMES, SIZE, check, check_pictures, log, matrix, plain, pose, setting, views, write_camera, write_pictures,
    };
    use semascan_perception::view::PoseEvidence;
    use serde_json::json;
    use std::fs;

    #[test]
    fn folders_of_the_reconstruction_system_are_read_with_either_trajectory() {
        for color in COLOR {
            let folder = tempfile::tempdir().expect("a folder");
            write_pictures(folder.path(), color, SIZE);
            write_camera(folder.path());
            let (_, found) = views(folder.path(), plain()).expect("views");
            assert!(found.len() == 4 && found.iter().all(|view| view.pose == PoseEvidence::None));
            let extrinsic = |frame: u32| json!({ "extrinsic": pose(frame).inverse().to_homogeneous().as_slice() });
            let json = json!({ "parameters": (0..FRAMES).map(extrinsic).collect::<Vec<_>>() });
            fs::write(folder.path().join("trajectory.json"), json.to_string()).expect("written");
            let (_, found) = views(folder.path(), plain()).expect("views");
            (0..).zip(&found).for_each(|(frame, view)| check(view, frame));
            fs::create_dir(folder.path().join("scene")).expect("made");
            fs::write(folder.path().join("scene/trajectory.log"), log()).expect("written");
            fs::remove_file(folder.path().join("trajectory.json")).expect("removed");
            let (_, found) = views(folder.path(), plain()).expect("views");
            assert_eq!(found.len(), 4);
            (0..).zip(&found).for_each(|(frame, view)| check(view, frame));
        }
    }

    #[test]
    fn fewer_poses_belong_to_the_frames_they_name() {
        let folder = tempfile::tempdir().expect("a folder");
        write_pictures(folder.path(), "color", SIZE);
        write_camera(folder.path());
        let write = |text: String| fs::write(folder.path().join("trajectory.log"), text).expect("written");
        write(format!("1 1 2\n{}3 3 4\n{}", matrix(&pose(1)), matrix(&pose(3))));
        let (source, found) = views(folder.path(), plain()).expect("views");
        assert_eq!(found.len(), 2);
        check(&found[0], 1);
        check(&found[1], 3);
        assert!(setting(source.as_ref(), "trajectory").contains("2 poses for 4 frames"));
        write(format!("1 1 2\n{}7 7 8\n{}", matrix(&pose(1)), matrix(&pose(3))));
        let error = views(folder.path(), plain()).err().expect("no such frame").to_string();
        assert!(error.contains("trajectory.log") && error.contains("frame 7"), "{error}");
        write(format!("1 1 2\n{0}1 1 2\n{0}", matrix(&pose(1))));
        let error = views(folder.path(), plain()).err().expect("twice").to_string();
        assert!(error.contains("two of frame 1"), "{error}");
    }

    #[test]
    fn the_depth_scale_of_the_camera_file_counts_and_no_camera_is_said() {
        let folder = tempfile::tempdir().expect("a folder");
        write_pictures(folder.path(), "color", SIZE);
        let error = views(folder.path(), plain()).err().expect("no camera").to_string();
        assert!(error.contains("camera_intrinsic.json") && error.contains("--intrinsics"), "{error}");
        let camera = json!({ "width": 16, "height": 12, "depth_scale": 2000.0,
            "intrinsic_matrix": [15.0, 0, 0, 0, 15.5, 0, 7.25, 5.75, 1] });
        fs::write(folder.path().join("intrinsic.json"), camera.to_string()).expect("written");
        let (_, found) = views(folder.path(), plain()).expect("views");
        assert!((found[0].depth.at(5, 5).expect("depth") - 0.25).abs() < 1e-6);
        fs::remove_file(folder.path().join("intrinsic.json")).expect("removed");
        let options = OpenOptions { intrinsics: Some([15.0, 15.5, 7.25, 5.75]), ..plain() };
        let (_, found) = views(folder.path(), options).expect("views");
        check_pictures(&found[2], 2);
    }

    #[test]
    fn the_depth_camera_that_is_named_gives_unit_and_range_where_no_file_says_the_unit() {
        let folder = tempfile::tempdir().expect("a folder");
        write_pictures(folder.path(), "color", SIZE);
        write_camera(folder.path());
        let open = |query: &str| crate::open(&format!("{}?{query}", folder.path().display()), plain());
        let first = |query: &str| open(query).expect("a recording").next_view().expect("a view");
        let depth = |query: &str| first(query).expect("depth").depth.at(5, 5).expect("measured");
        assert!((depth("device=d435") - 0.5).abs() < 1e-6 && (depth("device=d405") - 0.05).abs() < 1e-6);
        let near = first("device=l515").expect_err("0.125 m").to_string();
        assert!(near.contains("beyond what the depth camera measures"), "{near}");
        let source = open("device=d435").expect("a recording");
        assert!(
            setting(source.as_ref(), "depth_camera").contains("0.1 to 16 m") && source.info().uri.contains("?device")
        );
        let other = open("device=d435&shift_mm=1").err().expect("no such option").to_string();
        assert!(other.contains("device= alone"), "{other}");
    }
}
