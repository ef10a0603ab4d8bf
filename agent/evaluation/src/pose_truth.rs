//! Poses of an inspection against the true ones of a simulated recording: `truth.json`, which `semascan synth --turntable`
//! writes beside each.
//!
//! The recording has no poses, so the frame in which the inspection's stand is its own choice: they are judged after the one
//! rigid motion that brings all of them closest to the truth ([`align_poses`]).

use crate::pose_file::{PoseFile, PoseFileError, is_rigid};
use crate::poses::{PoseError, PosePair, align_poses, pose_error};
use nalgebra::Isometry3;
use semascan_inspection::record::isometry;
use semascan_model::record::PoseRecord;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// How figures are made, for people.
pub const POSE_TRUTH_CONVENTION: &str = "after the one rigid motion of the poses that minimises sum |c - X c'|^2 + s^2 a^2 over \
    the views (centres c, angles a, s = RMS distance of the true centres from their mean); angle in degrees, distance of camera \
    centres in millimetres";

/// The true poses of a recording.
#[derive(Clone, Debug)]
pub struct PoseTruth {
    /// Where they were read from.
    pub path: PathBuf,
    table_from_camera: Vec<Isometry3<f64>>,
}

#[derive(Deserialize)]
struct TruthFile {
    table_from_camera: Vec<PoseRecord>,
}

/// Poses against the true ones.
#[derive(Clone, Debug)]
pub struct JudgedByTruth {
    /// The motion after which they are judged.
    pub truth_from_model: Isometry3<f64>,
    /// The error of each view that has a pose, by its number.
    pub views: Vec<(u32, PoseError)>,
    /// Views of the recording that have none, or were left out.
    pub without_pose: Vec<u32>,
}

impl PoseTruth {
    /// Reads a `truth.json`.
    ///
    /// # Errors
    /// [`PoseFileError`] that names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, PoseFileError> {
        let path = path.to_owned();
        let text = match semascan_formats::regular_file::read_to_string(&path) {
            Ok(text) => text,
            Err(source) => return Err(PoseFileError::Io { path, source }),
        };
        let file: TruthFile = match serde_json::from_str(&text) {
            Ok(file) => file,
            Err(error) => {
                let reason = format!("is no truth.json of a turntable recording: {error}");
                return Err(PoseFileError::File { path, reason });
            }
        };
        if let Some(view) = file.table_from_camera.iter().position(|pose| !is_rigid(pose)) {
            return Err(PoseFileError::File {
                path,
                reason: format!("table_from_camera[{view}]: not a rigid transform"),
            });
        }
        Ok(Self { path, table_from_camera: file.table_from_camera.iter().map(isometry).collect() })
    }

    /// Judges the poses in `file`.
    ///
    /// # Errors
    /// [`PoseFileError::OtherViews`] if it speaks of other views than the recording has, or of none with a pose.
    pub fn judge(&self, file: &PoseFile) -> Result<JudgedByTruth, PoseFileError> {
        let other = |reason: String| PoseFileError::OtherViews { path: file.path.clone(), reason };
        let known = self.table_from_camera.len();
        if file.whole && file.views.len() != known {
            let reason = format!(
                "has {} views, {} {known}: it is of another recording or of keyframes",
                file.views.len(),
                self.path.display()
            );
            return Err(other(reason));
        }
        if let Some(view) = file.views.iter().find(|view| view.index as usize >= known) {
            return Err(other(format!("speaks of view {}, {} has {known}", view.index, self.path.display())));
        }
        let (mut views, mut pairs, mut without_pose) = (Vec::new(), Vec::new(), Vec::new());
        for (index, truth) in (0_u32..).zip(&self.table_from_camera) {
            match file.view(index).and_then(|view| view.pose.as_ref()) {
                Some(pose) => {
                    views.push(index);
                    pairs.push(PosePair { estimate: isometry(pose), truth: *truth });
                }
                None => without_pose.push(index),
            }
        }
        let truth_from_model = align_poses(&pairs).ok_or_else(|| other("no view of it has a pose".into()))?;
        let errors = pairs.iter().map(|pair| pose_error(&(truth_from_model * pair.estimate), &pair.truth));
        Ok(JudgedByTruth { truth_from_model, views: views.into_iter().zip(errors).collect(), without_pose })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use semascan_inspection::record::pose_record;
    use serde_json::json;

    fn written(folder: &Path, name: &str, content: serde_json::Value) -> PathBuf {
        let path = folder.join(name);
        std::fs::write(&path, content.to_string()).expect("writes");
        path
    }

    #[test]
    fn a_frame_of_its_own_costs_nothing_and_one_wrong_view_shows() {
        let root = tempfile::tempdir().expect("a folder");
        let true_pose = |i: u32| {
            let a = f64::from(i);
            Isometry3::new(Vector3::new(0.5 * a.cos(), 0.5 * a.sin(), 0.4), Vector3::new(0.2 * a, -0.3, 0.1 * a))
        };
        let truth: Vec<_> = (0..6).map(|i| pose_record(&true_pose(i))).collect();
        let truth = json!({ "simulated": true, "step_deg": 60.0, "table_from_camera": truth });
        let truth = PoseTruth::read(&written(root.path(), "truth.json", truth)).expect("a truth");
        let own_frame = Isometry3::new(Vector3::new(1.0, -2.0, 0.3), Vector3::new(0.4, 0.1, -2.0));
        let posed = |i: u32, off: f64| {
            let pose = own_frame * true_pose(i) * Isometry3::translation(off, 0.0, 0.0);
            json!({ "index": i, "accepted": i != 4, "pose": pose_record(&pose) })
        };
        let views: Vec<_> = (0..6).map(|i| posed(i, 0.0)).collect();
        let right = written(root.path(), "right.json", json!({ "views": views }));
        let judged = truth.judge(&PoseFile::read(&right).expect("poses")).expect("judged");
        assert_eq!(judged.without_pose, [4], "a view that was left out has no pose");
        assert_eq!(judged.views.iter().map(|(i, _)| *i).collect::<Vec<_>>(), [0, 1, 2, 3, 5]);
        assert!(judged.views.iter().all(|(_, e)| e.rotation < 1e-6 && e.translation < 1e-6), "{judged:?}");

        let views: Vec<_> = (0..6).map(|i| posed(i, if i == 2 { 0.01 } else { 0.0 })).collect();
        let wrong = written(root.path(), "wrong.json", json!({ "views": views }));
        let judged = truth.judge(&PoseFile::read(&wrong).expect("poses")).expect("judged");
        let worst = judged.views.iter().max_by(|a, b| a.1.translation.total_cmp(&b.1.translation)).expect("views");
        assert!(worst.0 == 2 && worst.1.translation > 0.006, "{judged:?}");
    }

    #[test]
    fn other_files_are_refused_by_name() {
        let root = tempfile::tempdir().expect("a folder");
        let no_truth = written(root.path(), "scene.json", json!({ "views": [] }));
        let error = PoseTruth::read(&no_truth).expect_err("no truth").to_string();
        assert!(error.contains("scene.json") && error.contains("table_from_camera"), "{error}");
        let pose = pose_record(&Isometry3::identity());
        let truth = written(root.path(), "truth.json", json!({ "table_from_camera": [pose] }));
        let truth = PoseTruth::read(&truth).expect("a truth");
        let other = written(root.path(), "other.json", json!({ "views": [{ "index": 3, "accepted": true }] }));
        let error = truth.judge(&PoseFile::read(&other).expect("poses")).expect_err("other views").to_string();
        assert!(error.contains("other.json") && error.contains("view 3"), "{error}");
        let none = written(root.path(), "none.json", json!({ "views": [] }));
        let error = truth.judge(&PoseFile::read(&none).expect("poses")).expect_err("no views").to_string();
        assert!(error.contains("no view of it has a pose"), "{error}");
    }
}
