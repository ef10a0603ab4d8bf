//! Cameras at this machine, by their makers' libraries: what such a camera is asked for, and the source of views that it becomes.
//!
//! A camera is one type that implements [`Camera`]: it gives a pair of pictures with the numbers of its lenses when it is asked.
//! [`CameraSource`] does everything else in the same way for all of them: it asks for a capture when the inspection has room for a
//! view, so that no view is older than the question; it undistorts lenses and registers depth to colour; it connects again when
//! the camera is lost, counts what happened, and ends with the number of views or when nothing comes any more.
//!
//! Cameras whose library not everybody has are crates of their own (`agent/realsense`, `agent/genicam`), and so is one by whoever
//! makes cameras: `examples/vendor_camera.rs` is all that it takes.

mod source;
#[cfg(test)]
mod tests;
mod timing;

pub use source::CameraSource;
pub use timing::{TIMING_KEYS, Timing};

use crate::OpenOptions;
use crate::camera_model::CameraModel;
use crate::rgbd_folder::FolderCamera;
use image::RgbImage;
use nalgebra::Isometry3;
use semascan_inspection::source::SourceError;
use semascan_perception::view::DepthImage;
use std::path::Path;
use std::time::Duration;

/// A camera that measures depth beside colours.
pub trait Camera: Send {
    /// What it is and how it is set, for people and the record: `("camera", "Acme 3D, serial 17")`.
    fn description(&self) -> Vec<(String, String)>;

    /// The next capture of which nothing was exposed before the call; `None` if there is none within `patience`: then it is
    /// asked again. A camera that is triggered by software is triggered by the call.
    ///
    /// # Errors
    /// [`CameraError`]: that this capture cannot be used, or that the camera is gone.
    fn capture(&mut self, patience: Duration) -> Result<Option<Capture>, CameraError>;
}

/// Pictures that were taken together.
#[derive(Clone, Debug)]
pub struct Capture {
    /// When it was taken, seconds on the camera's clock.
    pub stamp: Option<f64>,
    /// The colours as the lens shows them.
    pub color: RgbImage,
    /// The camera of the colours.
    pub color_camera: CameraModel,
    /// Distance along the optical axis of the depth camera, metres; 0 where nothing was measured.
    pub depth: DepthImage,
    /// The camera of the depth; `None` where depth has the pixels of the colour picture.
    pub depth_camera: Option<DepthCamera>,
}

/// A depth camera beside the colour camera.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCamera {
    /// Its lens.
    pub model: CameraModel,
    /// Brings points of its frame into that of the colour camera, metres.
    pub color_from_depth: Isometry3<f64>,
}

/// The lenses that the files of `folder` describe as in a recording of Open3D's layout: `camera_intrinsic.json`, and
/// `depth_intrinsic.json` with `color_from_depth` where depth has a camera of its own.
///
/// # Errors
/// [`SourceError`] naming the file or field at fault.
pub fn read_calibration(folder: &Path) -> Result<(CameraModel, Option<DepthCamera>), SourceError> {
    let files = ["camera_intrinsic.json"];
    let found = FolderCamera::find(folder, &files, &[], &OpenOptions::default(), None)?;
    Ok(found.into_models())
}

/// Why there is no capture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CameraError {
    /// This one cannot be used; the next one may.
    #[error("{0}")]
    Unusable(String),
    /// The camera is gone: it is connected again.
    #[error("the camera is lost: {0}")]
    Lost(String),
}
