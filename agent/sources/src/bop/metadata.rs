//! The JSON files of a BOP scene, read view by view so that one bad entry costs one view.

use super::sensor::Sensor;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use semascan_perception::view::Intrinsics;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// Farthest from a rotation that a recorded matrix may be before it is refused instead of rounded.
const ROTATION_TOLERANCE: f64 = 1e-2;

/// A component or a defect of the scene: entry i is class i + 1.
#[derive(Clone, Debug)]
pub(super) struct SceneClass {
    pub(super) id: u64,
    pub(super) name: String,
}

/// Metres of a translation of 1, as BOP has it.
pub(super) const MILLIMETRE: f64 = 1e-3;

/// One entry of `scene_camera.json`, in metres.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    /// Metres a depth unit.
    pub(super) depth_scale: f64,
    /// Whether the file says so; otherwise it is taken to be a millimetre.
    pub(super) has_depth_scale: bool,
    pub(super) table_from_camera: Option<Isometry3<f64>>,
}

impl Camera {
    pub(super) fn intrinsics(&self, width: u32, height: u32) -> Intrinsics {
        Intrinsics { width, height, fx: self.fx, fy: self.fy, cx: self.cx, cy: self.cy }
    }
}

/// One object of a view, as `scene_gt.json` lists it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ListedObject {
    /// Its number in the list, which its mask's name has too.
    pub(super) place: u32,
    /// Class: the place of its `obj_id` among the scene's, from 1.
    pub(super) class: u16,
    /// `cam_t_m2c`: where its own frame stands in the camera's, in the unit of the file.
    pub(super) in_camera: Option<Vector3<f64>>,
}

/// What the scene's JSON files say.
#[derive(Debug)]
pub(super) struct SceneMetadata {
    cameras_path: PathBuf,
    cameras: BTreeMap<u32, Value>,
    ground_truth_path: PathBuf,
    ground_truth: Option<BTreeMap<u32, Value>>,
    /// Objects of views, by their places in the list, that `scene_gt_info.json` says are hidden.
    hidden: HashSet<(u32, u32)>,
    pub(super) objects: Vec<SceneClass>,
    /// Whether the scene names the classes of its objects.
    pub(super) names_objects: bool,
    /// What the values of the pictures in `defects/` mean; empty if the scene records no defects.
    pub(super) defects: Vec<SceneClass>,
}

impl SceneMetadata {
    /// Reads the scene's files; those of the labels only if `labels` are wanted.
    pub(super) fn read(sensor: &Sensor, labels: bool) -> Result<Self, SourceError> {
        let cameras_path = sensor.json("scene_camera");
        let cameras = by_view(read_object(&cameras_path)?);
        let ground_truth_path = sensor.json("scene_gt");
        let optional = |path: &Path| {
            if labels && path.is_file() { read_object(path).map(Some) } else { Ok(None) }
        };
        let ground_truth = optional(&ground_truth_path)?.map(by_view);
        let info = optional(&sensor.json("scene_gt_info"))?.map(by_view).unwrap_or_default();
        let names = |file: &str| optional(&sensor.folder().join(file)).map(Option::unwrap_or_default);
        let named = names("objects.json")?;
        let objects = classes(ground_truth.as_ref(), &named);
        let names_objects = !named.is_empty();
        let defects = classes(None, &names("defects.json")?);
        let hidden = hidden_objects(&info);
        Ok(Self { cameras_path, cameras, ground_truth_path, ground_truth, hidden, objects, names_objects, defects })
    }

    /// The file that lists the objects.
    pub(super) fn ground_truth_path(&self) -> &Path {
        &self.ground_truth_path
    }

    /// The file that lists the cameras.
    pub(super) fn cameras_path(&self) -> &Path {
        &self.cameras_path
    }

    /// Whether the scene lists objects.
    pub(super) fn has_ground_truth(&self) -> bool {
        self.ground_truth.is_some()
    }

    /// Numbers of the views that have a camera entry.
    pub(super) fn camera_numbers(&self) -> impl Iterator<Item = u32> + '_ {
        self.cameras.keys().copied()
    }

    /// The camera of a view; `pose_unit` is the length in metres of a translation of 1.
    pub(super) fn camera(&self, number: u32, pose_unit: f64) -> Result<Camera, SourceError> {
        let path = &self.cameras_path;
        let entry = self.cameras.get(&number).ok_or_else(|| SourceError::Field {
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
        let has_depth_scale = entry.get("depth_scale").is_some();
        let table_from_camera = fields.pose(pose_unit)?;
        Ok(Camera {
            fx,
            fy,
            cx: k[2],
            cy: k[5],
            depth_scale: depth_scale * MILLIMETRE,
            has_depth_scale,
            table_from_camera,
        })
    }

    /// The objects of a view in the order of the list; `None` if the scene has no ground truth for it.
    pub(super) fn objects_of(&self, number: u32) -> Result<Option<Vec<ListedObject>>, SourceError> {
        let Some(entry) = self.ground_truth.as_ref().and_then(|gt| gt.get(&number)) else {
            return Ok(None);
        };
        let bad = |field: String, reason: &str| SourceError::Field {
            path: self.ground_truth_path.clone(),
            field,
            reason: reason.into(),
        };
        let list = entry.as_array().ok_or_else(|| bad(number.to_string(), "not a list"))?;
        let object = |(k, object): (usize, &Value)| {
            let field = || format!("{number}[{k}].obj_id");
            let id = object.get("obj_id").and_then(Value::as_u64).ok_or_else(|| bad(field(), "not an object id"))?;
            let at = self.objects.iter().position(|o| o.id == id).ok_or_else(|| bad(field(), "unknown object"))?;
            let class = u16::try_from(at + 1).map_err(|_| bad(field(), "more than 65 535 kinds of objects"))?;
            let position = object.get("cam_t_m2c").and_then(Value::as_array).filter(|t| t.len() == 3);
            let position = position.and_then(|t| {
                let t = Vector3::new(t[0].as_f64()?, t[1].as_f64()?, t[2].as_f64()?);
                t.iter().all(|c| c.is_finite()).then_some(t)
            });
            Ok(ListedObject { place: k as u32, class, in_camera: position })
        };
        list.iter().enumerate().map(object).collect::<Result<Vec<_>, _>>().map(Some)
    }

    /// Whether `scene_gt_info.json` says that no pixel shows the object at `place` of a view's list.
    pub(super) fn is_hidden(&self, number: u32, place: u32) -> bool {
        self.hidden.contains(&(number, place))
    }
}

/// The entries of a file by the numbers of their views, however many digits these have.
fn by_view(entries: Map<String, Value>) -> BTreeMap<u32, Value> {
    entries.into_iter().filter_map(|(key, value)| Some((key.trim().parse().ok()?, value))).collect()
}

/// Objects that are said to have no visible pixel.
fn hidden_objects(info: &BTreeMap<u32, Value>) -> HashSet<(u32, u32)> {
    let is_zero = |object: &Value, field: &str| object.get(field).and_then(Value::as_f64) == Some(0.0);
    let mut hidden = HashSet::new();
    for (view, list) in info {
        for (place, object) in (0..).zip(list.as_array().into_iter().flatten()) {
            if is_zero(object, "visib_fract") || is_zero(object, "px_count_visib") {
                hidden.insert((*view, place));
            }
        }
    }
    hidden
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

    /// `cam_R_w2c`, `cam_t_w2c` (in units of `unit` metres) turned round; `None` if the scene records no camera poses.
    fn pose(&self, unit: f64) -> Result<Option<Isometry3<f64>>, SourceError> {
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
        let translation = Translation3::from(Vector3::from(t) * unit);
        Ok(Some(Isometry3::from_parts(translation, rotation).inverse()))
    }
}

/// Every class that the ground truth or the name list mentions, by id.
fn classes(ground_truth: Option<&BTreeMap<u32, Value>>, names: &Map<String, Value>) -> Vec<SceneClass> {
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

/// The object that a JSON file holds, NaN and infinite numbers as null.
///
/// # Errors
/// [`SourceError`] naming the file.
pub(crate) fn read_object(path: &Path) -> Result<Map<String, Value>, SourceError> {
    let bytes = regular_file::read(path).map_err(|source| SourceError::Io { path: path.to_owned(), source })?;
    let bad = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let text = decode(&bytes).ok_or_else(|| bad("neither UTF-8 nor UTF-16 text".into()))?;
    // Python writes NaN and Infinity, which JSON forbids: as null they cost the view they stand in, not the scene.
    let value: Value = serde_json::from_str(&without_nan(&text)).map_err(|e| bad(e.to_string()))?;
    match value {
        Value::Object(map) => Ok(map),
        _ => Err(bad("not a JSON object".into())),
    }
}

/// Text in UTF-8, or in UTF-16 with a byte order mark; a mark at its head is no part of it.
fn decode(bytes: &[u8]) -> Option<String> {
    let utf16 = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
        String::from_utf16(&units).ok()
    };
    match bytes {
        [0xff, 0xfe, ..] => utf16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf16(u16::from_be_bytes),
        _ => {
            let text = std::str::from_utf8(bytes).ok()?;
            Some(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned())
        }
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

    #[test]
    fn marks_at_the_head_of_a_text_are_no_part_of_it() {
        let utf16: Vec<u8> = "\u{feff}{}".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for bytes in [&b"{}"[..], b"\xef\xbb\xbf{}", &utf16] {
            assert_eq!(decode(bytes).as_deref(), Some("{}"));
        }
        assert_eq!(decode(b"{\xff}"), None);
    }

    proptest! {
        #[test]
        fn valid_json_is_left_alone(words in prop::collection::vec("[a-zA-Z\\\\\"N]{0,8}", 0..6)) {
            let text = serde_json::to_string(&words).expect("strings serialise");
            prop_assert_eq!(without_nan(&text), text);
        }
    }
}
