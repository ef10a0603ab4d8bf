//! Poses of views in files: those of an inspection, and of other programs.

use semascan_model::record::{InspectionRecord, PoseRecord};
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Why a file of poses cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PoseFileError {
    /// The system did not give the file's bytes.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: std::io::Error,
    },
    /// A file of poses is not what it should be.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The files speak of other views than the source has.
    #[error("{}: {reason}", path.display())]
    OtherViews {
        /// The file.
        path: PathBuf,
        /// How they differ.
        reason: String,
    },
}

/// Poses of views: `inspection.json`, or a file of another program with `views`, each with `index`, `accepted` and `pose`
/// (and `prior`) as `inspection.json` has them.
#[derive(Clone, Debug)]
pub struct PoseFile {
    /// Where it was read from.
    pub path: PathBuf,
    pub(crate) views: Vec<PosedView>,
    /// Whether it is the record of an inspection, which speaks of every view of its source.
    pub(crate) whole: bool,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct PosedView {
    pub(crate) index: u32,
    pub(crate) accepted: bool,
    #[serde(default)]
    pub(crate) pose: Option<PoseRecord>,
    #[serde(default)]
    pub(crate) prior: Option<PoseRecord>,
}

#[derive(Deserialize)]
struct Views {
    views: Vec<PosedView>,
}

impl PoseFile {
    /// Reads the poses in the file `path`, or in `inspection.json` of the folder `path`.
    ///
    /// # Errors
    /// [`PoseFileError::File`] that names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, PoseFileError> {
        let path = if path.is_dir() { path.join("inspection.json") } else { path.to_owned() };
        let refuse = |reason: String| PoseFileError::File { path: path.clone(), reason };
        let text = semascan_formats::regular_file::read_to_string(&path)
            .map_err(|source| PoseFileError::Io { path: path.clone(), source })?;
        let json: Value = serde_json::from_str(&text).map_err(|e| refuse(e.to_string()))?;
        let whole = json.get("schema_version").is_some();
        let views = if whole {
            let record = InspectionRecord::from_json(&text).map_err(|e| refuse(e.to_string()))?;
            let posed = |v: &semascan_model::record::ViewRecord| PosedView {
                index: v.index,
                accepted: v.accepted,
                pose: v.pose,
                prior: v.prior,
            };
            record.views.iter().map(posed).collect()
        } else {
            serde_json::from_value::<Views>(json).map_err(|e| refuse(e.to_string()))?.views
        };
        for view in &views {
            for (field, pose) in [("pose", view.pose), ("prior", view.prior)] {
                if pose.is_some_and(|pose| !is_rigid(&pose)) {
                    let reason = format!("views[{}].{field}: not a rigid transform", view.index);
                    return Err(refuse(reason));
                }
            }
        }
        Ok(Self { path, views, whole })
    }

    pub(crate) fn view(&self, index: u32) -> Option<&PosedView> {
        self.views.iter().find(|v| v.index == index && v.accepted)
    }
}

/// Whether a pose is a rigid transform of finite numbers.
pub(crate) fn is_rigid(pose: &PoseRecord) -> bool {
    let q = pose.rotation;
    let length = (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w).sqrt();
    (length - 1.0).abs() < 1e-3 && pose.translation.iter().all(|t| t.is_finite())
}
