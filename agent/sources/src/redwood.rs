//! Folders of the Redwood data sets: `rgb/` (or `color/`, `image/`) and `depth/`, a trajectory in a `.log` file or one that is
//! called `*traj*.txt` [Choi 2015], and no file for the camera, which was a PrimeSense with its factory's intrinsics (525, 319.5,
//! 239.5). The object scans [Choi 2016] have no trajectory; a picture's name has its stamp in microseconds.

use crate::OpenOptions;
use crate::camera_model::{DepthEncoding, Distortion};
use crate::open3d::{self, CAMERA_FILES};
use crate::rgbd_folder::{FolderCamera, Recording, RgbdFolder, pictures, pinhole};
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use std::io::Read;
use std::path::{Path, PathBuf};

const ENCODING: DepthEncoding =
    DepthEncoding { name: "redwood", metres_per_unit: 1e-3, invalid: &[0], range: None, description: "Redwood: 1 mm" };
const CAMERA: [f64; 4] = [525.0, 525.0, 319.5, 239.5];
const SIZE: (u32, u32) = (640, 480);

/// Whether `folder` is one: colour and depth, no camera, and a trajectory or stamps in the names.
pub(crate) fn is_recording(folder: &Path) -> bool {
    if !open3d::is_recording(folder) || open3d::has_camera(folder) {
        return false;
    }
    trajectory(folder).is_some() || has_stamps(folder)
}

/// Opens the recording.
///
/// # Errors
/// [`SourceError`] naming the file at fault.
pub(crate) fn open(folder: &Path, options: &OpenOptions) -> Result<RgbdFolder, SourceError> {
    let trajectory = trajectory(folder);
    let (frames, said) = open3d::frames(folder, trajectory.as_deref())?;
    let known =
        (pinhole(SIZE, CAMERA), Distortion::None, "assumed: a PrimeSense as it comes, as in the Redwood data sets");
    let camera = FolderCamera::find(folder, &CAMERA_FILES, &frames, options, Some(known))?;
    let recording = Recording {
        path: folder.to_owned(),
        kind: "a Redwood recording",
        frames,
        has_trajectory: trajectory.is_some(),
        camera,
        encoding: ENCODING,
        said,
    };
    RgbdFolder::new(recording, options)
}

/// The file with the trajectory: in the folder or in `scene/`, the first by its name.
fn trajectory(folder: &Path) -> Option<PathBuf> {
    let is_log = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        (name.ends_with(".log") || (name.contains("traj") && name.ends_with(".txt"))) && begins_with_a_head(path)
    };
    let in_folder = |folder: PathBuf| {
        let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
            .into_iter()
            .flatten()
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(is_log)
            .collect();
        // A trajectory goes before other logs, such as odometry.
        found.sort_by_key(|path| (!path.to_string_lossy().contains("traj"), path.clone()));
        found.into_iter().next()
    };
    in_folder(folder.join("scene")).or_else(|| in_folder(folder.to_owned()))
}

/// Whether a file begins with the three whole numbers that stand before a pose: other programs write logs too.
fn begins_with_a_head(path: &Path) -> bool {
    let mut first = [0; 64];
    let read = regular_file::open(path).and_then(|mut file| file.read(&mut first));
    let Some(first) = read.ok().and_then(|length| first.get(..length)) else { return false };
    let text = String::from_utf8_lossy(first);
    let line = text.lines().next().unwrap_or_default();
    line.split_whitespace().count() == 3 && line.split_whitespace().all(|word| word.parse::<u64>().is_ok())
}

/// Whether the names of the colour pictures are a number and a stamp.
fn has_stamps(folder: &Path) -> bool {
    let is_stamped = |path: &PathBuf| {
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        stem.len() == 20
            && stem.as_bytes().get(7) == Some(&b'-')
            && stem.bytes().filter(u8::is_ascii_digit).count() == 19
    };
    let color = open3d::color_folder(folder).and_then(|color| pictures(&color).ok());
    color.is_some_and(|pictures| pictures.first().is_some_and(is_stamped))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OpenOptions;
    use crate::rgbd_folder::fixtures::{
        NUMBERS, SIZE as SMALL, check, check_pictures, log, plain, setting, views, write_color, write_depth,
        write_pictures,
    };
    use semascan_perception::view::PoseEvidence;
    use std::fs;

    #[test]
    fn a_trajectory_beside_the_pictures_makes_it_one_with_a_primesense() {
        let folder = tempfile::tempdir().expect("a folder");
        write_pictures(folder.path(), "rgb", SIZE);
        assert!(!is_recording(folder.path()));
        fs::write(folder.path().join("run.log"), "12:00 started\n").expect("written");
        assert!(!is_recording(folder.path()), "another program's log");
        for name in ["livingroom1-traj.txt", "apartment.log"] {
            fs::write(folder.path().join(name), log()).expect("written");
            let (source, found) = views(folder.path(), plain()).expect("views");
            assert_eq!((found.len(), found[0].intrinsics.fx, found[0].intrinsics.cx), (4, 525.0, 319.5));
            (0..).zip(&found).for_each(|(frame, view)| check(view, frame));
            assert!(setting(source.as_ref(), "intrinsics").contains("assumed"));
            fs::remove_file(folder.path().join(name)).expect("removed");
        }
    }

    #[test]
    fn an_object_scan_is_paired_by_the_stamps_of_its_names() {
        let folder = tempfile::tempdir().expect("a folder");
        for frame in 0..3_u32 {
            write_color(&folder.path().join(format!("rgb/{:07}-{:012}.jpg", frame + 1, 33_000 * frame)), SMALL, frame);
            let depth = folder.path().join(format!("depth/{:07}-{:012}.png", frame + 3, 33_000 * frame + 9_000));
            write_depth(&depth, SMALL, frame, 1000.0);
        }
        let options = OpenOptions { intrinsics: Some(NUMBERS), ..plain() };
        let (_, found) = views(folder.path(), options).expect("views");
        assert_eq!(found.len(), 3);
        for (frame, view) in (0..).zip(&found) {
            check_pictures(view, frame);
            assert_eq!(view.pose, PoseEvidence::None);
        }
        assert_eq!(found[2].stamp, Some(0.066));
    }
}
