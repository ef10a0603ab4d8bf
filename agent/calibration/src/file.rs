//! Captures as JSON, as a robot's program or a person writes them:
//!
//! ```json
//! {
//!   "camera": { "width": 1280, "height": 960, "fx": 1200, "fy": 1200, "cx": 639.5, "cy": 479.5,
//!               "distortion": { "model": "plumb_bob", "coefficients": [-0.1, 0.02, 0, 0, 0] } },
//!   "board": { "type": "charuco", "columns": 9, "rows": 7, "square_mm": 20, "marker_mm": 15, "dictionary": "DICT_4X4_50" },
//!   "working_distance_m": 0.5,
//!   "captures": [
//!     { "base_from_ee": { "translation": [0.4, 0.1, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
//!       "table_angle_deg": 0,
//!       "picture": "00.png" },
//!     { "base_from_ee": { "translation": [0.4, 0.2, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
//!       "corners": [ { "board_mm": [0, 0], "pixel": [412.31, 377.05] } ] },
//!     { "base_from_ee": { "translation": [0.4, 0.2, 0.6], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } },
//!       "camera_from_board": { "translation": [0, 0, 0.5], "rotation": { "x": 1, "y": 0, "z": 0, "w": 0 } } }
//!   ]
//! }
//! ```
//!
//! A capture has a picture of the board (then the file says the board and the camera), or the board's corners (then it says the
//! camera), or the board's pose. Poses are in metres. Pixels are those of the picture as it was taken. Who reads the file looks for
//! the board in the pictures and says what was seen ([`CaptureFile::see`]).

use crate::board::Board;
use crate::board_pose::BoardPoseError;
use crate::board_view::{BoardView, Corner, board_view};
use crate::capture::Capture;
use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion};
use semascan_model::record::PoseRecord;
use semascan_perception::view::{CameraModel, Distortion, Intrinsics};
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
    board: Option<Board>,
    working_distance_m: Option<f64>,
    temperature_c: Option<f64>,
    captures: Vec<CaptureRecord>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraRecord {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    distortion: Option<DistortionRecord>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct DistortionRecord {
    model: String,
    coefficients: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct CaptureRecord {
    base_from_ee: Option<PoseRecord>,
    table_angle_deg: Option<f64>,
    camera_from_board: Option<PoseRecord>,
    covariance: Option<[[f64; 6]; 6]>,
    corners: Option<Vec<Corner>>,
    picture: Option<String>,
    /// What was seen in the picture, or why nothing.
    #[serde(skip)]
    seen: Option<Result<Vec<Corner>, String>>,
}

/// Captures as a calibration takes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadCaptures {
    /// Those whose board was seen.
    pub captures: Vec<Capture>,
    /// Their places in the file, from 0 on.
    pub numbers: Vec<usize>,
    /// The boards as pictures show them; `None` where the file has the board's pose.
    pub views: Vec<Option<BoardView>>,
    /// Places of those whose picture shows no board: they are left out.
    pub unseen: Vec<usize>,
    /// What people should hear of all of them.
    pub said: Vec<String>,
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

    /// Temperature of the cell when the captures were taken, degrees Celsius, if the file says it.
    pub fn temperature(&self) -> Option<f64> {
        self.temperature_c
    }

    /// The board in the pictures, if the file says it.
    ///
    /// # Errors
    /// [`FileError`] naming the field.
    pub fn board(&self) -> Result<Option<&Board>, FileError> {
        if let Some((field, reason)) = self.board.as_ref().and_then(|board| board.check().err()) {
            return Err(FileError::Field { field: format!("board.{field}"), reason });
        }
        Ok(self.board.as_ref())
    }

    /// The camera, if the file says it.
    ///
    /// # Errors
    /// [`FileError`] naming the field.
    pub fn camera(&self) -> Result<Option<CameraModel>, FileError> {
        let Some(camera) = &self.camera else { return Ok(None) };
        let refused = |error: semascan_perception::view::UnusableCamera| FileError::Field {
            field: "camera".into(),
            reason: error.to_string(),
        };
        let CameraRecord { width, height, fx, fy, cx, cy, .. } = *camera;
        let distortion = match &camera.distortion {
            Some(given) => Distortion::named(&given.model, &given.coefficients).map_err(refused)?,
            None => Distortion::None,
        };
        CameraModel::new(Intrinsics { width, height, fx, fy, cx, cy }, distortion).map(Some).map_err(refused)
    }

    /// The pictures: each with its capture's place.
    pub fn pictures(&self) -> impl Iterator<Item = (usize, &str)> {
        let captures = self.captures.iter().enumerate();
        captures.filter_map(|(number, capture)| Some((number, capture.picture.as_deref()?)))
    }

    /// Says what was seen in the picture of a capture: the board's corners, or why none.
    pub fn see(&mut self, capture: usize, seen: Result<Vec<Corner>, String>) {
        if let Some(capture) = self.captures.get_mut(capture) {
            capture.seen = Some(seen);
        }
    }

    /// The captures, and what is to be said of them. One whose picture shows no board is left out, and said.
    ///
    /// # Errors
    /// [`FileError`] naming the field.
    pub fn captures(&self) -> Result<ReadCaptures, FileError> {
        self.board()?;
        let camera = self.camera()?;
        let mut read = ReadCaptures::default();
        for (number, record) in self.captures.iter().enumerate() {
            let field = |name: &str| format!("captures[{number}].{name}");
            let base_from_ee =
                record.base_from_ee.as_ref().map(|pose| isometry(pose, &field("base_from_ee"))).transpose()?;
            let (corners, is_picture) =
                match (&record.camera_from_board, &record.corners, &record.picture, &record.seen) {
                    (Some(_), None, None, _) => (None, false),
                    (None, Some(corners), None, _) => (Some(corners), false),
                    (None, None, Some(_), Some(Ok(corners))) => (Some(corners), true),
                    (None, None, Some(picture), Some(Err(reason))) => {
                        read.said.push(format!("capture {number}: {picture}: {reason}; it is left out"));
                        read.unseen.push(number);
                        continue;
                    }
                    (None, None, Some(_), None) => {
                        let reason = "nobody looked for the board in it".to_owned();
                        return Err(FileError::Field { field: field("picture"), reason });
                    }
                    (None, None, None, _) => {
                        let reason = "neither a picture of the board, nor its corners, nor its pose".to_owned();
                        return Err(FileError::Field { field: format!("captures[{number}]"), reason });
                    }
                    _ => {
                        let reason = "a picture of the board, its corners, its pose: one of them".to_owned();
                        return Err(FileError::Field { field: format!("captures[{number}]"), reason });
                    }
                };
            let view = match corners {
                Some(corners) => {
                    let camera = camera.as_ref().ok_or_else(|| FileError::Field {
                        field: "camera".into(),
                        reason: "pictures and corners say where a board is only together with the camera".into(),
                    })?;
                    match board_view(corners, camera) {
                        Ok(view) => Some(view),
                        Err(reason) if is_picture => {
                            read.said.push(format!("capture {number}: {reason}; it is left out"));
                            read.unseen.push(number);
                            continue;
                        }
                        Err(source) => return Err(FileError::Board { capture: number, source }),
                    }
                }
                None => None,
            };
            if let Some(view) = &view {
                let count = view.mistaken.len() + view.doubtful.len();
                if count > 0 {
                    read.said
                        .push(format!("capture {number}: {count} corners do not fit the others and were left out"));
                }
                if view.ambiguity > AMBIGUOUS {
                    read.said.push(format!("capture {number}: the board may as well be tilted the other way"));
                }
            }
            let (camera_from_board, covariance) = match (&view, &record.camera_from_board) {
                (Some(view), _) => (view.camera_from_board, Some(view.covariance)),
                (None, Some(pose)) => {
                    let rows = record.covariance.map(|rows| Matrix6::from_fn(|r, c| rows[r][c]));
                    (isometry(pose, &field("camera_from_board"))?, rows)
                }
                (None, None) => continue,
            };
            let table_angle = record.table_angle_deg.map(f64::to_radians);
            read.captures.push(Capture { base_from_ee, table_angle, camera_from_board, covariance });
            read.numbers.push(number);
            read.views.push(view);
        }
        Ok(read)
    }
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
        let captures = file.captures().expect("read").captures;
        assert_eq!(captures[0].table_angle, Some(std::f64::consts::FRAC_PI_2));
        assert!((captures[1].camera_from_board.translation.z - 0.5).abs() < 1e-6);
        assert!(captures[1].covariance.is_some() && captures[0].covariance.is_none());
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert!(refused(r#"{"captures":[{"colour":1}]}"#).starts_with("captures[0]"));
        assert!(refused(r#"{"captures":[{}]}"#).contains("captures[0]: neither"));
        let both = format!(r#"{{"captures":[{{"camera_from_board":{POSE},"corners":[]}}]}}"#);
        assert!(refused(&both).contains("captures[0]: a picture"));
        assert!(refused(r#"{"captures":[{"corners":[]}]}"#).starts_with("camera: pictures"));
        assert!(refused(r#"{"captures":[{"picture":"a.png"}]}"#).starts_with("captures[0].picture: nobody"));
        let board = r#"{"board":{"type":"chessboard","columns":8,"rows":6,"square_mm":20},"captures":[]}"#;
        assert!(refused(board).starts_with("board.rows: 8 x 6"));
        let lens = r#"{"camera":{"width":9,"height":9,"fx":9,"fy":9,"cx":4,"cy":4,
            "distortion":{"model":"mirror","coefficients":[1]}},"captures":[]}"#;
        assert!(refused(lens).contains("camera: the lens model `mirror`"));
        let long = POSE.replace(r#""w":0"#, r#""w":1"#);
        assert!(
            refused(&format!(r#"{{"captures":[{{"camera_from_board":{long}}}]}}"#)).contains("camera_from_board: its")
        );
    }

    #[test]
    fn a_picture_without_a_board_is_left_out_and_said() {
        let mut file = CaptureFile::parse(
            format!(r#"{{"captures":[{{"picture":"a.png"}},{{"camera_from_board":{POSE}}}]}}"#).as_bytes(),
        )
        .expect("JSON");
        assert_eq!(file.pictures().collect::<Vec<_>>(), [(0, "a.png")]);
        file.see(0, Err("no board".into()));
        let read = file.captures().expect("read");
        assert_eq!((read.numbers, read.said), (vec![1], vec!["capture 0: a.png: no board; it is left out".to_owned()]));
    }

    proptest! {
        #[test]
        fn no_content_panics(content in "\\PC{0,200}") {
            let _ = CaptureFile::parse(content.as_bytes()).and_then(|file| file.captures());
        }
    }
}
