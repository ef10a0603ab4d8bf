//! The cameras of a recording: what its files, the person or the layout say of them, and how its pictures become those of one
//! pinhole.
//!
//! A file has Open3D's form, `{"width", "height", "intrinsic_matrix"}` with the matrix by columns (by rows is told apart by
//! its zeros). Beside that a lens may stand, `"distortion_model"` and `"distortion_coefficients"` as ROS has them. Where depth
//! was taken by another camera than colour, `depth_intrinsic.json` describes that one, with `"color_from_depth"`, a 4 x 4
//! matrix by columns in metres.

use super::text::{Rows, numbers, read_text};
use super::{Frame, picture_size, pose_of_matrix};
use crate::OpenOptions;
use crate::bop::metadata::read_object;
use crate::camera::DepthCamera;
use crate::camera_model::{CameraModel, DepthRegistration, Distortion, Rectification, UnusableCamera};
use image::RgbImage;
use nalgebra::Matrix4;
use semascan_inspection::source::SourceError;
use semascan_perception::view::{DepthImage, Intrinsics, SizeMismatch};
use serde_json::{Map, Value};
use std::path::Path;

/// The file that describes a depth camera of its own.
const DEPTH_CAMERA: &str = "depth_intrinsic.json";

/// The cameras of a recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FolderCamera {
    color: CameraModel,
    /// The depth camera; `None` where depth has the colour camera's pixels.
    depth: Option<DepthCamera>,
    /// Where the numbers are from.
    origin: String,
    /// What a file says of the numbers of the depth pictures: of how many a metre is.
    pub(crate) depth_per_metre: Option<f64>,
}

/// The pinhole of a camera with known numbers.
pub(crate) fn pinhole((width, height): (u32, u32), [fx, fy, cx, cy]: [f64; 4]) -> Intrinsics {
    Intrinsics { width, height, fx, fy, cx, cy }
}

impl FolderCamera {
    /// The camera of the recording in `folder`: as the person says, else by the first of `files` that is there, else as the
    /// layout has it, which is `known`, with where that is from.
    ///
    /// # Errors
    /// [`SourceError`] naming the file that cannot be used, or the folder if nothing says what camera it was.
    pub(crate) fn find(
        folder: &Path,
        files: &[&str],
        frames: &[Frame],
        options: &OpenOptions,
        known: Option<(Intrinsics, Distortion, &str)>,
    ) -> Result<Self, SourceError> {
        let refuse = |reason: String| SourceError::Format { path: folder.to_owned(), reason };
        let unusable = |error: UnusableCamera| refuse(format!("its camera: {error}"));
        if let Some(numbers) = options.intrinsics {
            let size = picture_size(frames).ok_or_else(|| refuse("no colour picture can be read".into()))?;
            let color = CameraModel::new(pinhole(size, numbers), Distortion::None).map_err(unusable)?;
            return Ok(Self { color, depth: None, origin: "as said".into(), depth_per_metre: None });
        }
        for file in files {
            let path = folder.join(file);
            if !path.is_file() {
                continue;
            }
            let (color, depth_per_metre) = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt")) {
                let size = picture_size(frames).ok_or_else(|| refuse("no colour picture can be read".into()))?;
                (from_text(&path, size)?, None)
            } else {
                let object = read_object(&path)?;
                (camera_of(&path, &object)?, object.get("depth_scale").and_then(Value::as_f64))
            };
            let depth_per_metre = depth_per_metre.filter(|scale| scale.is_finite() && *scale > 0.0);
            let depth = depth_camera(folder)?;
            return Ok(Self { color, depth, origin: path.display().to_string(), depth_per_metre });
        }
        let Some((intrinsics, distortion, origin)) = known else {
            return Err(refuse(format!(
                "nothing says what camera took it: say --intrinsics FX,FY,CX,CY (pixels), or put them into {} \
                 (\"width\", \"height\", \"intrinsic_matrix\" by columns)",
                files.first().copied().unwrap_or("camera_intrinsic.json")
            )));
        };
        let color = CameraModel::new(intrinsics, distortion).map_err(unusable)?;
        Ok(Self { color, depth: depth_camera(folder)?, origin: origin.to_owned(), depth_per_metre: None })
    }

    /// The lenses, of depth where that has a camera of its own.
    pub(crate) fn into_models(self) -> (CameraModel, Option<DepthCamera>) {
        (self.color, self.depth)
    }

    /// Where the numbers are from.
    pub(crate) fn origin(&self) -> &str {
        &self.origin
    }

    /// How its pictures become those of one pinhole.
    ///
    /// # Errors
    /// [`SourceError`] naming the folder `path` if the two cameras do not go together.
    pub(super) fn alignment(&self, path: &Path) -> Result<Alignment, SourceError> {
        let intrinsics = *self.color.intrinsics();
        let lens = Rectification::of(&self.color);
        let mut depth = None;
        if let Some(camera) = &self.depth {
            let pinhole = *camera.model.intrinsics();
            let registration = DepthRegistration::new(pinhole, intrinsics, camera.color_from_depth)
                .map_err(|error| SourceError::Format { path: path.join(DEPTH_CAMERA), reason: error.to_string() })?;
            depth = Some(DepthWay { lens: Rectification::of(&camera.model), registration });
        }
        Ok(Alignment { intrinsics, lens, depth })
    }
}

/// The depth camera, where the folder describes one.
fn depth_camera(folder: &Path) -> Result<Option<DepthCamera>, SourceError> {
    let path = folder.join(DEPTH_CAMERA);
    if !path.is_file() {
        return Ok(None);
    }
    let object = read_object(&path)?;
    let model = camera_of(&path, &object)?;
    let bad = |reason: String| SourceError::Field { path: path.clone(), field: "color_from_depth".into(), reason };
    let values = list(&object, "color_from_depth").ok_or_else(|| bad("not a list of numbers".into()))?;
    if values.len() != 16 {
        return Err(bad(format!("{} numbers in place of 16", values.len())));
    }
    let pose = pose_of_matrix(&Matrix4::from_column_slice(&values)).map_err(bad)?;
    Ok(Some(DepthCamera { model, color_from_depth: pose.ok_or_else(|| bad("not finite".into()))? }))
}

/// The camera that a JSON object describes, itself or in its field `intrinsic`.
fn camera_of(path: &Path, object: &Map<String, Value>) -> Result<CameraModel, SourceError> {
    let object = object.get("intrinsic").and_then(Value::as_object).unwrap_or(object);
    let bad = |field: &str, reason: String| SourceError::Field { path: path.to_owned(), field: field.into(), reason };
    let pixels = |field: &str| {
        let value =
            object.get(field).and_then(Value::as_f64).filter(|n| n.fract() == 0.0 && (1.0..=65_535.0).contains(n));
        value.map(|n| n as u32).ok_or_else(|| bad(field, "not a number of pixels".into()))
    };
    let size = (pixels("width")?, pixels("height")?);
    let matrix =
        list(object, "intrinsic_matrix").ok_or_else(|| bad("intrinsic_matrix", "not a list of numbers".into()))?;
    let numbers = of_matrix(&matrix).map_err(|reason| bad("intrinsic_matrix", reason))?;
    let model = object.get("distortion_model").and_then(Value::as_str).unwrap_or_default();
    let coefficients = match object.get("distortion_coefficients") {
        None => Vec::new(),
        Some(_) => list(object, "distortion_coefficients")
            .ok_or_else(|| bad("distortion_coefficients", "not a list of numbers".into()))?,
    };
    let distortion =
        Distortion::named(model, &coefficients).map_err(|error| bad("distortion_model", error.to_string()))?;
    CameraModel::new(pinhole(size, numbers), distortion).map_err(|error| bad("intrinsic_matrix", error.to_string()))
}

/// The numbers of a list, or of a list of lists row by row.
fn list(object: &Map<String, Value>, field: &str) -> Option<Vec<f64>> {
    let outer = object.get(field)?.as_array().filter(|list| list.len() <= 64)?;
    if outer.iter().all(Value::is_array) {
        return outer.iter().flat_map(|row| row.as_array().into_iter().flatten()).map(Value::as_f64).collect();
    }
    outer.iter().map(Value::as_f64).collect()
}

/// A text file with a matrix of three rows.
fn from_text(path: &Path, size: (u32, u32)) -> Result<CameraModel, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let text = read_text(path)?;
    let mut matrix = Vec::new();
    for (line, row) in Rows::of(&text).take(3) {
        matrix.extend(numbers::<3>(row).map_err(|reason| refuse(format!("line {line}: {reason}")))?);
    }
    let numbers = of_matrix(&matrix).map_err(refuse)?;
    CameraModel::new(pinhole(size, numbers), Distortion::None).map_err(|error| refuse(error.to_string()))
}

/// Focal lengths and principal point of a matrix by columns or by rows.
fn of_matrix(matrix: &[f64]) -> Result<[f64; 4], String> {
    let &[fx, b, c, d, fy, f, g, h, one] = matrix else {
        return Err(format!("{} numbers in place of 9", matrix.len()));
    };
    let skew = [b, d].iter().any(|s| s.abs() > 1e-6);
    if skew || (one - 1.0).abs() > 1e-6 {
        return Err("not the matrix of a pinhole camera without skew".into());
    }
    match ([c, f] == [0.0; 2], [g, h] == [0.0; 2]) {
        (true, _) => Ok([fx, fy, g, h]),
        (false, true) => Ok([fx, fy, c, f]),
        (false, false) => Err("not the matrix of a pinhole camera".into()),
    }
}

/// How pictures of a recording become those of one pinhole.
#[derive(Clone, Debug)]
pub(super) struct Alignment {
    intrinsics: Intrinsics,
    /// The lens of the colour camera.
    lens: Option<Rectification>,
    /// `None` where depth has the colour camera's pixels.
    depth: Option<DepthWay>,
}

/// How depth of a camera of its own comes to the pixels of the colour picture.
#[derive(Clone, Debug)]
struct DepthWay {
    /// The lens of the depth camera.
    lens: Option<Rectification>,
    registration: DepthRegistration,
}

impl Alignment {
    /// The camera of the views.
    pub(super) fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// A colour picture as the pinhole would have taken it.
    pub(super) fn color(&self, picture: RgbImage) -> Result<RgbImage, SizeMismatch> {
        let Intrinsics { width, height, .. } = self.intrinsics;
        if picture.dimensions() != (width, height) {
            let found = picture.pixels().len();
            return Err(SizeMismatch { part: "colour picture", found, width, height });
        }
        match &self.lens {
            Some(lens) => lens.color(&picture),
            None => Ok(picture),
        }
    }

    /// A depth picture as the pinhole would have measured it.
    pub(super) fn depth(&self, depth: DepthImage) -> Result<DepthImage, SizeMismatch> {
        if let Some(DepthWay { lens, registration }) = &self.depth {
            let depth = match lens {
                Some(lens) => lens.depth(&depth)?,
                None => depth,
            };
            return registration.register(&depth);
        }
        let Intrinsics { width, height, .. } = self.intrinsics;
        if (depth.width, depth.height) != (width, height) {
            return Err(SizeMismatch { part: "depth picture", found: depth.metres.len(), width, height });
        }
        match &self.lens {
            Some(lens) => lens.depth(&depth),
            None => Ok(depth),
        }
    }

    /// What to do about pictures of another size.
    pub(super) fn hint(&self) -> String {
        match self.depth {
            None => format!(
                "intrinsics are those of another picture, or depth is not aligned to colour; a depth camera of its own is \
                 described in {DEPTH_CAMERA}"
            ),
            Some(_) => format!("the cameras' files and {DEPTH_CAMERA} describe other pictures"),
        }
    }

    /// The camera, for people.
    pub(super) fn describe(&self, origin: &str) -> String {
        let Intrinsics { width, height, fx, fy, cx, cy } = self.intrinsics;
        let mut text = format!("{fx:.2},{fy:.2},{cx:.2},{cy:.2} for {width}x{height} pixels ({origin})");
        if let Some(lens) = &self.lens {
            text += &format!("; pictures are undistorted, {:.1} % of their pixels see nothing", 100.0 * lens.unseen());
        }
        if self.depth.is_some() {
            text += "; depth is registered to colour";
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_matrix_by_columns_or_by_rows_is_a_pinhole() {
        assert_eq!(of_matrix(&[5.0, 0.0, 0.0, 0.0, 6.0, 0.0, 3.0, 2.0, 1.0]), Ok([5.0, 6.0, 3.0, 2.0]));
        assert_eq!(of_matrix(&[5.0, 0.0, 3.0, 0.0, 6.0, 2.0, 0.0, 0.0, 1.0]), Ok([5.0, 6.0, 3.0, 2.0]));
        for wrong in [&[5.0; 9][..], &[1.0; 4], &[5.0, 0.0, 3.0, 0.0, 6.0, 2.0, 1.0, 0.0, 1.0]] {
            assert!(of_matrix(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn files_of_cameras_are_read_and_what_is_wrong_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("camera_intrinsic.json");
        let camera = |value: Value| {
            std::fs::write(&path, value.to_string()).expect("written");
            FolderCamera::find(folder.path(), &["camera_intrinsic.json"], &[], &OpenOptions::default(), None)
        };
        let matrix = json!([5.0, 0, 0, 0, 6.0, 0, 3.0, 2.0, 1]);
        let plain = camera(json!({ "width": 8, "height": 6, "intrinsic_matrix": matrix, "depth_scale": 4000.0 }));
        let plain = plain.expect("a camera");
        assert_eq!(*plain.color.intrinsics(), pinhole((8, 6), [5.0, 6.0, 3.0, 2.0]));
        assert_eq!(plain.depth_per_metre, Some(4000.0));
        let lens = camera(json!({ "intrinsic": {
            "width": 8, "height": 6, "intrinsic_matrix": [[5.0, 0, 3.0], [0, 6.0, 2.0], [0, 0, 1]],
            "distortion_model": "plumb_bob", "distortion_coefficients": [0.1, 0, 0, 0, 0] } }));
        assert!(matches!(lens.expect("a camera").color.distortion(), Distortion::BrownConrady { .. }));
        for (value, named) in [
            (json!({ "width": -1, "height": 6, "intrinsic_matrix": matrix }), "width"),
            (json!({ "width": 8, "height": 6, "intrinsic_matrix": [1, 2] }), "2 numbers"),
            (json!({ "width": 8, "height": 6, "intrinsic_matrix": "K" }), "intrinsic_matrix"),
            (
                json!({ "width": 8, "height": 6, "intrinsic_matrix": matrix, "distortion_model": "pyramid",
                     "distortion_coefficients": [1] }),
                "pyramid",
            ),
            (json!([1, 2]), "not a JSON object"),
        ] {
            let error = camera(value).expect_err("no camera").to_string();
            assert!(error.contains(named) && error.contains("camera_intrinsic.json"), "{named}: {error}");
        }
        std::fs::remove_file(&path).expect("removed");
        let none = FolderCamera::find(folder.path(), &["camera_intrinsic.json"], &[], &OpenOptions::default(), None);
        let error = none.expect_err("no camera").to_string();
        assert!(error.contains("--intrinsics") && error.contains("camera_intrinsic.json"), "{error}");
    }
}
