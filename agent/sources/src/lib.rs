//! Where views come from: a file or folder a source. Each implements [`Source`], and has a line in the table `KINDS`.

pub mod bop;
pub mod camera_mask;
pub mod camera_model;
mod cell_calibration;
pub mod depth_map;
#[cfg(test)]
mod foreign_python;
pub mod live;
pub mod mcap;
pub mod messages;
mod open3d;
mod options;
pub mod pairing;
pub mod pcd;
mod pinhole_fit;
mod ply;
mod ply_grid;
mod recorded_pose;
pub mod recording;
mod redwood;
mod rgbd_folder;
mod seven_scenes;
pub mod training_set;
pub mod transforms;
mod tum;
mod zdf;

pub use options::OpenOptions;

use bop::BopSource;
use live::{LiveAddress, LiveSource};
use mcap::McapSource;
use pcd::PcdSource;
use recording::RecordingSource;
use semascan_formats::regular_file;
use semascan_inspection::source::{Source, SourceError};
use semascan_model::choice::nearest;
use std::path::{Path, PathBuf};

/// An open source, or why it cannot be opened.
type Opened = Result<Box<dyn Source>, SourceError>;

/// A kind of source that a path may name.
struct Kind {
    /// What it is, for people who named something else.
    name: &'static str,
    /// Whether the file or folder is one.
    recognizes: fn(&Path) -> bool,
    /// Whether it has options of its own, behind a `?`.
    has_options: bool,
    /// Opens it; what the options say is used where it applies.
    open: fn(&Path, &OpenOptions) -> Opened,
}

/// Every kind, in the order in which they are tried.
const KINDS: &[Kind] = &[
    Kind {
        name: "a BOP scene folder (with scene_camera.json), or the file of one of its cameras",
        recognizes: BopSource::is_scene,
        has_options: false,
        open: |path, options| {
            refuse_intrinsics(path, options, "a BOP scene")?;
            Ok(Box::new(BopSource::open(path, options)?))
        },
    },
    Kind {
        name: "a TUM RGB-D recording (with rgb.txt and depth.txt)",
        recognizes: tum::is_recording,
        has_options: false,
        open: |path, options| Ok(Box::new(tum::open(path, options)?)),
    },
    Kind {
        name: "a 7-Scenes sequence (with frame-000000.depth.png)",
        recognizes: seven_scenes::is_recording,
        has_options: false,
        open: |path, options| Ok(Box::new(seven_scenes::open(path, options)?)),
    },
    Kind {
        name: "a Redwood recording (color/ or rgb/, depth/ and a trajectory)",
        recognizes: redwood::is_recording,
        has_options: false,
        open: |path, options| Ok(Box::new(redwood::open(path, options)?)),
    },
    Kind {
        name: "an Open3D recording (color/, image/ or rgb/, depth/ and camera_intrinsic.json)",
        recognizes: open3d::is_recording,
        has_options: false,
        open: |path, options| Ok(Box::new(open3d::open(path, options)?)),
    },
    Kind {
        name: "organized clouds in a PCD file or a folder of them",
        recognizes: PcdSource::is_source,
        has_options: false,
        open: |path, options| {
            refuse_intrinsics(path, options, "a cloud")?;
            Ok(Box::new(PcdSource::open(path, options)?))
        },
    },
    Kind {
        name: "organized clouds in a PLY file or a folder of them",
        recognizes: ply::is_source,
        has_options: false,
        open: |path, options| {
            refuse_intrinsics(path, options, "a cloud")?;
            Ok(Box::new(ply::open(path, options)?))
        },
    },
    Kind {
        name: "a recording of a robot's messages (MCAP, ROS 2 bag, ROS 1 bag)",
        recognizes: RecordingSource::is_recording,
        has_options: true,
        open: |path, options| {
            refuse_intrinsics(path, options, "a recording of messages")?;
            Ok(Box::new(RecordingSource::open(path, options)?))
        },
    },
    Kind {
        name: "a capture of a Zivid camera in a ZDF file or a folder of them",
        has_options: false,
        recognizes: zdf::is_source,
        open: |path, options| {
            refuse_intrinsics(path, options, "a cloud")?;
            Ok(Box::new(zdf::open(path, options)?))
        },
    },
    Kind {
        name: "a capture in an MCAP file",
        recognizes: McapSource::is_capture,
        has_options: false,
        open: |path, options| {
            refuse_intrinsics(path, options, "a capture")?;
            let reason = if options.unit.is_some() || options.depth_scale.is_some() {
                "a capture says its unit itself (metres): no other can be given"
            } else if options.every > 1 {
                "every so many views can be taken of recordings in folders; of a capture --keyframes takes those that matter"
            } else {
                return Ok(Box::new(McapSource::open(path)?));
            };
            Err(SourceError::Uri { uri: path.display().to_string(), reason: reason.to_owned() })
        },
    },
];

/// Refuses intrinsics for a source that has its own.
fn refuse_intrinsics(path: &Path, options: &OpenOptions, what: &str) -> Result<(), SourceError> {
    if options.intrinsics.is_none() {
        return Ok(());
    }
    let reason = format!("{what} says itself what camera it is of: no other can be given");
    Err(SourceError::Uri { uri: path.display().to_string(), reason })
}

/// Opens the recording that `uri` names, by what lies there; keys behind a `?` are those of [`recording::KEYS`]. A [`CameraMask`](semascan_inspection::spec::CameraMask) alone
/// is options too.
///
/// # Errors
/// [`SourceError`] if there is none, or it cannot be opened.
pub fn open(uri: &str, options: impl Into<OpenOptions>) -> Result<Box<dyn Source>, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: uri.into(), reason };
    let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
    let mut options = options.into();
    if LiveAddress::is_one(uri) {
        let address = LiveAddress::read_with(uri, options.recording.clone()).map_err(refuse)?;
        return Ok(Box::new(LiveSource::open(address, options)?));
    }
    if let Some((scheme, _)) = uri.split_once("://") {
        let known = names.join(", or ");
        return Err(refuse(format!(
            "no source speaks {scheme}://; what can be inspected is {known}, or a camera at ws://"
        )));
    }
    // A file may have a question mark in its name.
    let path = match uri.split_once('?') {
        Some((path, query)) if !Path::new(uri).exists() => {
            options.recording = options.recording.with_query(query).map_err(refuse)?;
            Path::new(path)
        }
        _ => Path::new(uri),
    };
    if !path.exists() {
        return Err(refuse(missing(path)));
    }
    if !path.is_dir() {
        regular_file::check(path).map_err(|error| refuse(error.to_string()))?;
    }
    match KINDS.iter().find(|kind| (kind.recognizes)(path)) {
        Some(kind) if !kind.has_options && !options.recording.query.is_empty() => {
            Err(refuse(format!("{} has no options behind a `?`", kind.name)))
        }
        Some(kind) => (kind.open)(path, &options),
        None => Err(refuse(format!("neither {}{}", names.join(" nor "), below(path)))),
    }
}

/// Levels of folders below the one that was named in which sources are looked for.
const LEVELS: u32 = 3;
/// Most folders that are looked into for that.
const MOST_FOLDERS: usize = 500;

/// What is said of a path at which there is nothing: the name beside it that was meant, where one is alike.
fn missing(path: &Path) -> String {
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let beside: Vec<String> = folders_and_files(parent).map(|p| file_name(&p)).collect();
    let beside: Vec<&str> = beside.iter().map(String::as_str).collect();
    match nearest(&file_name(path), &beside) {
        Some(name) => format!("no such file or folder; did you mean {}?", path.with_file_name(name).display()),
        None => "no such file or folder".to_owned(),
    }
}

/// What is said of a folder that is no source, but holds some: a training set with its scenes, a data set with its splits.
fn below(path: &Path) -> String {
    let mut found: Vec<PathBuf> = Vec::new();
    let (mut level, mut looked_into) = (vec![path.to_owned()], 0);
    for _ in 0..LEVELS {
        let mut next: Vec<PathBuf> = Vec::new();
        for folder in &level {
            next.extend(folders_and_files(folder).filter(|path| path.is_dir()));
        }
        next.sort();
        next.truncate(MOST_FOLDERS - looked_into);
        looked_into += next.len();
        found.extend(next.iter().filter(|folder| KINDS.iter().any(|kind| (kind.recognizes)(folder))).cloned());
        if !found.is_empty() {
            break;
        }
        level = next;
    }
    match found.as_slice() {
        [] => String::new(),
        [one] => format!("; did you mean {}, which is in it?", one.display()),
        [first, ..] => format!(
            "; {} sources are in it, each an inspection of its own: did you mean {}?",
            found.len(),
            first.display()
        ),
    }
}

fn folders_and_files(folder: &Path) -> impl Iterator<Item = PathBuf> {
    std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()))
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(path: &Path) -> String {
        match open(&path.display().to_string(), OpenOptions::default()) {
            Ok(_) => panic!("{} is no source", path.display()),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_set_of_scenes_names_the_first_and_a_slip_what_was_meant() {
        let root = tempfile::tempdir().expect("a folder");
        let set = root.path().join("set");
        for scene in ["000000", "000001"] {
            std::fs::create_dir_all(set.join(scene)).expect("a folder");
            std::fs::write(set.join(scene).join("scene_camera.json"), "{}").expect("writes");
        }
        let first = format!("did you mean {}?", set.join("000000").display());
        let said = refused(&set);
        assert!(said.contains(&first) && said.contains("2 sources"), "{said}");
        let outer = refused(root.path());
        assert!(outer.contains(&first), "a data set with splits: {outer}");
        let slip = refused(&root.path().join("sett"));
        assert!(slip.contains(&format!("did you mean {}?", set.display())), "{slip}");
        let nothing = refused(&root.path().join("elsewhere/other"));
        assert!(nothing.ends_with("no such file or folder"), "{nothing}");
        std::fs::create_dir(root.path().join("empty")).expect("a folder");
        let empty = refused(&root.path().join("empty"));
        assert!(empty.contains("scene_camera.json") && !empty.contains("did you mean"), "{empty}");
    }
}
