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
//! | `registration.rs` | colour and depth in one camera |

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

pub use container::ContainerError;
pub use options::{KEYS, Key, RecordingOptions};

use crate::OpenOptions;
use crate::bop::mask;
use crate::messages::{CloudPicture, ColorPicture, Content, DepthUnit, Message, MessageError, Stamp, decode};
use crate::pinhole_fit::pinhole;
use container::Container;
use image::RgbImage;
use index::{CalibrationStream, Index, Picture, PictureStream};
use mcap_file::{FirstContent, McapFile};
use plan::{Plan, PlannedView};
use registration::{Camera, DepthFrame, Registrar};
use ros1_bag::Ros1Bag;
use ros2_database::Ros2Database;
use semascan_formats::regular_file;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::CameraMask;
use semascan_model::Taxonomy;
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, View, covariance_of_prior};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use topics::{Chosen, is_aligned, is_rectified};

/// The metadata record that our own captures begin with.
const CAPTURE: &str = "semascan";
/// Standard deviations assumed of recorded poses, which ROS does not state: radians and metres.
const POSE_SIGMA: (f64, f64) = (0.01, 0.003);
/// What is shown where nothing has a colour.
const GREY: [u8; 3] = [128; 3];

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
    topics: Topics,
    views: Vec<PlannedView>,
    next: usize,
    unit: DepthUnit,
    /// Pixels that show the robot, row-major.
    ignore: Option<Vec<bool>>,
}

/// The chosen streams by their places in the index.
#[derive(Clone, Copy, Debug)]
struct Topics {
    color: Option<usize>,
    depth: usize,
    color_calibration: Option<usize>,
    depth_calibration: Option<usize>,
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
        let index = Index::of(&mut files, recording.transform_tolerance).map_err(named)?;
        let chosen = Chosen::of(&index, recording).map_err(refuse)?;
        let plan = Plan::of(&index, &chosen, recording).map_err(refuse)?;
        let (unit, unit_said) = depth_unit(&index, chosen.depth, &options);
        let topics = Topics::of(&index, &chosen);
        if plan.views.iter().any(|view| view.table_from_camera.is_none()) {
            let said = plan.said.iter().find(|(name, _)| name == plan::POSES).map_or("", |(_, text)| text);
            tracing::warn!("{}: poses: {said}", path.display());
        }
        let mut settings = plan.said;
        settings.push(("depth_unit".to_owned(), unit_said));
        for fault in &index.faults {
            tracing::warn!("{}: {fault}", path.display());
            settings.push(("recording".to_owned(), fault.clone()));
        }
        let ignore = match &options.camera_mask {
            CameraMask::File(file) => Some(mask::read(file)?.inside),
            CameraMask::None | CameraMask::Auto => None,
        };
        let query = if recording.query.is_empty() { String::new() } else { format!("?{}", recording.query) };
        let info = SourceInfo {
            uri: format!("{}{query}", path.display()),
            part: path.file_stem().map_or("recording".into(), |name| name.to_string_lossy().into_owned()),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: Some(plan.views.len() as u32),
            turntable: None,
            volume: None,
            no_labels: Some("recordings of cameras have no labels".into()),
            settings,
        };
        let path = path.to_owned();
        Ok(Self { path, info, files, index, topics, views: plan.views, next: 0, unit, ignore })
    }

    /// Reads and decodes a picture of a stream.
    fn message(&mut self, stream: usize, picture: Picture) -> Result<Message, String> {
        let stream = self.index.pictures.get(stream).ok_or("its topic is gone")?;
        let file = self.files.get_mut(picture.file).ok_or("its file is gone")?;
        let bytes = file.read(picture.place).map_err(|error| error.to_string())?;
        let said = |error: MessageError| format!("{} at {:.3} s: {error}", stream.topic, picture.stamp.seconds());
        decode(stream.kind, stream.encoding, &bytes).map_err(said)
    }

    fn read_view(&mut self, index: u32, planned: &PlannedView) -> Result<View, String> {
        let Topics { color, depth, .. } = self.topics;
        let color = match (color, planned.color) {
            (Some(stream), Some(picture)) => match self.message(stream, picture)? {
                Message::Color(color) => Some(color),
                _ => return Err("a colour picture became something else".to_owned()),
            },
            _ => None,
        };
        let (intrinsics, rgb, mut depth) = match (self.message(depth, planned.depth)?, color) {
            (Message::Depth(depth), Some(color)) => {
                self.registered(color, depth.in_metres(self.unit), planned.depth.stamp)?
            }
            (Message::Cloud(cloud), color) => of_cloud(cloud, color, self.unit.float)?,
            _ => return Err("a depth picture has no colours".to_owned()),
        };
        self.take_robot_out(&mut depth)?;
        if depth.metres.iter().all(|z| *z <= 0.0) {
            return Err(format!("no depth in the whole picture at {:.3} s", planned.depth.stamp.seconds()));
        }
        let (rotation, translation) = POSE_SIGMA;
        let pose = planned.table_from_camera.map_or(PoseEvidence::None, |table_from_camera| PoseEvidence::World {
            table_from_camera,
            covariance: covariance_of_prior(rotation, translation),
        });
        Ok(View {
            index,
            stamp: Some(planned.depth.stamp.seconds()),
            intrinsics,
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose,
            labels: None,
            truth: None,
        })
    }

    /// Colour and depth in the colour camera.
    fn registered(
        &self,
        color: ColorPicture,
        depth: DepthImage,
        stamp: Stamp,
    ) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
        let Topics { color: color_stream, depth: depth_stream, color_calibration, depth_calibration } = self.topics;
        let color_stream = self.stream(color_stream.ok_or("it has no colours")?)?;
        let depth_stream = self.stream(depth_stream)?;
        let color_camera = self.camera(color_stream, color_calibration, stamp)?;
        let mut depth_camera = self.camera(depth_stream, depth_calibration, stamp)?;
        // What is aligned to a rectified picture is rectified.
        depth_camera.is_rectified |= is_aligned(&depth_stream.topic) && color_camera.is_rectified;
        let depth_frame = if is_aligned(&depth_stream.topic) || color_stream.frame == depth_stream.frame {
            DepthFrame::Color
        } else {
            match self.index.transforms.pose(&color_stream.frame, &depth_stream.frame, stamp) {
                Ok(color_from_depth) => DepthFrame::Apart { color_from_depth },
                Err(_) => DepthFrame::Unknown,
            }
        };
        depth_in_color((color_camera, color.rgb), (depth_camera, depth), depth_frame)
    }

    fn stream(&self, place: usize) -> Result<&PictureStream, String> {
        self.index.pictures.get(place).ok_or_else(|| "its topic is gone".to_owned())
    }

    /// The camera of a stream as it was at a time.
    fn camera<'a>(
        &'a self,
        stream: &'a PictureStream,
        calibration: Option<usize>,
        stamp: Stamp,
    ) -> Result<Camera<'a>, String> {
        let calibrations = calibration.and_then(|place| self.index.calibrations.get(place));
        let calibration = calibrations.and_then(|calibrations| calibrations.at(stamp));
        let calibration = calibration.ok_or_else(|| format!("{} has no calibration", stream.topic))?;
        Ok(Camera { topic: &stream.topic, calibration, is_rectified: is_rectified(&stream.topic) })
    }

    /// Depth of pixels that show the robot becomes unmeasured.
    fn take_robot_out(&self, depth: &mut DepthImage) -> Result<(), String> {
        let Some(ignore) = &self.ignore else { return Ok(()) };
        if ignore.len() != depth.metres.len() {
            return Err(format!("{} pixels, but the camera mask has {}", depth.metres.len(), ignore.len()));
        }
        for (z, _) in depth.metres.iter_mut().zip(ignore).filter(|(_, ignored)| **ignored) {
            *z = 0.0;
        }
        Ok(())
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

impl Topics {
    fn of(index: &Index, chosen: &Chosen<'_>) -> Self {
        let stream = |wanted: &PictureStream| index.pictures.iter().position(|stream| std::ptr::eq(stream, wanted));
        let calibration =
            |wanted: &CalibrationStream| index.calibrations.iter().position(|stream| std::ptr::eq(stream, wanted));
        Self {
            color: chosen.color.and_then(stream),
            depth: stream(chosen.depth).unwrap_or_default(),
            color_calibration: chosen.color_calibration.and_then(calibration),
            depth_calibration: chosen.depth_calibration.and_then(calibration),
        }
    }
}

/// An organized cloud as a view: the pinhole is read off its points. Where it has no colours of its own they are those of the
/// picture that belongs to it, if that has its size.
fn of_cloud(
    cloud: CloudPicture,
    color: Option<ColorPicture>,
    unit: f64,
) -> Result<(Intrinsics, RgbImage, DepthImage), String> {
    let CloudPicture { width, height, positions, colors, .. } = cloud;
    let positions: Vec<[f32; 3]> =
        positions.into_iter().map(|point| point.map(|c| (f64::from(c) * unit) as f32)).collect();
    let intrinsics = pinhole(width, height, &positions)?.intrinsics;
    let measured = |p: &[f32; 3]| p.iter().all(|c| c.is_finite()) && p[2] > 0.0;
    let metres = positions.iter().map(|p| if measured(p) { p[2] } else { 0.0 }).collect();
    let rgb = match (colors, color) {
        (None, Some(color)) if color.rgb.dimensions() == (width, height) => color.rgb,
        (colors, _) => {
            let pixels = colors.unwrap_or_else(|| vec![GREY; positions.len()]);
            RgbImage::from_raw(width, height, pixels.into_iter().flatten().collect())
                .ok_or("there is not one colour for each point")?
        }
    };
    Ok((intrinsics, rgb, DepthImage { width, height, metres }))
}

/// What a depth of 1 is: as asked for, as the camera states it, or as ROS has it.
fn depth_unit(index: &Index, depth: &PictureStream, options: &OpenOptions) -> (DepthUnit, String) {
    let both = |metres: f64| DepthUnit { integer: metres, float: metres };
    if let Some(millimetres) = options.depth_scale {
        return (both(millimetres * 1e-3), format!("{millimetres} mm, as said"));
    }
    if let Some(unit) = options.unit {
        return (both(unit.in_metres()), format!("{}, as said", unit.name()));
    }
    let of_camera = index.depth_units.iter().find(|(stream, _)| depth.topic.starts_with(&format!("{stream}/")));
    match (depth.content, of_camera) {
        (Content::Cloud, _) => (DepthUnit::default(), "m, as ROS has it".to_owned()),
        (_, Some((_, unit))) => {
            (DepthUnit { integer: *unit, ..DepthUnit::default() }, format!("{} mm, as the camera states", 1e3 * unit))
        }
        (_, None) => (DepthUnit::default(), "whole numbers are mm, others m, as ROS has it".to_owned()),
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
    let file: Result<Box<dyn Container>, ContainerError> = match file_kind(path) {
        Some(FileKind::Mcap) => McapFile::open(path).map(|file| Box::new(file) as _),
        Some(FileKind::Database) => Ros2Database::open(path).map(|file| Box::new(file) as _),
        Some(FileKind::Bag) => Ros1Bag::open(path).map(|file| Box::new(file) as _),
        None => {
            let hint = match path.extension().is_some_and(|extension| extension == "zstd") {
                true => "; it is compressed as a whole: `zstd -d` makes a recording of it",
                false => "",
            };
            Err(ContainerError::format(path, format!("is neither an MCAP file nor a ROS bag{hint}")))
        }
    };
    file.map_err(named)
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

fn named(error: ContainerError) -> SourceError {
    match error {
        ContainerError::Io { path, source } => SourceError::Io { path, source },
        ContainerError::Format { path, reason } => SourceError::Format { path, reason },
    }
}
