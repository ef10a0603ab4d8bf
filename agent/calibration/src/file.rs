//! Captures as JSON, as a robot's program or a person writes them:
//!
//! ```json
//! {
//!   "camera": { "width": 1280, "height": 960, "fx": 1200, "fy": 1200, "cx": 639.5, "cy": 479.5 },
//!   "working_distance_m": 0.5,
//!   "captures": [
//!     { "base_from_ee": { "translation": [0.4, 0.1, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
//!       "table_angle_deg": 0,
//!       "corners": [ { "board_mm": [0, 0], "pixel": [412.31, 377.05] } ] },
//!     { "base_from_ee": { "translation": [0.4, 0.2, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
//!       "camera_from_board": { "translation": [0, 0, 0.5], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } } }
//!   ]
//! }
//! ```
//!
//! A capture has the corners of the board in its picture (then the file says the camera), or the board's pose. Poses are in metres.
//! Pixels are those of a picture without distortion.

use crate::board_pose::{BoardPoseError, board_pose};
use crate::capture::Capture;
use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion};
use semascan_model::record::PoseRecord;
use semascan_perception::view::Intrinsics;
use serde::Deserialize;

/// Deviation of a quaternion from a length of 1 that rounding explains.
const ROUNDING: f64 = 1e-3;
/// Error of a pose over that of its mirror image from which on either may be right.
const AMBIGUOUS: f64 = 0.8;

/// Captures, and the camera that took them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureFile {
    camera: Option<CameraRecord>,
    working_distance_m: Option<f64>,
    captures: Vec<CaptureRecord>,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraRecord {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct CaptureRecord {
    base_from_ee: Option<PoseRecord>,
    table_angle_deg: Option<f64>,
    camera_from_board: Option<PoseRecord>,
    covariance: Option<[[f64; 6]; 6]>,
    corners: Option<Vec<CornerRecord>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct CornerRecord {
    board_mm: [f64; 2],
    pixel: [f64; 2],
}

/// Why a file has no captures.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It is not the JSON that is read.
    #[error("{0}")]
    Json(#[from] serde_path_to_error::Error<serde_json::Error>),
    /// A field is none.
    #[error("{field}: {reason}")]
    Field {
        /// Its path.
        field: String,
        /// Why.
        reason: String,
    },
    /// The corners of a capture show no board.
    #[error("captures[{capture}].corners: {source}")]
    Board {
        /// Its place, from 0 on.
        capture: usize,
        /// Why.
        source: BoardPoseError,
    },
}

impl CaptureFile {
    /// Reads a file's content.
    ///
    /// # Errors
    /// [`FileError::Json`] naming the place.
    pub fn parse(content: &[u8]) -> Result<Self, FileError> {
        Ok(serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_slice(content))?)
    }

    /// From camera to part, metres, if the file says it.
    pub fn working_distance(&self) -> Option<f64> {
        self.working_distance_m
    }

    /// The captures, and what is to be said of them.
    ///
    /// # Errors
    /// [`FileError`] naming the field.
    pub fn captures(&self) -> Result<(Vec<Capture>, Vec<String>), FileError> {
        let camera = self.camera.map(intrinsics).transpose()?;
        let (mut captures, mut said) = (Vec::new(), Vec::new());
        for (number, record) in self.captures.iter().enumerate() {
            let field = |name: &str| format!("captures[{number}].{name}");
            let base_from_ee =
                record.base_from_ee.as_ref().map(|pose| isometry(pose, &field("base_from_ee"))).transpose()?;
            let (camera_from_board, covariance) = match (&record.camera_from_board, &record.corners) {
                (Some(pose), None) => {
                    let rows = record.covariance.map(|rows| Matrix6::from_fn(|r, c| rows[r][c]));
                    (isometry(pose, &field("camera_from_board"))?, rows)
                }
                (None, Some(corners)) => {
                    let camera = camera.as_ref().ok_or_else(|| FileError::Field {
                        field: "camera".into(),
                        reason: "corners say where a board is only together with the camera".into(),
                    })?;
                    let on_board: Vec<[f64; 2]> = corners.iter().map(|c| c.board_mm.map(|mm| mm * 1e-3)).collect();
                    let pixels: Vec<[f64; 2]> = corners.iter().map(|c| c.pixel).collect();
                    let found = board_pose(&on_board, &pixels, camera)
                        .map_err(|source| FileError::Board { capture: number, source })?;
                    if found.mistaken > 0 {
                        said.push(format!("capture {number}: {} corners were mistaken and left out", found.mistaken));
                    }
                    if found.ambiguity > AMBIGUOUS {
                        said.push(format!("capture {number}: the board may as well be tilted the other way"));
                    }
                    (found.camera_from_board, Some(found.covariance))
                }
                (Some(_), Some(_)) => {
                    let reason = "the board's pose and its corners: one of them".to_owned();
                    return Err(FileError::Field { field: field("corners"), reason });
                }
                (None, None) => {
                    let reason = "neither the board's pose nor its corners".to_owned();
                    return Err(FileError::Field { field: format!("captures[{number}]"), reason });
                }
            };
            let table_angle = record.table_angle_deg.map(f64::to_radians);
            captures.push(Capture { base_from_ee, table_angle, camera_from_board, covariance });
        }
        Ok((captures, said))
    }
}

fn intrinsics(camera: CameraRecord) -> Result<Intrinsics, FileError> {
    let CameraRecord { width, height, fx, fy, cx, cy } = camera;
    let is_camera = width > 0 && height > 0 && fx > 0.0 && fy > 0.0 && [fx, fy, cx, cy].iter().all(|c| c.is_finite());
    if is_camera {
        return Ok(Intrinsics { width, height, fx, fy, cx, cy });
    }
    Err(FileError::Field {
        field: "camera".into(),
        reason: "is no camera: sizes and focal lengths are positive".into(),
    })
}

fn isometry(pose: &PoseRecord, field: &str) -> Result<Isometry3<f64>, FileError> {
    let q = Quaternion::new(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
    let [x, y, z] = pose.translation;
    if (q.norm() - 1.0).abs() > ROUNDING || ![x, y, z].iter().all(|c| c.is_finite()) {
        let reason = format!("its quaternion has length {}, its translation is {:?}", q.norm(), pose.translation);
        return Err(FileError::Field { field: field.to_owned(), reason });
    }
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(q)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const POSE: &str = r#"{"translation":[0,0,0.5],"rotation":{"x":1,"y":0,"z":0,"w":0}}"#;

    fn refused(content: &str) -> String {
        match CaptureFile::parse(content.as_bytes()).and_then(|file| file.captures()) {
            Ok(read) => panic!("{read:?}"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn poses_and_corners_are_read() {
        let corners: Vec<String> = crate::simulated::Simulated::corners()
            .iter()
            .map(|[x, y]| {
                let [u, v] = [640.0 + 2000.0 * x, 300.0 + 2000.0 * y];
                format!(r#"{{"board_mm":[{},{}],"pixel":[{u},{v}]}}"#, x * 1e3, y * 1e3)
            })
            .collect();
        let content = format!(
            r#"{{"camera":{{"width":1280,"height":960,"fx":1000,"fy":1000,"cx":640,"cy":480}},"working_distance_m":0.4,
            "captures":[{{"table_angle_deg":90,"camera_from_board":{POSE}}},{{"corners":[{}]}}]}}"#,
            corners.join(",")
        );
        let file = CaptureFile::parse(content.as_bytes()).expect("JSON");
        assert_eq!(file.working_distance(), Some(0.4));
        let (captures, _) = file.captures().expect("read");
        assert_eq!(captures[0].table_angle, Some(std::f64::consts::FRAC_PI_2));
        assert!((captures[1].camera_from_board.translation.z - 0.5).abs() < 1e-6);
        assert!(captures[1].covariance.is_some() && captures[0].covariance.is_none());
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert!(refused(r#"{"captures":[{"colour":1}]}"#).starts_with("captures[0]"));
        assert!(refused(r#"{"captures":[{}]}"#).contains("captures[0]: neither"));
        assert!(
            refused(&format!(r#"{{"captures":[{{"camera_from_board":{POSE},"corners":[]}}]}}"#))
                .contains("corners: the")
        );
        assert!(refused(r#"{"captures":[{"corners":[]}]}"#).starts_with("camera: corners"));
        let long = POSE.replace(r#""w":0"#, r#""w":1"#);
        assert!(
            refused(&format!(r#"{{"captures":[{{"camera_from_board":{long}}}]}}"#)).contains("camera_from_board: its")
        );
    }

    proptest! {
        #[test]
        fn no_content_panics(content in "\\PC{0,200}") {
            let _ = CaptureFile::parse(content.as_bytes()).and_then(|file| file.captures());
        }
    }
}
