//! Sequences of the 7-Scenes data set [Shotton 2013]: `frame-000000.color.png`, `.depth.png` and `.pose.txt` (a matrix,
//! `table_from_camera`, metres) beside each other. The data set of [Zeng 2017] has the same names with
//! `camera-intrinsics.txt` a folder above.
//!
//! Depth is in millimetres, 65535 where nothing was measured. The data set does not register it to colour: both cameras are a few
//! centimetres apart, and nobody calibrated them. Its authors use one camera (585, 320, 240) for both, and so colours are off by
//! some pixels; that is said. Geometry is that of the depth camera, to which the poses belong.

use crate::OpenOptions;
use crate::camera_model::{DepthEncoding, Distortion};
use crate::rgbd_folder::{
    FolderCamera, Frame, Recording, RgbdFolder, Rows, numbers, pinhole, pose_of_matrix, read_text,
};
use nalgebra::{Isometry3, Matrix4, RowVector4};
use semascan_inspection::source::SourceError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const ENCODING: DepthEncoding = DepthEncoding {
    name: "7-scenes",
    metres_per_unit: 1e-3,
    invalid: &[0, 65535],
    range: None,
    description: "7-Scenes: 1 mm, 65535 is unmeasured",
};
/// The depth camera, as the data set's page has it.
const CAMERA: [f64; 4] = [585.0, 585.0, 320.0, 240.0];
const SIZE: (u32, u32) = (640, 480);
/// Files that say otherwise.
const CAMERA_FILES: [&str; 3] = ["camera_intrinsic.json", "camera-intrinsics.txt", "../camera-intrinsics.txt"];

/// Files of a frame.
#[derive(Clone, Debug, Default)]
struct Files {
    color: Option<PathBuf>,
    depth: Option<PathBuf>,
    pose: Option<PathBuf>,
}

/// Whether `folder` is such a sequence: its first frame, or any, has the name.
pub(crate) fn is_recording(folder: &Path) -> bool {
    folder.join("frame-000000.depth.png").is_file() || frames(folder).is_ok_and(|frames| !frames.is_empty())
}

/// Opens the sequence.
///
/// # Errors
/// [`SourceError`] naming the file at fault.
pub(crate) fn open(folder: &Path, options: &OpenOptions) -> Result<RgbdFolder, SourceError> {
    let files = frames(folder)?;
    let has_trajectory = files.values().any(|files| files.pose.is_some());
    let whole = |files: &Files| Some((files.color.clone()?, files.depth.clone()?, files.pose.clone()));
    let listed = files.len();
    let mut frames = Vec::new();
    for (color, depth, pose) in files.values().filter_map(whole) {
        let table_from_camera = pose.map(|path| read_pose(&path)).transpose()?.flatten();
        frames.push(Frame { color, depth, stamp: None, table_from_camera });
    }
    let mut said = Vec::new();
    if frames.len() < listed {
        let text = format!("{} of {listed} frames have colour and depth; the rest is left out", frames.len());
        said.push(("pairs", text));
    }
    let known = (pinhole(SIZE, CAMERA), Distortion::None, "of the 7-Scenes depth camera");
    let camera = FolderCamera::find(folder, &CAMERA_FILES, &frames, options, Some(known))?;
    if camera.origin() == known.2 {
        let text = "7-Scenes does not register depth to colour: colours are some pixels off the surface";
        said.push(("alignment", text.to_owned()));
    }
    let recording = Recording {
        path: folder.to_owned(),
        kind: "a 7-Scenes sequence",
        frames,
        has_trajectory,
        camera,
        encoding: ENCODING,
        said,
    };
    RgbdFolder::new(recording, options)
}

/// The frames of a folder by their numbers.
fn frames(folder: &Path) -> Result<BTreeMap<u64, Files>, SourceError> {
    let io = |source| SourceError::Io { path: folder.to_owned(), source };
    let mut frames: BTreeMap<u64, Files> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let Some((number, kind)) = path.file_name().and_then(|name| name.to_str()).and_then(frame_name) else {
            continue;
        };
        let files = frames.entry(number).or_default();
        match kind {
            "color" => files.color = Some(path),
            "depth" => files.depth = Some(path),
            _ => files.pose = Some(path),
        }
    }
    Ok(frames)
}

/// Number and kind in `frame-000012.color.png`; `None` of another name.
fn frame_name(name: &str) -> Option<(u64, &str)> {
    let (number, rest) = name.strip_prefix("frame-")?.split_once('.')?;
    let (kind, ending) = rest.split_once('.')?;
    let is_known = match kind {
        "color" => matches!(ending, "png" | "jpg" | "jpeg"),
        "depth" => matches!(ending, "png" | "tif" | "tiff"),
        "pose" => ending == "txt",
        _ => false,
    };
    let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
    (is_known && is_number).then(|| number.parse().ok()).flatten().map(|number| (number, kind))
}

/// The pose of a frame; `None` where the tracking lost it.
fn read_pose(path: &Path) -> Result<Option<Isometry3<f64>>, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let text = read_text(path)?;
    let mut matrix = Matrix4::zeros();
    let mut rows = Rows::of(&text);
    for row in 0..4 {
        let (line, text) = rows.next().ok_or_else(|| refuse(format!("{row} rows in place of 4")))?;
        let values = numbers::<4>(text).map_err(|reason| refuse(format!("line {line}: {reason}")))?;
        matrix.set_row(row, &RowVector4::from(values));
    }
    pose_of_matrix(&matrix).map_err(refuse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OpenOptions;
    use crate::rgbd_folder::fixtures::{SIZE as SMALL, check, plain, setting, views, write_seven_scenes};
    use std::fs;

    #[test]
    fn a_sequence_is_read_with_the_camera_of_the_data_set() {
        let folder = tempfile::tempdir().expect("a folder");
        write_seven_scenes(folder.path(), SIZE);
        let (source, found) = views(folder.path(), plain()).expect("views");
        assert_eq!((found.len(), found[0].intrinsics.fx, found[0].intrinsics.cx), (4, 585.0, 320.0));
        for (frame, view) in (0..).zip(&found) {
            check(view, frame);
        }
        assert!(setting(source.as_ref(), "alignment").contains("does not register depth to colour"));
        let scene = folder.path().parent().expect("a folder");
        assert!(scene.is_dir() && !is_recording(scene));
    }

    #[test]
    fn a_camera_of_its_own_is_taken_from_the_folder_above() {
        let above = tempfile::tempdir().expect("a folder");
        let folder = above.path().join("seq-01");
        fs::create_dir(&folder).expect("made");
        write_seven_scenes(&folder, SMALL);
        fs::write(above.path().join("camera-intrinsics.txt"), "15.0 0 7.25\n0 15.5 5.75\n0 0 1\n").expect("written");
        let (source, found) = views(&folder, plain()).expect("views");
        assert_eq!((found[0].intrinsics.fx, found[0].intrinsics.cy), (15.0, 5.75));
        assert_eq!(setting(source.as_ref(), "alignment"), "");
        fs::remove_file(above.path().join("camera-intrinsics.txt")).expect("removed");
        let error = views(&folder, plain()).err().expect("another size").to_string();
        assert!(error.contains("frame-000000.color.png") && error.contains("640 x 480"), "{error}");
    }

    #[test]
    fn a_pose_that_is_none_is_named_and_a_frame_without_depth_left_out() {
        let folder = tempfile::tempdir().expect("a folder");
        write_seven_scenes(folder.path(), SIZE);
        fs::remove_file(folder.path().join("frame-000001.depth.png")).expect("removed");
        let (source, found) = views(folder.path(), OpenOptions { every: 2, ..plain() }).expect("views");
        assert_eq!(found.len(), 2);
        assert!(setting(source.as_ref(), "pairs").starts_with("3 of 4"));
        for (text, named) in [("1 0 0 0\n0 1 0 0\n", "2 rows"), ("a", "line 1"), (&"2 0 0 0\n".repeat(4), "rotation")] {
            fs::write(folder.path().join("frame-000002.pose.txt"), text).expect("written");
            let error = views(folder.path(), plain()).err().expect("refused").to_string();
            assert!(error.contains("frame-000002.pose.txt") && error.contains(named), "{error}");
        }
    }

    #[test]
    fn names_of_other_files_are_no_frames() {
        assert_eq!(frame_name("frame-000012.color.png"), Some((12, "color")));
        for name in ["frame-000012.png", "frame-.pose.txt", "frame-1x.pose.txt", "frame-1.pose.png", "frame-1.mask.png"]
        {
            assert_eq!(frame_name(name), None, "{name}");
        }
    }
}
