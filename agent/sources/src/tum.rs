//! Recordings in the layout of the TUM RGB-D benchmark [Sturm 2012]: `rgb.txt` and `depth.txt` list stamps and files,
//! `groundtruth.txt` has the camera's pose by stamp.
//!
//! Colour and depth have clocks of their own and are associated by their stamps; the pose is that at the depth picture's
//! stamp, for depth makes the surface. Depth is aligned to colour and has 5000 units a metre. The benchmark's three cameras are
//! known by the name of the folder (`freiburg1` to `3`), with their lenses.

use crate::OpenOptions;
use crate::camera_model::{DepthEncoding, Distortion};
use crate::rgbd_folder::{
    FolderCamera, Frame, Recording, RgbdFolder, Rows, TOLERANCE, Trajectory, numbers, pairs, pinhole, read_text,
};
use semascan_inspection::source::SourceError;
use semascan_perception::view::Intrinsics;
use std::path::{Component, Path, PathBuf};

const ENCODING: DepthEncoding = DepthEncoding {
    name: "tum",
    metres_per_unit: 1.0 / 5000.0,
    invalid: &[0],
    range: None,
    description: "TUM RGB-D: 5000 a metre",
};

/// A camera of the benchmark: name, intrinsics, radial and tangential coefficients.
type KnownCamera = (&'static str, [f64; 4], [f64; 3], [f64; 2]);

/// The cameras of the benchmark.
const CAMERAS: [KnownCamera; 3] = [
    ("freiburg1", [517.3, 516.5, 318.6, 255.3], [0.2624, -0.9531, 1.1633], [-0.0054, 0.0026]),
    ("freiburg2", [520.9, 521.0, 325.1, 249.7], [0.2312, -0.7849, 0.9172], [-0.0033, -0.0001]),
    // Its pictures are undistorted already.
    ("freiburg3", [535.4, 539.2, 320.1, 247.6], [0.0; 3], [0.0; 2]),
];
/// Pixels of all three.
const SIZE: (u32, u32) = (640, 480);

/// Whether `folder` has such lists.
pub(crate) fn is_recording(folder: &Path) -> bool {
    folder.join("rgb.txt").is_file() && folder.join("depth.txt").is_file()
}

/// Opens the recording.
///
/// # Errors
/// [`SourceError`] naming the file at fault.
pub(crate) fn open(folder: &Path, options: &OpenOptions) -> Result<RgbdFolder, SourceError> {
    let colors = listed(folder, "rgb.txt")?;
    let depths = listed(folder, "depth.txt")?;
    let stamps = |files: &[(f64, PathBuf)]| files.iter().map(|(stamp, _)| *stamp).collect::<Vec<f64>>();
    let (color_stamps, depth_stamps) = (stamps(&colors), stamps(&depths));
    let found = pairs(&color_stamps, &depth_stamps, TOLERANCE);
    let path = folder.join("groundtruth.txt");
    let trajectory = if path.is_file() {
        let refuse = |reason: String| SourceError::Format { path: path.clone(), reason };
        Some(Trajectory::from_stamped(&read_text(&path)?).map_err(refuse)?)
    } else {
        None
    };
    let frame = |(color, depth): &(usize, usize)| {
        let ((stamp, color), (measured, depth)) = (colors.get(*color)?, depths.get(*depth)?);
        let pose = trajectory.as_ref().and_then(|trajectory| trajectory.at(*measured));
        Some(Frame { color: color.clone(), depth: depth.clone(), stamp: Some(*stamp), table_from_camera: pose })
    };
    let frames: Vec<Frame> = found.iter().filter_map(frame).collect();
    let mut said = Vec::new();
    if found.len() < colors.len().max(depths.len()) {
        let text = format!(
            "{} of {} colour and {} depth pictures are within {:.0} ms of each other; the rest is left out",
            found.len(),
            colors.len(),
            depths.len(),
            1e3 * TOLERANCE
        );
        said.push(("pairs", text));
    }
    let offsets = found.iter().filter_map(|(color, depth)| Some(depth_stamps.get(*depth)? - color_stamps.get(*color)?));
    if let Some((median, most)) = median_and_most(offsets.collect()) {
        let text =
            format!("depth is {:.1} ms after colour at the median, {:.1} ms apart at most", 1e3 * median, 1e3 * most);
        said.push(("stamps", text));
    }
    let camera = FolderCamera::find(folder, &["camera_intrinsic.json"], &frames, options, known_camera(folder))?;
    let recording = Recording {
        path: folder.to_owned(),
        kind: "a TUM RGB-D recording",
        frames,
        has_trajectory: trajectory.is_some(),
        camera,
        encoding: ENCODING,
        said,
    };
    RgbdFolder::new(recording, options)
}

/// The camera that the folder's name, or that of the folder around it, says.
fn known_camera(folder: &Path) -> Option<(Intrinsics, Distortion, &'static str)> {
    let folder = folder.canonicalize().ok()?;
    let names = folder.iter().rev().take(2).map(|name| name.to_string_lossy().to_ascii_lowercase());
    let names: Vec<String> = names.collect();
    let is_named = |name: &str| names.iter().any(|folder| folder.contains(name));
    let (name, numbers, radial, tangential) = CAMERAS.iter().find(|(name, ..)| is_named(name))?;
    let distortion = if *radial == [0.0; 3] {
        Distortion::None
    } else {
        Distortion::BrownConrady { radial: *radial, tangential: *tangential }
    };
    Some((pinhole(SIZE, *numbers), distortion, name))
}

/// Stamps and files of a list, by stamp.
fn listed(folder: &Path, name: &str) -> Result<Vec<(f64, PathBuf)>, SourceError> {
    let path = folder.join(name);
    let text = read_text(&path)?;
    let mut files = Vec::new();
    for (line, row) in Rows::of(&text) {
        let bad = |reason: String| SourceError::Format { path: path.clone(), reason: format!("line {line}: {reason}") };
        let (stamp, file) = row.split_once(char::is_whitespace).ok_or_else(|| bad("not a stamp and a file".into()))?;
        let [stamp] = numbers::<1>(stamp).map_err(bad)?;
        if !stamp.is_finite() {
            return Err(bad("the stamp is not finite".into()));
        }
        let file = Path::new(file.trim());
        if !file.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
            return Err(bad(format!("{} does not lie in the folder", file.display())));
        }
        files.push((stamp, folder.join(file)));
    }
    files.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(files)
}

/// The median, and the largest by its amount.
fn median_and_most(mut values: Vec<f64>) -> Option<(f64, f64)> {
    values.sort_by(f64::total_cmp);
    let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    Some((*values.get(values.len() / 2)?, most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OpenOptions;
    use crate::rgbd_folder::fixtures::{NUMBERS, SIZE as SMALL, check, plain, pose, setting, views, write_tum};
    use std::fs;

    fn said() -> OpenOptions {
        OpenOptions { intrinsics: Some(NUMBERS), ..plain() }
    }

    #[test]
    fn frames_are_associated_by_their_stamps_and_posed_at_that_of_depth() {
        let folder = tempfile::tempdir().expect("a folder");
        write_tum(folder.path(), SMALL);
        let (source, found) = views(folder.path(), said()).expect("views");
        assert_eq!(found.len(), 4);
        for (frame, view) in (0..).zip(&found) {
            check(view, frame);
        }
        assert!((found[1].stamp.expect("a stamp") - 1_305_031_102.208_633).abs() < 1e-5);
        assert!(
            setting(source.as_ref(), "stamps").contains("depth is 8.0 ms after colour"),
            "{:?}",
            source.info().settings
        );
    }

    #[test]
    fn a_pose_between_two_readings_is_between_them_and_a_gap_leaves_its_frame_out() {
        let folder = tempfile::tempdir().expect("a folder");
        write_tum(folder.path(), SMALL);
        // Readings 5 ms before and after the depth of frame 0, none near frame 2, one that is not a number at frame 3.
        let row = |after: f64, pose: &nalgebra::Isometry3<f64>| {
            let (t, q) = (pose.translation, pose.rotation.coords);
            format!("{:.6} {} {} {} {} {} {} {}\n", 1_305_031_102.183_3 + after, t.x, t.y, t.z, q.x, q.y, q.z, q.w)
        };
        let step = nalgebra::Isometry3::translation(0.01, 0.0, 0.0);
        let text = row(-0.005, &(pose(0) * step.inverse()))
            + &row(0.005, &(pose(0) * step))
            + &row(1.0 / 30.0, &pose(1))
            + "1305031102.283300 nan nan nan nan nan nan nan\n";
        fs::write(folder.path().join("groundtruth.txt"), text).expect("written");
        let (source, found) = views(folder.path(), said()).expect("views");
        assert_eq!(found.len(), 2);
        check(&found[0], 0);
        check(&found[1], 1);
        assert!(setting(source.as_ref(), "poses").contains("2 of 4 frames"), "{:?}", source.info().settings);
    }

    #[test]
    fn the_cameras_of_the_benchmark_are_known_by_name_with_their_lenses() {
        let folder = tempfile::tempdir().expect("a folder");
        let named = folder.path().join("rgbd_dataset_freiburg1_desk");
        fs::create_dir(&named).expect("made");
        write_tum(&named, SIZE);
        let options = OpenOptions { every: 3, ..plain() };
        let (source, found) = views(&named, options.clone()).expect("views");
        assert_eq!((found.len(), found[0].intrinsics.fx, found[0].intrinsics.cy), (2, 517.3, 255.3));
        let text = setting(source.as_ref(), "intrinsics");
        assert!(text.contains("freiburg1") && text.contains("undistorted"), "{text}");
        let third = folder.path().join("rgbd_dataset_freiburg3_x");
        fs::rename(&named, &third).expect("renamed");
        let (_, found) = views(&third, options.clone()).expect("views");
        assert_eq!(found[0].intrinsics.fy, 539.2);
        let unnamed = folder.path().join("desk");
        fs::rename(&third, &unnamed).expect("renamed");
        let error = views(&unnamed, options).err().expect("no camera").to_string();
        assert!(error.contains("--intrinsics") && error.contains("desk"), "{error}");
    }

    #[test]
    fn lists_that_lead_elsewhere_or_hold_no_stamps_are_refused_by_their_line() {
        let folder = tempfile::tempdir().expect("a folder");
        write_tum(folder.path(), SMALL);
        for (text, named) in [
            ("1.0 ../../etc/passwd\n", "line 1"),
            ("# head\n1.0 /etc/passwd\n", "line 2"),
            ("one rgb/1.png\n", "`one`"),
            ("1.0\n", "not a stamp and a file"),
            ("inf rgb/1.png\n", "not finite"),
            ("", "no colour picture"),
        ] {
            fs::write(folder.path().join("rgb.txt"), text).expect("written");
            let error = views(folder.path(), said()).err().expect("refused").to_string();
            assert!(error.contains(named) && error.contains(folder.path().to_str().expect("UTF-8")), "{text}: {error}");
        }
    }
}
