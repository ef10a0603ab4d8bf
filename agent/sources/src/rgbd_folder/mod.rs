//! Recordings of an RGB-D camera in folders: colour files, depth files, a trajectory, intrinsics. What the layouts have in common:
//! their readers ([`crate::tum`], [`crate::seven_scenes`], [`crate::open3d`], [`crate::redwood`]) say what there is, and this
//! source makes views of it.
//!
//! Pictures of a lens become those of a pinhole, and depth of a second camera is brought to the colour picture
//! ([`crate::camera_model`]). A recording without any trajectory gives views without poses, to be found by registration. In one
//! with a trajectory a frame without a pose (a gap of the tracking) is left out and counted: nothing says where it belongs,
//! and thousands of others show the same. Poses are those of the camera in the world of the trajectory, `table_from_camera`.

mod association;
mod camera;
#[cfg(test)]
pub(crate) mod fixtures;
mod numbering;
#[cfg(test)]
mod tests;
mod text;
mod trajectory;

pub(crate) use association::{TOLERANCE, pairs};
pub(crate) use camera::{FolderCamera, pinhole};
pub(crate) use numbering::{paired_pictures, pictures};
pub(crate) use text::{Rows, numbers, read_text};
pub(crate) use trajectory::{Trajectory, from_json, from_log, pose_of_matrix};

use crate::OpenOptions;
use crate::bop::pictures::{self as picture, DepthUnit, StoredDepth};
use crate::bop::{mask, raster, units};
use crate::camera_mask::{self, CameraPixels, PosedDepth};
use crate::camera_model::DepthEncoding;
use crate::recorded_pose::evidence;
use camera::Alignment;
use nalgebra::Isometry3;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::CameraMask;
use semascan_model::Taxonomy;
use semascan_perception::view::{DepthImage, View};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Standard deviations assumed of recorded poses: no layout records any. Radians and metres.
const POSE_SIGMA: (f64, f64) = (0.01, 0.005);
/// Views that are looked at for pixels that show the robot.
const FOR_A_MASK: usize = 24;

/// A frame of a recording, before its files are read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) color: PathBuf,
    pub(crate) depth: PathBuf,
    /// Seconds on the recording's clock.
    pub(crate) stamp: Option<f64>,
    /// In metres; `None` where the recording has none.
    pub(crate) table_from_camera: Option<Isometry3<f64>>,
}

/// What a reader found.
#[derive(Debug)]
pub(crate) struct Recording {
    /// Folder.
    pub(crate) path: PathBuf,
    /// What it is, for people: `a TUM RGB-D recording`.
    pub(crate) kind: &'static str,
    /// In the order of the capture.
    pub(crate) frames: Vec<Frame>,
    /// Whether there is a trajectory.
    pub(crate) has_trajectory: bool,
    pub(crate) camera: FolderCamera,
    pub(crate) encoding: DepthEncoding,
    /// What was assumed, or is to be known: a name and a sentence.
    pub(crate) said: Vec<(&'static str, String)>,
}

/// Views of a recording in a folder.
#[derive(Debug)]
pub(crate) struct RgbdFolder {
    info: SourceInfo,
    frames: Vec<Frame>,
    alignment: Alignment,
    unit: DepthUnit,
    encoding: DepthEncoding,
    /// Pixels that show the robot, row-major.
    ignore: Option<Vec<bool>>,
    next: usize,
}

impl RgbdFolder {
    /// The views of `recording`, as `options` say.
    ///
    /// # Errors
    /// [`SourceError`] naming the folder if it has no usable frame, or the file at fault.
    pub(crate) fn new(recording: Recording, options: &OpenOptions) -> Result<Self, SourceError> {
        let Recording { path, kind, mut frames, has_trajectory, camera, mut encoding, mut said } = recording;
        let refuse = |reason: String| SourceError::Format { path: path.clone(), reason };
        if frames.is_empty() {
            return Err(refuse(format!("{kind}: no colour picture has a depth picture that goes with it")));
        }
        let recorded = frames.len();
        if has_trajectory {
            frames.retain(|frame| frame.table_from_camera.is_some());
            let left_out = recorded - frames.len();
            if frames.is_empty() {
                return Err(refuse(format!("{kind}: none of {recorded} frames has a pose in its trajectory")));
            }
            let unposed = format!("; {left_out} of {recorded} frames have none and are left out");
            said.push(("poses", format!("of the trajectory{}", if left_out > 0 { unposed.as_str() } else { "" })));
        } else {
            said.push(("poses", "there is no trajectory: where views were taken is not known".into()));
        }
        let every = options.every.max(1) as usize;
        if every > 1 {
            let posed = frames.len();
            frames = frames.into_iter().step_by(every).collect();
            said.push(("frames", format!("one of every {every}: {} of {posed}", frames.len())));
        }
        if let Some(unit) = options.unit {
            for pose in frames.iter_mut().filter_map(|frame| frame.table_from_camera.as_mut()) {
                pose.translation.vector *= unit.in_metres();
            }
            said.push(("pose_unit", format!("{}, as said", unit.name())));
        }
        if let Some(device) = options.recording.device {
            // What the camera's file says of the unit is of this recording; what the layout has is of others.
            let unit = camera.depth_per_metre.map_or(device.metres_per_unit, |per_metre| 1.0 / per_metre);
            encoding = DepthEncoding { metres_per_unit: unit, ..*device };
            said.push(("depth_camera", format!("{device}, as said")));
        }
        if let Some(millimetres) = options.depth_scale {
            encoding.metres_per_unit = millimetres * 1e-3;
        }
        let alignment = camera.alignment(&path)?;
        said.push(("intrinsics", alignment.describe(camera.origin())));
        let unit = depth_unit(&frames, &encoding, options.depth_scale.is_some(), &mut said)?;
        let part = path.file_name().map_or("recording".into(), |name| name.to_string_lossy().into_owned());
        let info = SourceInfo {
            uri: options.uri_of(&path),
            part,
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: u32::try_from(frames.len()).ok(),
            turntable: None,
            volume: None,
            no_labels: Some(format!("{kind} has no labels")),
            settings: Vec::new(),
        };
        let mut folder = Self { info, frames, alignment, unit, encoding, ignore: None, next: 0 };
        let (ignore, taken) = folder.camera_mask(&options.camera_mask)?;
        folder.ignore = ignore;
        said.push(("camera_mask", taken));
        for (name, text) in said {
            tracing::info!("{}: {name}: {text}", path.display());
            folder.info.settings.push((name.to_owned(), text));
        }
        Ok(folder)
    }

    /// Pixels that move with the camera, and what is said of them.
    fn camera_mask(&self, asked: &CameraMask) -> Result<(Option<Vec<bool>>, String), SourceError> {
        let share = |ignore: &[bool]| {
            let count = ignore.iter().filter(|ignored| **ignored).count();
            (count, 100.0 * count as f64 / ignore.len().max(1) as f64)
        };
        match asked {
            CameraMask::None => Ok((None, "off".to_owned())),
            CameraMask::File(path) => {
                let ignore = mask::read(path)?.inside;
                let (count, percent) = share(&ignore);
                Ok((Some(ignore), format!("{count} pixels ignored ({percent:.1} % of the picture, from file)")))
            }
            CameraMask::Auto => {
                let posed: Vec<PosedDepth> = self.looked_at().filter_map(|frame| self.posed_depth(frame)).collect();
                Ok(match camera_mask::find(&posed) {
                    CameraPixels::Nothing => (None, "0 pixels ignored (nothing found)".to_owned()),
                    CameraPixels::Found { ignore, share: of_depth } => {
                        let (count, _) = share(&ignore);
                        let percent = 100.0 * of_depth;
                        (Some(ignore), format!("{count} pixels ignored ({percent:.1} % of those with depth, found)"))
                    }
                    CameraPixels::TooMany { share } => (
                        None,
                        format!(
                            "0 pixels ignored: what seems to move with the camera is {:.0} % of the pixels with depth, \
                             which is no robot",
                            100.0 * share
                        ),
                    ),
                })
            }
        }
    }

    /// Frames spread over the recording.
    fn looked_at(&self) -> impl Iterator<Item = &Frame> {
        let count = self.frames.len().min(FOR_A_MASK);
        (0..count).filter_map(move |i| self.frames.get(i * self.frames.len() / count))
    }

    /// The depth of a frame with its pose; `None` if it has none, or cannot be read.
    fn posed_depth(&self, frame: &Frame) -> Option<PosedDepth> {
        let table_from_camera = frame.table_from_camera?;
        let (depth, _) = self.read_depth(frame).ok()?;
        Some(PosedDepth { intrinsics: *self.alignment.intrinsics(), depth, table_from_camera })
    }

    /// Depth of a frame in the colour camera's picture, and why pixels of the file have none.
    fn read_depth(&self, frame: &Frame) -> Result<(DepthImage, String), SourceError> {
        let (depth, unmeasured) = StoredDepth::read(&frame.depth)?.in_metres(self.unit, Some(&self.encoding));
        let depth = self.alignment.depth(depth).map_err(|error| self.other_size(&frame.depth, &error))?;
        Ok((depth, unmeasured.to_string()))
    }

    /// A picture that is not of the camera.
    fn other_size(&self, path: &Path, error: &dyn std::fmt::Display) -> SourceError {
        SourceError::Format { path: path.to_owned(), reason: format!("{error}: {}", self.alignment.hint()) }
    }

    fn read_view(&self, index: u32, frame: &Frame) -> Result<View, SourceError> {
        let rgb = picture::read_color(&frame.color)?;
        let rgb = self.alignment.color(rgb).map_err(|error| self.other_size(&frame.color, &error))?;
        let (mut depth, unmeasured) = self.read_depth(frame)?;
        let refuse = |reason: String| SourceError::Format { path: frame.depth.clone(), reason };
        if depth.metres.iter().all(|z| *z <= 0.0) {
            return Err(refuse(format!("no depth in the whole picture: {unmeasured}")));
        }
        if let Some(ignore) = &self.ignore {
            if ignore.len() != depth.metres.len() {
                return Err(refuse(format!("{} pixels, but the camera mask has {}", depth.metres.len(), ignore.len())));
            }
            depth.metres.iter_mut().zip(ignore).filter(|(_, ignored)| **ignored).for_each(|(z, _)| *z = 0.0);
            if depth.metres.iter().all(|z| *z <= 0.0) {
                let reason = "the camera mask takes all pixels that have depth (--camera-mask none switches it off)";
                return Err(refuse(reason.to_owned()));
            }
        }
        let pose = evidence(frame.table_from_camera, POSE_SIGMA);
        Ok(View {
            index,
            stamp: frame.stamp,
            intrinsics: *self.alignment.intrinsics(),
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose,
            labels: None,
            truth: None,
        })
    }
}

/// What a depth of 1 means: as the layout has it, or, for floating point numbers, as their size says.
fn depth_unit(
    frames: &[Frame],
    encoding: &DepthEncoding,
    is_said: bool,
    said: &mut Vec<(&'static str, String)>,
) -> Result<DepthUnit, SourceError> {
    let whole = encoding.metres_per_unit;
    let of_layout = format!("a depth of 1 is {:.4} mm ({})", 1e3 * whole, encoding.description);
    let plain = DepthUnit { whole, float: whole };
    let stored =
        frames.iter().take(FOR_A_MASK).find_map(|frame| StoredDepth::read(&frame.depth).ok().map(|s| (frame, s)));
    let Some((frame, stored)) = stored.filter(|(_, stored)| stored.is_float() && !is_said) else {
        said.push((
            "depth_unit",
            if is_said { format!("a depth of 1 is {:.4} mm, as said", 1e3 * whole) } else { of_layout },
        ));
        return Ok(plain);
    };
    let Some(median) = stored.median() else { return Ok(plain) };
    let float = units::float_unit(median, whole).ok_or_else(|| SourceError::Format {
        path: frame.depth.clone(),
        reason: format!(
            "floating point depths with a median of {median} are neither metres nor millimetres; say what they are with \
             --depth-scale MM"
        ),
    })?;
    said.push(("depth_unit", format!("floating point depths are taken to be in units of {} mm", 1e3 * float)));
    Ok(DepthUnit { whole, float })
}

impl Source for RgbdFolder {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let frame = self.frames.get(self.next)?;
        let index = u32::try_from(self.next).ok()?;
        self.next += 1;
        Some(self.read_view(index, frame))
    }

    fn rewind(&mut self) -> bool {
        self.next = 0;
        true
    }
}

/// Columns and rows of the first picture of `frames` that can be read.
pub(crate) fn picture_size(frames: &[Frame]) -> Option<(u32, u32)> {
    frames.iter().take(FOR_A_MASK).find_map(|frame| raster::dimensions(&frame.color).ok())
}
