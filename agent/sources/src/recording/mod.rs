//! Recordings that other people's robots made: MCAP files of any writer, ROS 2 bags (`.db3`, also those of RealSense's
//! recorder, and folders of rosbag2) and ROS 1 bags. Each pair of a colour and a depth picture becomes a view; its pose comes
//! from the recorded transforms.
//!
//! A recording is read twice: once from its beginning to its end to find the pictures and to keep what is small (`index`),
//! then picture by picture as the views are asked for, so that it may be larger than memory.
//!
//! | file | what |
//! |---|---|
//! | `container.rs` | what the files have in common |
//! | `mcap_file.rs`, `ros1_bag.rs`, `ros2_database.rs` | each kind of file; `blocks.rs`: pieces and chunks of them |
//! | `index.rs`, `realsense.rs` | what a recording holds |
//! | `options.rs`, `topics.rs`, `plan.rs` | which topics and pictures become views, and where the camera was |
//! | `view_maker.rs`, `registration.rs` | the pictures of a view, decoded, in one camera |

mod blocks;
mod container;
#[cfg(test)]
mod foreign;
mod index;
mod mcap_file;
mod options;
mod plan;
mod realsense;
mod registration;
mod ros1_bag;
mod ros2_database;
#[cfg(test)]
mod tests;
mod topics;
mod view_maker;

pub(crate) use container::{Channel, Found, Place};
pub(crate) use index::{Index, NoteKind, Picture, PictureStream, Scan};
pub(crate) use options::{DEVICE, number};
pub use options::{HandEye, KEYS, Key, RecordingOptions, Turntable};
pub(crate) use plan::{CameraFrame, PlannedView, camera_frame};
pub(crate) use topics::Chosen;
pub(crate) use view_maker::{Topics, ViewMaker};

use crate::OpenOptions;
use container::{Container, format_error};
use mcap_file::{FirstContent, McapFile};
use plan::Plan;
use ros1_bag::Ros1Bag;
use ros2_database::Ros2Database;
use semascan_formats::regular_file;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_model::Taxonomy;
use semascan_perception::view::View;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The metadata record that our own captures begin with.
const CAPTURE: &str = "semascan";

/// The kinds of files that recordings lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileKind {
    Mcap,
    Database,
    Bag,
}

/// A recording.
pub struct RecordingSource {
    path: PathBuf,
    info: SourceInfo,
    files: Vec<Box<dyn Container>>,
    index: Index,
    maker: ViewMaker,
    views: Vec<PlannedView>,
    next: usize,
}

impl RecordingSource {
    /// Whether `path` is a recording: a file by its first bytes, or a folder as rosbag2 makes it. Captures of our own are none.
    pub fn is_recording(path: &Path) -> bool {
        if path.is_dir() {
            return !bag_files(path).is_empty();
        }
        match file_kind(path) {
            Some(FileKind::Mcap) => McapFile::first_content(path, CAPTURE) == FirstContent::Messages,
            Some(FileKind::Database | FileKind::Bag) => true,
            None => false,
        }
    }

    /// Opens a recording and looks through it.
    ///
    /// # Errors
    /// [`SourceError`] naming the file: it cannot be read, or has no pictures that can be measured in.
    pub fn open(path: &Path, options: impl Into<OpenOptions>) -> Result<Self, SourceError> {
        let options = options.into();
        let recording = &options.recording;
        let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
        let paths = if path.is_dir() { bag_files(path) } else { vec![path.to_owned()] };
        if paths.is_empty() {
            return Err(refuse("is no recording: there is neither an MCAP file nor an SQLite file in it".to_owned()));
        }
        let mut files = paths.iter().map(|path| open_file(path)).collect::<Result<Vec<_>, _>>()?;
        let index = Index::of(&mut files, recording)?;
        let chosen = Chosen::of(&index, recording).map_err(refuse)?;
        let plan = Plan::of(&index, &chosen, recording, options.every as usize).map_err(refuse)?;
        let (maker, unit_said) = ViewMaker::new(&index, &chosen, &options)?;
        if plan.views.iter().any(|view| view.table_from_camera.is_none()) {
            let said = plan.said.iter().find(|(name, _)| name == plan::POSES).map_or("", |(_, text)| text);
            tracing::warn!("{}: poses: {said}", path.display());
        }
        let mut settings = plan.said;
        settings.push(("depth_unit".to_owned(), unit_said));
        settings.extend(maker.depth_camera().map(|said| ("depth_camera".to_owned(), said)));
        for fault in &index.faults {
            tracing::warn!("{}: {fault}", path.display());
            settings.push(("recording".to_owned(), fault.clone()));
        }
        let info = SourceInfo {
            uri: options.uri_of(path),
            part: path.file_stem().map_or("recording".into(), |name| name.to_string_lossy().into_owned()),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: Some(plan.views.len() as u32),
            turntable: None,
            volume: None,
            no_labels: Some("recordings of cameras have no labels".into()),
            settings,
        };
        let path = path.to_owned();
        Ok(Self { path, info, files, index, maker, views: plan.views, next: 0 })
    }

    /// The bytes of a picture.
    fn read(&mut self, picture: Picture) -> Result<Vec<u8>, String> {
        let file = self.files.get_mut(picture.file).ok_or("its file is gone")?;
        file.read(picture.place).map_err(|error| error.to_string())
    }

    fn read_view(&mut self, number: u32, planned: &PlannedView) -> Result<View, String> {
        let color = planned.color.map(|picture| self.read(picture)).transpose()?;
        let depth = self.read(planned.depth)?;
        self.maker.view(&self.index, number, planned, color.as_deref(), &depth)
    }
}

impl Source for RecordingSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let planned = self.views.get(self.next)?.clone();
        let index = self.next as u32;
        self.next += 1;
        let view = self.read_view(index, &planned);
        Some(view.map_err(|reason| SourceError::Format {
            path: self.path.clone(),
            reason: format!("view {index}: {reason}"),
        }))
    }

    fn rewind(&mut self) -> bool {
        self.next = 0;
        true
    }
}

/// What a file is, by its first bytes.
fn file_kind(path: &Path) -> Option<FileKind> {
    let mut first = [0; 16];
    let mut file = regular_file::open(path).ok()?;
    let mut read = 0;
    while let Ok(more @ 1..) = file.read(first.get_mut(read..)?) {
        read += more;
    }
    let kinds = [
        (mcap_file::MAGIC, FileKind::Mcap),
        (ros2_database::MAGIC, FileKind::Database),
        (ros1_bag::MAGIC, FileKind::Bag),
    ];
    kinds.into_iter().find(|(magic, _)| first.starts_with(magic)).map(|(_, kind)| kind)
}

fn open_file(path: &Path) -> Result<Box<dyn Container>, SourceError> {
    match file_kind(path) {
        Some(FileKind::Mcap) => McapFile::open(path).map(|file| Box::new(file) as _),
        Some(FileKind::Database) => Ros2Database::open(path).map(|file| Box::new(file) as _),
        Some(FileKind::Bag) => Ros1Bag::open(path).map(|file| Box::new(file) as _),
        None => {
            let hint = match path.extension().is_some_and(|extension| extension == "zstd") {
                true => "; it is compressed as a whole: `zstd -d` makes a recording of it",
                false => "",
            };
            Err(format_error(path, format!("is neither an MCAP file nor a ROS bag{hint}")))
        }
    }
}

/// The files of a folder that rosbag2 made, by name: SQLite files, or MCAP files beside a `metadata.yaml`.
fn bag_files(folder: &Path) -> Vec<PathBuf> {
    let has_metadata = folder.join("metadata.yaml").is_file();
    let is_one = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let ends = |ending: &str| name.ends_with(ending) || name.ends_with(&format!("{ending}.zstd"));
        (ends(".db3") || has_metadata && ends(".mcap")) && path.is_file()
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|p| is_one(p)).collect();
    files.sort();
    files
}
