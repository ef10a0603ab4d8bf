//! How a recording is read: what its own files do not say, or say wrongly.

use crate::recording::RecordingOptions;
use semascan_inspection::spec::{CameraMask, InspectionSpec, LabelSource};
use semascan_model::LengthUnit;

/// How a recording is read.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenOptions {
    /// Pixels that show the robot.
    pub camera_mask: CameraMask,
    /// Unit of the recorded lengths; by default that of the format, checked where the recording allows it.
    pub unit: Option<LengthUnit>,
    /// Millimetres of a depth of 1; by default what the recording says.
    pub depth_scale: Option<f64>,
    /// Only every so many frames of a recording in a folder become views, from the first on; 1 (or 0) is all of them.
    pub every: u32,
    /// Focal lengths and principal point of the colour camera in pixels (fx, fy, cx, cy), where the recording does not say them.
    pub intrinsics: Option<[f64; 4]>,
    /// Whether recorded labels are read; otherwise their files are not looked at.
    pub labels: bool,
    /// Topics, frames and the step between views of a recording of messages.
    pub recording: RecordingOptions,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            camera_mask: CameraMask::default(),
            unit: None,
            depth_scale: None,
            every: 1,
            intrinsics: None,
            labels: true,
            recording: RecordingOptions::default(),
        }
    }
}

impl From<&CameraMask> for OpenOptions {
    fn from(camera_mask: &CameraMask) -> Self {
        Self { camera_mask: camera_mask.clone(), ..Self::default() }
    }
}

impl From<&Self> for OpenOptions {
    fn from(options: &Self) -> Self {
        options.clone()
    }
}

impl From<&InspectionSpec> for OpenOptions {
    fn from(spec: &InspectionSpec) -> Self {
        Self {
            camera_mask: spec.source.camera_mask.clone(),
            unit: spec.source.unit,
            depth_scale: spec.source.depth_scale_mm,
            every: spec.source.every.unwrap_or(1),
            intrinsics: spec.source.intrinsics,
            labels: spec.labels == LabelSource::Source,
            recording: RecordingOptions {
                calibration: spec.source.calibration.as_ref().map(|path| path.display().to_string()),
                ..RecordingOptions::default()
            },
        }
    }
}
