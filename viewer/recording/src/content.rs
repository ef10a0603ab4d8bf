//! What of a recording is shown: the mesh of an inspection, else its points, else the views of a camera.

use crate::RecordingError;
use crate::clouds::{Clouds, spacing};
use crate::messages::{Message, each};
use crate::views::Views;
use prost::Message as _;
use semascan_formats::ply;
use semascan_foxglove_schema::{CameraCalibration, FrameTransform, FrameTransforms, PointCloud, RawImage, SceneUpdate};
use semascan_model::{SemanticCloud, Taxonomy};
use std::collections::BTreeMap;

/// Media type of a glTF scene in one file.
const GLB: &str = "model/gltf-binary";
/// Kinds of messages that are named where nothing could be read.
const NAMED: usize = 6;

/// A recording as a file that the viewer opens.
#[derive(Debug, PartialEq)]
pub struct Opened {
    /// Name of the file: that of the recording with the ending of what it is now.
    pub name: String,
    /// Its content: GLB or PLY.
    pub bytes: Vec<u8>,
    /// What of the recording is shown and what is not, a sentence each.
    pub remarks: Vec<String>,
}

/// Everything of a recording that could be shown.
#[derive(Default)]
struct Found {
    views: Views,
    clouds: Clouds,
    /// The last mesh.
    mesh: Option<Vec<u8>>,
    /// Messages that are not read, by what they are.
    others: BTreeMap<String, u32>,
    /// Messages that are not what their channel says.
    broken: u32,
}

/// Reads the recording `name`.
///
/// # Errors
/// [`RecordingError`] if nothing of it can be shown.
pub fn read(name: &str, bytes: &[u8]) -> Result<Opened, RecordingError> {
    let mut found = Found::default();
    let missing = each(bytes, |message| found.take(message)).map_err(RecordingError::Broken)?;
    found.views.end(missing.is_cut);
    let mut remarks = Vec::new();
    if missing.chunks > 0 {
        remarks.push(format!("{} of its chunks are damaged or compressed in a way that is not read", missing.chunks));
    }
    if missing.is_cut {
        remarks.push("it ends in the middle: what is whole is shown".to_owned());
    }
    if found.broken > 0 {
        remarks.push(format!("{} of its messages are not what they are said to be", found.broken));
    }
    let part = name.rsplit_once('.').map_or(name, |(part, _)| part);
    if let Some(bytes) = found.mesh {
        remarks.push("the last mesh of the recording is shown".to_owned());
        return Ok(Opened { name: format!("{part}.glb"), bytes, remarks });
    }
    let points = found.clouds.cloud(&found.views.frames);
    if !points.is_empty() {
        remarks.push("the last point cloud of each topic is shown".to_owned());
        let voxel = spacing(&points).map(f64::from);
        return Ok(Opened { name: format!("{part}.ply"), bytes: as_ply(&points, voxel)?, remarks });
    }
    let views = &found.views;
    match (views.shown, views.nowhere, views.unusable) {
        (0, 0, 0) => return Err(RecordingError::Nothing(named(&found.others))),
        (0, 0, unusable) => return Err(RecordingError::Unusable(unusable)),
        (0, nowhere, _) => return Err(RecordingError::NoPoses(nowhere)),
        _ => {}
    }
    if views.nowhere > 0 {
        remarks.push(format!("{} depth pictures are left out: nothing says where the camera stood", views.nowhere));
    }
    if views.unusable > 0 {
        remarks.push(format!("{} depth pictures have no calibration or too few bytes", views.unusable));
    }
    if views.is_distorted {
        remarks.push("the distortion by the lens is not undone".to_owned());
    }
    let voxel = views.grid.voxel();
    remarks.push(format!(
        "the points of {} views as the camera measured them, means of {:.1} mm",
        views.shown,
        voxel * 1e3
    ));
    let cloud = views.grid.cloud();
    Ok(Opened { name: format!("{part}.ply"), bytes: as_ply(&cloud, Some(voxel))?, remarks })
}

impl Found {
    fn take(&mut self, message: Message<'_>) {
        let Message { topic, schema, encoding, data } = message;
        let is_read = match (encoding, schema) {
            ("protobuf", "foxglove.RawImage") => RawImage::decode(data).map(|picture| self.views.picture(picture)),
            ("protobuf", "foxglove.CameraCalibration") => {
                CameraCalibration::decode(data).map(|calibration| self.views.calibrate(calibration))
            }
            ("protobuf", "foxglove.FrameTransform") => {
                FrameTransform::decode(data).map(|transform| self.views.place(&transform))
            }
            ("protobuf", "foxglove.FrameTransforms") => FrameTransforms::decode(data)
                .map(|all| all.transforms.iter().for_each(|transform| self.views.place(transform))),
            ("protobuf", "foxglove.PointCloud") => PointCloud::decode(data).map(|cloud| self.clouds.take(topic, cloud)),
            ("protobuf", "foxglove.SceneUpdate") => SceneUpdate::decode(data).map(|update| self.scene(update)),
            _ => {
                *self.others.entry(format!("{schema} ({encoding})")).or_default() += 1;
                return;
            }
        };
        self.broken += u32::from(is_read.is_err());
    }

    /// The mesh of a scene, if it holds one.
    fn scene(&mut self, update: SceneUpdate) {
        let models = update.entities.into_iter().flat_map(|entity| entity.models);
        let largest = models.filter(|model| model.media_type == GLB).map(|model| model.data).max_by_key(Vec::len);
        if let Some(mesh) = largest.filter(|data| !data.is_empty()) {
            self.mesh = Some(mesh);
        }
    }
}

/// The kinds of messages of a recording, for people.
fn named(others: &BTreeMap<String, u32>) -> String {
    let kinds: Vec<String> = others.iter().take(NAMED).map(|(kind, count)| format!("{count} of {kind}")).collect();
    if kinds.is_empty() { "no other messages".to_owned() } else { kinds.join(", ") }
}

/// A cloud as a file of our own; `voxel` is how far apart its points are, metres.
fn as_ply(cloud: &SemanticCloud, voxel: Option<f64>) -> Result<Vec<u8>, RecordingError> {
    let classes = |of: &[u16]| of.iter().copied().max().unwrap_or(0);
    let names = |what: &str, most: u16| (1..=most).map(|n| format!("{what} {n}")).collect::<Vec<_>>();
    let components = names("component", classes(&cloud.labels));
    let taxonomy = Taxonomy::from_names(&components, &names("defect", classes(&cloud.defects)));
    let comments: Vec<(String, String)> =
        voxel.map(|voxel| ("voxel".to_owned(), voxel.to_string())).into_iter().collect();
    let mut bytes = Vec::new();
    ply::write_cloud(&mut bytes, cloud, &taxonomy, &comments)?;
    Ok(bytes)
}
