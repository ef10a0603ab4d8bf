//! The JSON files of a BOP scene, read view by view so that one bad entry costs one view.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use semascan_inspection::source::SourceError;
use semascan_perception::view::Intrinsics;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Farthest from a rotation that a recorded matrix may be before it is refused instead of rounded.
const ROTATION_TOLERANCE: f64 = 1e-2;

/// A component or a defect of the scene: entry i is class i + 1.
#[derive(Clone, Debug)]
pub(super) struct SceneClass {
    pub(super) id: u64,
    pub(super) name: String,
}

/// One entry of `scene_camera.json`, in metres.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    /// Metres a depth unit.
    pub(super) depth_scale: f64,
    pub(super) table_from_camera: Option<Isometry3<f64>>,
}

impl Camera {
    pub(super) fn intrinsics(&self, width: u32, height: u32) -> Intrinsics {
        Intrinsics { width, height, fx: self.fx, fy: self.fy, cx: self.cx, cy: self.cy }
    }
}

/// What the scene's JSON files say.
#[derive(Debug)]
pub(super) struct SceneMetadata {
    cameras_path: PathBuf,
    cameras: Map<String, Value>,
    ground_truth_path: PathBuf,
    ground_truth: Option<Map<String, Value>>,
    pub(super) objects: Vec<SceneClass>,
    /// What the values of the pictures in `defects/` mean; empty if the scene records no defects.
    pub(super) defects: Vec<SceneClass>,
}

impl SceneMetadata {
    pub(super) fn read(folder: &Path) -> Result<Self, SourceError> {
        let cameras_path = folder.join("scene_camera.json");
        let cameras = read_object(&cameras_path)?;
        let ground_truth_path = folder.join("scene_gt.json");
        let ground_truth = ground_truth_path.is_file().then(|| read_object(&ground_truth_path)).transpose()?;
        let names = |file: &str| {
            let path = folder.join(file);
            if path.is_file() { read_object(&path) } else { Ok(Map::new()) }
        };
        let objects = classes(ground_truth.as_ref(), &names("objects.json")?);
        let defects = classes(None, &names("defects.json")?);
        Ok(Self { cameras_path, cameras, ground_truth_path, ground_truth, objects, defects })
    }

    /// Numbers of the views that have a camera entry.
    pub(super) fn camera_numbers(&self) -> impl Iterator<Item = u32> + '_ {
        self.cameras.keys().filter_map(|k| k.parse().ok())
    }

    pub(super) fn camera(&self, number: u32) -> Result<Camera, SourceError> {
        let path = &self.cameras_path;
        let entry = self.cameras.get(&number.to_string()).ok_or_else(|| SourceError::Field {
            path: path.clone(),
            field: number.to_string(),
            reason: "no camera entry for this view".into(),
        })?;
        let fields = Fields { path, entry, number };
        let k = fields.numbers::<9>("cam_K")?.ok_or_else(|| fields.error("cam_K", "missing"))?;
        let positive = |i: usize| {
            if k[i] > 0.0 { Ok(k[i]) } else { Err(fields.error(&format!("cam_K[{i}]"), "not a focal length")) }
        };
        let (fx, fy) = (positive(0)?, positive(4)?);
        let depth_scale = match entry.get("depth_scale") {
            None => 1.0,
            Some(v) => v.as_f64().filter(|s| *s > 0.0).ok_or_else(|| fields.error("depth_scale", "not positive"))?,
        };
        let table_from_camera = fields.pose()?;
        Ok(Camera { fx, fy, cx: k[2], cy: k[5], depth_scale: depth_scale * 1e-3, table_from_camera })
    }

    /// Classes of the objects of a view in mask order; `None` if the scene has no ground truth for it.
    pub(super) fn visible_objects(&self, number: u32) -> Result<Option<Vec<u16>>, SourceError> {
        let Some(entry) = self.ground_truth.as_ref().and_then(|gt| gt.get(&number.to_string())) else {
            return Ok(None);
        };
        let bad = |field: String, reason: &str| SourceError::Field {
            path: self.ground_truth_path.clone(),
            field,
            reason: reason.into(),
        };
        let list = entry.as_array().ok_or_else(|| bad(number.to_string(), "not a list"))?;
        let class = |(k, object): (usize, &Value)| {
            let field = || format!("{number}[{k}].obj_id");
            let id = object.get("obj_id").and_then(Value::as_u64).ok_or_else(|| bad(field(), "not an object id"))?;
            let at = self.objects.iter().position(|o| o.id == id).ok_or_else(|| bad(field(), "unknown object"))?;
            Ok(at as u16 + 1)
        };
        list.iter().enumerate().map(class).collect::<Result<Vec<_>, _>>().map(Some)
    }
}

/// Typed access to one camera entry; errors name file, view and field.
struct Fields<'a> {
    path: &'a Path,
    entry: &'a Value,
    number: u32,
}

impl Fields<'_> {
    fn error(&self, field: &str, reason: &str) -> SourceError {
        SourceError::Field {
            path: self.path.to_owned(),
            field: format!("{}.{field}", self.number),
            reason: reason.into(),
        }
    }

    fn numbers<const N: usize>(&self, field: &str) -> Result<Option<[f64; N]>, SourceError> {
        let Some(value) = self.entry.get(field) else { return Ok(None) };
        let list = value.as_array().ok_or_else(|| self.error(field, "not a list"))?;
        if list.len() != N {
            return Err(self.error(field, &format!("{} values in place of {N}", list.len())));
        }
        let mut out = [0.0; N];
        for (i, (slot, v)) in out.iter_mut().zip(list).enumerate() {
            let finite = v.as_f64().filter(|x| x.is_finite());
            *slot = finite.ok_or_else(|| self.error(&format!("{field}[{i}]"), "not a finite number"))?;
        }
        Ok(Some(out))
    }

    /// `cam_R_w2c`, `cam_t_w2c` (millimetres) turned round; `None` if the scene records no camera poses.
    fn pose(&self) -> Result<Option<Isometry3<f64>>, SourceError> {
        let (rotation, translation) = (self.numbers::<9>("cam_R_w2c")?, self.numbers::<3>("cam_t_w2c")?);
        let (r, t) = match (rotation, translation) {
            (None, None) => return Ok(None),
            (Some(r), Some(t)) => (r, t),
            (None, _) => return Err(self.error("cam_R_w2c", "missing")),
            (_, None) => return Err(self.error("cam_t_w2c", "missing")),
        };
        let matrix = Matrix3::from_row_slice(&r);
        let deviation = (matrix * matrix.transpose() - Matrix3::identity()).norm();
        if deviation > ROTATION_TOLERANCE || matrix.determinant() < 0.0 {
            return Err(self.error("cam_R_w2c", &format!("not a rotation (off by {deviation:.3})")));
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
        let translation = Translation3::from(Vector3::from(t) * 1e-3);
        Ok(Some(Isometry3::from_parts(translation, rotation).inverse()))
    }
}

/// Every class that the ground truth or the name list mentions, by id.
fn classes(ground_truth: Option<&Map<String, Value>>, names: &Map<String, Value>) -> Vec<SceneClass> {
    let mut found: BTreeMap<u64, String> = BTreeMap::new();
    let listed = ground_truth.into_iter().flat_map(|gt| gt.values()).filter_map(Value::as_array).flatten();
    for id in listed.filter_map(|o| o.get("obj_id")?.as_u64()) {
        found.entry(id).or_insert_with(|| format!("object {id}"));
    }
    for (id, name) in names {
        if let (Ok(id), Some(name)) = (id.parse(), name.as_str()) {
            found.insert(id, name.replace('_', " "));
        }
    }
    found.into_iter().map(|(id, name)| SceneClass { id, name }).collect()
}

fn read_object(path: &Path) -> Result<Map<String, Value>, SourceError> {
    let text = fs::read_to_string(path).map_err(|source| SourceError::Io { path: path.to_owned(), source })?;
    let bad = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    // Python writes NaN and Infinity, which JSON forbids: as null they cost the view they stand in, not the scene.
    let value: Value = serde_json::from_str(&without_nan(&text)).map_err(|e| bad(e.to_string()))?;
    match value {
        Value::Object(map) => Ok(map),
        _ => Err(bad("not a JSON object".into())),
    }
}

/// Replaces the bare words NaN, Infinity and -Infinity, outside of strings, by null.
fn without_nan(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let (mut rest, mut quoted) = (text, false);
    while let Some(c) = rest.chars().next() {
        let word = ["NaN", "-Infinity", "Infinity"].into_iter().find(|w| !quoted && rest.starts_with(w));
        if let Some(word) = word {
            out.push_str("null");
            rest = &rest[word.len()..];
            continue;
        }
        let escaped = quoted && c == '\\';
        let len = if escaped { 1 + rest.chars().nth(1).map_or(0, char::len_utf8) } else { c.len_utf8() };
        quoted ^= c == '"';
        out.push_str(&rest[..len]);
        rest = &rest[len..];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nan_becomes_null_outside_of_strings_only() {
        assert_eq!(
            without_nan(r#"{"NaN": [NaN, -Infinity, 1], "a\"NaN": 2}"#),
            r#"{"NaN": [null, null, 1], "a\"NaN": 2}"#
        );
    }

    proptest! {
        #[test]
        fn valid_json_is_left_alone(words in prop::collection::vec("[a-zA-Z\\\\\"N]{0,8}", 0..6)) {
            let text = serde_json::to_string(&words).expect("strings serialise");
            prop_assert_eq!(without_nan(&text), text);
        }
    }
}
