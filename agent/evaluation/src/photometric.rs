//! Poses of recorded views against the pictures, without any truth: those of an inspection, the robot's own, and those of
//! other programs, all on the same matches.

use nalgebra::Isometry3;
use semascan_inspection::record::isometry;
use semascan_inspection::source::{Source, SourceInfo};
use semascan_model::record::{InspectionRecord, PoseRecord};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::reprojection::{JudgedPicture, Pictures, ReprojectionReport};
use semascan_perception::view::View;
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Why poses cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum PhotometricError {
    /// A file of poses cannot be read.
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
    views: Vec<PosedView>,
    /// Whether it is the record of an inspection, which speaks of every view of its source.
    whole: bool,
}

#[derive(Clone, Debug, Deserialize)]
struct PosedView {
    index: u32,
    accepted: bool,
    #[serde(default)]
    pose: Option<PoseRecord>,
    #[serde(default)]
    prior: Option<PoseRecord>,
}

#[derive(Deserialize)]
struct Views {
    views: Vec<PosedView>,
}

impl PoseFile {
    /// Reads the poses in the file `path`, or in `inspection.json` of the folder `path`.
    ///
    /// # Errors
    /// [`PhotometricError::File`] that names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, PhotometricError> {
        let path = if path.is_dir() { path.join("inspection.json") } else { path.to_owned() };
        let refuse = |reason: String| PhotometricError::File { path: path.clone(), reason };
        let text = semascan_formats::regular_file::read_to_string(&path).map_err(|e| refuse(e.to_string()))?;
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

    fn view(&self, index: u32) -> Option<&PosedView> {
        self.views.iter().find(|v| v.index == index && v.accepted)
    }
}

fn is_rigid(pose: &PoseRecord) -> bool {
    let q = pose.rotation;
    let length = (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w).sqrt();
    (length - 1.0).abs() < 1e-3 && pose.translation.iter().all(|t| t.is_finite())
}

/// What the judge says.
#[derive(Clone, Debug)]
pub struct JudgedPoses {
    /// How well each set agrees: the poses of each file in order, then, where every judged view has one, the kinematic
    /// poses of the first.
    pub report: ReprojectionReport,
    /// Whether the last set is the kinematic poses.
    pub kinematic: bool,
    /// Views of the source that could not be read, with the reason.
    pub unreadable: Vec<String>,
    /// Views that not every file has a pose of.
    pub unposed: usize,
}

/// Judges the poses of `files` by the pictures of `source`, on the views that every file has a pose of.
///
/// # Errors
/// [`PhotometricError::OtherViews`] if a file speaks of other views than the source has.
pub fn judge_poses(source: &mut dyn Source, files: &[PoseFile]) -> Result<JudgedPoses, PhotometricError> {
    let info = source.info().clone();
    let mut pictures = Pictures::default();
    let mut sets: Vec<Vec<Isometry3<f64>>> = vec![Vec::new(); files.len()];
    let mut priors: Option<Vec<Isometry3<f64>>> = Some(Vec::new());
    let (mut unreadable, mut unposed, mut count) = (Vec::new(), 0, 0_u32);
    while let Some(view) = source.next_view() {
        let index = count;
        count += 1;
        let checked =
            view.map_err(|e| e.to_string()).and_then(|v| v.check_sizes().map(|()| v).map_err(|e| e.to_string()));
        let view = match checked {
            Ok(view) => view,
            Err(reason) => {
                unreadable.push(format!("view {index}: {reason}"));
                continue;
            }
        };
        let poses: Option<Vec<_>> = files.iter().map(|f| f.view(index)?.pose.as_ref().map(isometry)).collect();
        let Some(poses) = poses else {
            unposed += 1;
            continue;
        };
        let place = sets.first().map_or(0, Vec::len);
        sets.iter_mut().zip(poses).for_each(|(set, pose)| set.push(pose));
        let prior = files.first().and_then(|f| f.view(index)?.prior.as_ref().map(isometry));
        match (&mut priors, prior) {
            (Some(priors), Some(prior)) => priors.push(prior),
            _ => priors = None,
        }
        if pictures.wants(place) {
            pictures.keep(place, picture(&info, &view));
        }
    }
    for file in files {
        let other = |reason| Err(PhotometricError::OtherViews { path: file.path.clone(), reason });
        if file.whole && file.views.len() != count as usize {
            let reason =
                format!("has {} views, the source {count}: it is of another source or of keyframes", file.views.len());
            return other(reason);
        }
        if let Some(view) = file.views.iter().find(|v| v.index >= count) {
            return other(format!("speaks of view {}, the source has {count}", view.index));
        }
    }
    let priors = priors.filter(|priors| !priors.is_empty());
    let kinematic = priors.is_some();
    sets.extend(priors);
    let report = pictures.judge(&sets.iter().map(Vec::as_slice).collect::<Vec<_>>());
    Ok(JudgedPoses { report, kinematic, unreadable, unposed })
}

/// What the judge gets to see of a view.
fn picture(info: &SourceInfo, view: &View) -> JudgedPicture {
    let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, None);
    match view.labels.as_ref().filter(|_| info.turntable.is_some()) {
        Some(labels) => JudgedPicture::new(&view.rgb, &cloud, Some(&|i| labels.components[i] != 0)),
        None => JudgedPicture::new(&view.rgb, &cloud, None),
    }
}
