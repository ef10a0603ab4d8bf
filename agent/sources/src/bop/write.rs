//! Writes labelled views as a BOP scene that [`BopSource`](super::BopSource) reads back.
//!
//! Millimetres, world-to-camera poses, depth in tenths of a millimetre, one visible-pixel mask for each component that a
//! view shows. What the layout of the benchmark cannot hold goes beside it: `labels/` and `defects/` with one class a
//! pixel in one picture, 255 where nothing is known, which is what training reads, and `defects.json` with the names of the
//! latter.

use super::pictures::path_of;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use nalgebra::Isometry3;
use semascan_inspection::source::SourceError;
use semascan_model::{ClassDef, Taxonomy};
use semascan_perception::view::{PoseEvidence, View};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Millimetres a unit of the depth pictures.
pub const DEPTH_SCALE: f64 = 0.1;

const FOLDERS: [&str; 5] = ["rgb", "depth", "mask_visib", "labels", "defects"];

/// A scene that is being written; views may be written in any order and on any thread.
#[derive(Debug)]
pub struct SceneWriter {
    folder: PathBuf,
    taxonomy: Taxonomy,
    /// The object's own frame in the scene's, for all components alike.
    table_from_object: Isometry3<f64>,
}

/// What the scene's JSON files say of a view whose pictures are written.
#[derive(Clone, Debug)]
pub struct SceneEntry {
    number: u32,
    camera: Value,
    /// `None` for a view without labels: an empty list would say that it shows no object.
    objects: Option<Value>,
}

impl SceneWriter {
    /// Makes the folder of a scene and those in it.
    ///
    /// # Errors
    /// [`SourceError::Io`] naming the folder that cannot be made.
    pub fn create(folder: &Path, taxonomy: &Taxonomy, table_from_object: Isometry3<f64>) -> Result<Self, SourceError> {
        for name in FOLDERS {
            let path = folder.join(name);
            fs::create_dir_all(&path).map_err(|source| SourceError::Io { path, source })?;
        }
        Ok(Self { folder: folder.to_owned(), taxonomy: taxonomy.clone(), table_from_object })
    }

    /// Writes the pictures of a view; a view without labels gets no masks, one without a pose no pose.
    ///
    /// # Errors
    /// [`SourceError`] naming the file.
    pub fn write(&self, view: &View) -> Result<SceneEntry, SourceError> {
        let number = view.index;
        let (w, h) = view.rgb.dimensions();
        let picture = |kind: &str| path_of(&self.folder, kind, number);
        write_png(&picture("rgb"), view.rgb.as_raw(), (w, h), ExtendedColorType::Rgb8)?;
        let depth: Vec<u8> = view.depth.metres.iter().flat_map(|z| depth_units(*z).to_ne_bytes()).collect();
        write_png(&picture("depth"), &depth, (view.depth.width, view.depth.height), ExtendedColorType::L16)?;
        let camera_from_table = true_pose(view).map(|pose| pose.inverse());
        let mut objects = None;
        if let Some(labels) = &view.labels {
            let mut listed = Vec::new();
            for (kind, classes) in [("labels", &labels.components), ("defects", &labels.defects)] {
                let bytes: Vec<u8> = classes.iter().map(|c| u8::try_from(*c).unwrap_or(u8::MAX)).collect();
                write_png(&picture(kind), &bytes, (w, h), ExtendedColorType::L8)?;
            }
            for class in self.taxonomy.components.iter().skip(1).filter(|c| labels.components.contains(&c.id)) {
                let mask: Vec<u8> = labels.components.iter().map(|c| if *c == class.id { 255 } else { 0 }).collect();
                let name = format!("{number:06}_{:06}.png", listed.len());
                write_png(&self.folder.join("mask_visib").join(name), &mask, (w, h), ExtendedColorType::L8)?;
                let mut entry = json!({ "obj_id": class.id });
                if let Some(pose) = camera_from_table {
                    let (r, t) = bop_pose(&(pose * self.table_from_object));
                    entry["cam_R_m2c"] = json!(r);
                    entry["cam_t_m2c"] = json!(t);
                }
                listed.push(entry);
            }
            objects = Some(Value::Array(listed));
        }
        let k = &view.intrinsics;
        let mut camera = json!({
            "cam_K": [k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0],
            "depth_scale": DEPTH_SCALE,
        });
        if let Some(pose) = camera_from_table {
            let (r, t) = bop_pose(&pose);
            camera["cam_R_w2c"] = json!(r);
            camera["cam_t_w2c"] = json!(t);
        }
        Ok(SceneEntry { number, camera, objects })
    }

    /// Writes the scene's JSON files: after this the scene is whole.
    ///
    /// # Errors
    /// [`SourceError`] naming the file.
    pub fn finish(self, entries: &[SceneEntry]) -> Result<(), SourceError> {
        let by_number = |of: fn(&SceneEntry) -> Option<&Value>| -> Map<String, Value> {
            entries.iter().filter_map(|e| Some((e.number.to_string(), of(e)?.clone()))).collect()
        };
        let names = |classes: &[ClassDef]| -> Map<String, Value> {
            classes.iter().skip(1).map(|c| (c.id.to_string(), json!(c.name))).collect()
        };
        write_json(&self.folder.join("objects.json"), &names(&self.taxonomy.components))?;
        write_json(&self.folder.join("defects.json"), &names(&self.taxonomy.defects))?;
        write_json(&self.folder.join("scene_gt.json"), &by_number(|e| e.objects.as_ref()))?;
        write_json(&self.folder.join("scene_camera.json"), &by_number(|e| Some(&e.camera)))
    }
}

/// The best that is known of the camera's pose.
fn true_pose(view: &View) -> Option<Isometry3<f64>> {
    match (&view.truth, &view.pose) {
        (Some(truth), _) => Some(truth.table_from_camera),
        (None, PoseEvidence::World { table_from_camera, .. }) => Some(*table_from_camera),
        (None, _) => None,
    }
}

/// Rotation row by row, and translation in millimetres.
fn bop_pose(pose: &Isometry3<f64>) -> (Vec<f64>, [f64; 3]) {
    let r = pose.rotation.to_rotation_matrix();
    (r.matrix().transpose().as_slice().to_vec(), (pose.translation.vector * 1e3).into())
}

/// Depth in units of the depth pictures; 0 where nothing was measured or the depth is past what they hold (6.5 m): their
/// largest value is no depth.
fn depth_units(metres: f32) -> u16 {
    let units = (f64::from(metres) * 1e3 / DEPTH_SCALE).round();
    if (0.0..f64::from(u16::MAX)).contains(&units) { units as u16 } else { 0 }
}

/// Writes a PNG.
///
/// # Errors
/// [`SourceError::Io`] naming the file.
pub(crate) fn write_png(
    path: &Path,
    bytes: &[u8],
    (w, h): (u32, u32),
    color: ExtendedColorType,
) -> Result<(), SourceError> {
    let io = |source| SourceError::Io { path: path.to_owned(), source };
    let mut file = BufWriter::new(fs::File::create(path).map_err(io)?);
    PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, w, h, color)
        .map_err(|e| io(std::io::Error::other(e)))?;
    file.flush().map_err(io)
}

/// Writes `value` as JSON for people and machines.
///
/// # Errors
/// [`SourceError::Io`] naming the file.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), SourceError> {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::other);
    text.and_then(|text| fs::write(path, text + "\n"))
        .map_err(|source| SourceError::Io { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_that_does_not_fit_is_a_gap() {
        assert_eq!([0.0, 0.5, 6.5534, 6.5535, 6.6, -1.0].map(depth_units), [0, 5000, 65534, 0, 0, 0]);
    }
}
