//! The camera of a scene that several cameras saw: then all of its files and folders carry the camera's name, as in
//! `scene_camera_cam1.json`, `rgb_cam1/`, `depth_cam1/` and `mask_visib_cam1/` of the BOP data sets for industry (IPD, XYZ-IBD).
//!
//! A scene folder with one such camera that has depth is that camera's scene. Of several one is named by its file: the path
//! `000000/scene_camera_cam1.json` in place of `000000`.

use semascan_inspection::source::SourceError;
use std::path::{Path, PathBuf};

/// What the file that lists the cameras of a scene is called, without ending.
const CAMERAS: &str = "scene_camera";

/// Where the files of a scene's camera lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Sensor {
    folder: PathBuf,
    /// `_cam1`; empty where the scene has one camera without a name.
    suffix: String,
}

impl Sensor {
    /// Whether `path` is a scene folder, or the file of one of its cameras.
    pub(super) fn is_scene(path: &Path) -> bool {
        if path.is_dir() {
            return path.join("scene_camera.json").is_file() || !named(path).is_empty();
        }
        path.file_name().and_then(|name| suffix_of(name.to_str()?)).is_some() && path.is_file()
    }

    /// The camera that `path` means.
    ///
    /// # Errors
    /// [`SourceError::Format`] naming the cameras if there are several.
    pub(super) fn of(path: &Path) -> Result<Self, SourceError> {
        let of_file = path.file_name().and_then(|name| suffix_of(name.to_str()?)).filter(|_| !path.is_dir());
        if let Some(suffix) = of_file {
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            return Ok(Self { folder, suffix: suffix.to_owned() });
        }
        let plain = Self { folder: path.to_owned(), suffix: String::new() };
        if plain.json(CAMERAS).is_file() {
            return Ok(plain);
        }
        let named: Vec<Self> = named(path).into_iter().map(|suffix| Self { suffix, ..plain.clone() }).collect();
        let with_depth: Vec<&Self> = named.iter().filter(|sensor| sensor.pictures("depth").is_dir()).collect();
        match with_depth.as_slice() {
            [] => Ok(plain),
            [one] => Ok((*one).clone()),
            [first, ..] => Err(SourceError::Format {
                path: path.to_owned(),
                reason: format!(
                    "{} cameras saw the scene, each an inspection of its own: name the file of one, such as {}",
                    with_depth.len(),
                    first.json(CAMERAS).display()
                ),
            }),
        }
    }

    /// The scene's folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// What an inspection of it is called.
    pub(super) fn part(&self) -> String {
        let folder = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        let name = folder.file_name().map_or("scene".into(), |name| name.to_string_lossy().into_owned());
        match self.suffix.strip_prefix('_') {
            Some(camera) => format!("{name} {camera}"),
            None => name,
        }
    }

    /// `scene_camera`, `scene_gt` or `scene_gt_info` of the camera.
    pub(super) fn json(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}{}.json", self.suffix))
    }

    /// The folder with one kind of the camera's pictures: `rgb`, `depth`, `mask_visib`.
    pub(super) fn pictures(&self, kind: &str) -> PathBuf {
        self.folder.join(format!("{kind}{}", self.suffix))
    }
}

/// What the names of a camera's files end with, of the name of the file that lists its poses.
fn suffix_of(name: &str) -> Option<&str> {
    let suffix = name.strip_prefix(CAMERAS)?.strip_suffix(".json")?;
    (suffix.is_empty() || suffix.len() > 1 && suffix.starts_with('_')).then_some(suffix)
}

/// The cameras with names that a folder has files of, by name.
fn named(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut found: Vec<String> = entries
        .filter(|path| path.is_file())
        .filter_map(|path| Some(suffix_of(path.file_name()?.to_str()?)?.to_owned()))
        .filter(|suffix| !suffix.is_empty())
        .collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_camera_is_the_only_one_with_depth_or_named_by_its_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = folder.path().join("000003");
        for kind in ["rgb_cam1", "depth_cam1", "rgb_photo"] {
            fs::create_dir_all(scene.join(kind)).expect("made");
        }
        assert!(!Sensor::is_scene(&scene));
        for camera in ["cam1", "photo"] {
            fs::write(scene.join(format!("scene_camera_{camera}.json")), "{}").expect("written");
        }
        assert!(Sensor::is_scene(&scene));
        let only = Sensor::of(&scene).expect("one has depth");
        assert_eq!((only.part(), only.pictures("mask")), ("000003 cam1".into(), scene.join("mask_cam1")));
        fs::create_dir(scene.join("depth_photo")).expect("made");
        let error = Sensor::of(&scene).expect_err("two").to_string();
        assert!(error.contains("2 cameras") && error.contains("scene_camera_cam1.json"), "{error}");
        let file = scene.join("scene_camera_photo.json");
        assert!(Sensor::is_scene(&file) && !Sensor::is_scene(&scene.join("scene_gt_photo.json")));
        assert_eq!(Sensor::of(&file).expect("named").json("scene_gt"), scene.join("scene_gt_photo.json"));
        fs::write(scene.join("scene_camera.json"), "{}").expect("written");
        assert_eq!(Sensor::of(&scene).expect("the one without a name").part(), "000003");
    }
}
