//! Poses of recorded views against the pictures, without any truth: those of an inspection, the robot's own, and those of
//! other programs, all on the same matches.

use crate::pose_file::{PoseFile, PoseFileError};
use nalgebra::Isometry3;
use semascan_inspection::record::isometry;
use semascan_inspection::source::{Source, SourceInfo};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::reprojection::{JudgedPicture, Pictures, ReprojectionReport};
use semascan_perception::view::View;

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
/// [`PoseFileError::OtherViews`] if a file speaks of other views than the source has.
pub fn judge_poses(source: &mut dyn Source, files: &[PoseFile]) -> Result<JudgedPoses, PoseFileError> {
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
        let other = |reason| Err(PoseFileError::OtherViews { path: file.path.clone(), reason });
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
        Some(labels) => JudgedPicture::new(&view.rgb, &cloud, Some(&|i| labels.shows_component(i))),
        None => JudgedPicture::new(&view.rgb, &cloud, None),
    }
}
