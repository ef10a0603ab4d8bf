//! Which pictures of a recording become views, and where the camera was: pairs by stamp, poses from the transforms, and the
//! step between views that the options ask for.
//!
//! A pose is a claim about motion. Where the way from the camera to the root of its tree is fixed, as in a recording of a
//! camera in somebody's hand, nothing says where the camera was, and the views have no pose unless a fixed frame is named.

use super::index::{Index, Picture, PictureStream};
use super::options::{HandEye, RecordingOptions};
use super::topics::Chosen;
use crate::messages::{Content, Stamp, frame_name};
use crate::pairing::Pairs;
use crate::transforms::{TransformError, TransformTree};
use nalgebra::Isometry3;

/// The setting that says what is known of the poses.
pub(crate) const POSES: &str = "poses";

/// The pictures of a view, and the camera's pose in the fixed frame if it is known.
#[derive(Clone, Debug)]
pub(crate) struct PlannedView {
    pub(crate) color: Option<Picture>,
    pub(crate) depth: Picture,
    pub(crate) table_from_camera: Option<Isometry3<f64>>,
}

/// The views of a recording.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) views: Vec<PlannedView>,
    /// What was chosen, for the record.
    pub(crate) said: Vec<(String, String)>,
}

impl Plan {
    /// Plans; the error says why there is no view, or what an option names that is not there.
    pub(crate) fn of(
        index: &Index,
        chosen: &Chosen<'_>,
        options: &RecordingOptions,
        every: usize,
    ) -> Result<Self, String> {
        let (mut views, pairs) = pictures(chosen, options)?;
        let camera = camera_frame(chosen, options);
        let poses = match fixed_frame(index, &camera.name, options)? {
            Ok(fixed) => place(&mut views, index, &fixed, &camera),
            Err(reason) => format!("none: {reason}"),
        };
        let found = views.len();
        let views = thinned(views, options, every);
        let mut said = vec![
            ("pairs".to_owned(), pairs),
            (POSES.to_owned(), poses),
            ("depth_topic".to_owned(), chosen.depth.topic.clone()),
        ];
        said.extend(chosen.color.map(|color| ("color_topic".to_owned(), color.topic.clone())));
        if views.len() < found {
            said.push(("step".to_owned(), format!("{} of {found} pairs are views", views.len())));
        }
        Ok(Self { views, said })
    }
}

/// The pictures that belong together, and what is said of that.
fn pictures(chosen: &Chosen<'_>, options: &RecordingOptions) -> Result<(Vec<PlannedView>, String), String> {
    let alone = |depth: &Picture| PlannedView { color: None, depth: *depth, table_from_camera: None };
    let clouds = || {
        let views: Vec<PlannedView> = chosen.depth.pictures.iter().map(alone).collect();
        let said = format!("{} clouds without colour pictures", views.len());
        Ok((views, said))
    };
    let Some(color) = chosen.color else { return clouds() };
    let stamps = |stream: &PictureStream| stream.pictures.iter().map(|picture| picture.stamp).collect::<Vec<Stamp>>();
    let pairs = Pairs::by_stamp(&stamps(color), &stamps(chosen.depth), options.pairing_tolerance);
    let milliseconds = |nanoseconds: u64| nanoseconds as f64 * 1e-6;
    let tolerance = milliseconds(options.pairing_tolerance);
    if pairs.pairs.is_empty() {
        if chosen.depth.content == Content::Cloud {
            return clouds();
        }
        return Err(format!(
            "of {} pictures of {} and {} of {} no two are within {tolerance} ms of each other: do both have the same \
             clock? (tolerance_ms)",
            color.pictures.len(),
            color.topic,
            chosen.depth.pictures.len(),
            chosen.depth.topic
        ));
    }
    let picked = pairs.pairs.iter().filter_map(|(i, j)| color.pictures.get(*i).zip(chosen.depth.pictures.get(*j)));
    let views = picked.map(|(color, depth)| PlannedView { color: Some(*color), ..alone(depth) }).collect();
    let said = format!(
        "{} within {tolerance} ms (at most {:.1} ms apart); alone stay {} colour and {} depth pictures",
        pairs.pairs.len(),
        milliseconds(pairs.largest_offset),
        pairs.first_alone,
        pairs.second_alone
    );
    Ok((views, said))
}

/// What the transforms have to lead to, and the camera in it: the camera's frame itself, or a calibrated end effector.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraFrame {
    pub(crate) name: String,
    frame_from_camera: Isometry3<f64>,
}

impl CameraFrame {
    /// The camera in `fixed` at `stamp`.
    ///
    /// # Errors
    /// As of [`TransformTree::pose`].
    pub(crate) fn pose(
        &self,
        tree: &TransformTree,
        fixed: &str,
        stamp: Stamp,
    ) -> Result<Isometry3<f64>, TransformError> {
        Ok(tree.pose(fixed, &self.name, stamp)? * self.frame_from_camera)
    }
}

/// The frame of the camera that the views are in.
pub(crate) fn camera_frame(chosen: &Chosen<'_>, options: &RecordingOptions) -> CameraFrame {
    let (name, frame_from_camera) = match &options.hand_eye {
        Some(HandEye { ee_frame, ee_from_camera }) => (ee_frame.clone(), *ee_from_camera),
        None => (camera_name(chosen, options), Isometry3::identity()),
    };
    CameraFrame { name, frame_from_camera }
}

/// The name of the camera's own frame.
fn camera_name(chosen: &Chosen<'_>, options: &RecordingOptions) -> String {
    if let Some(frame) = &options.camera_frame {
        return frame_name(frame);
    }
    let stream = match chosen.color {
        Some(color) if chosen.depth.content == Content::Depth => color,
        _ => chosen.depth,
    };
    match (stream.frame.as_str(), chosen.color_calibration) {
        ("", Some(calibration)) => calibration.frame().to_owned(),
        (frame, _) => frame.to_owned(),
    }
}

/// The frame that poses are given in, or why there are none.
fn fixed_frame(index: &Index, camera: &str, options: &RecordingOptions) -> Result<Result<String, String>, String> {
    let tree = &index.transforms;
    if let Some(wanted) = &options.fixed_frame {
        let wanted = frame_name(wanted);
        // Whether the two are connected does not depend on the time.
        return match tree.pose(&wanted, camera, Stamp::default()) {
            Ok(_) | Err(TransformError::NoPose { .. }) => Ok(Ok(wanted)),
            Err(error) => Err(format!("fixed_frame={wanted}: {error}")),
        };
    }
    if tree.is_empty() {
        return Ok(Err("no transforms are recorded".to_owned()));
    }
    let root = tree.root_of(camera);
    if root == camera {
        return Ok(Err(format!("no transform leads to the camera's frame {camera:?} (camera_frame names another)")));
    }
    if tree.is_fixed(root, camera) {
        return Ok(Err(format!(
            "the transforms from {camera:?} to {root:?} are fixed and say nothing of where the camera was \
             (fixed_frame={root} says that it stood still)"
        )));
    }
    Ok(Ok(root.to_owned()))
}

/// Gives each view its pose where there is one, and says how many have none.
fn place(views: &mut [PlannedView], index: &Index, fixed: &str, camera: &CameraFrame) -> String {
    let mut missing: Option<(usize, String)> = None;
    for view in views.iter_mut() {
        match camera.pose(&index.transforms, fixed, view.depth.stamp) {
            Ok(pose) => view.table_from_camera = Some(pose),
            Err(error) => missing.get_or_insert_with(|| (0, error.to_string())).0 += 1,
        }
    }
    let said = format!("of {:?} in {fixed:?}", camera.name);
    match missing {
        None => said,
        Some((count, first)) => format!("{said}; {count} of {} pairs have none, the first: {first}", views.len()),
    }
}

/// Every so many views, and of them those that are far enough from the one before; what has no pose stays.
fn thinned(views: Vec<PlannedView>, options: &RecordingOptions, every: usize) -> Vec<PlannedView> {
    let mut kept: Vec<PlannedView> = Vec::new();
    let mut last: Option<Isometry3<f64>> = None;
    for view in views.into_iter().step_by(every.max(1)) {
        if let (Some(pose), Some(last)) = (&view.table_from_camera, &last)
            && !options.is_step(last, pose)
        {
            continue;
        }
        last = view.table_from_camera.or(last);
        kept.push(view);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::container::Place;
    use super::*;

    fn views(shifts: &[Option<f64>]) -> Vec<PlannedView> {
        let place = Place { block: 0, offset: 0, length: 0 };
        let view = |(i, shift): (usize, &Option<f64>)| PlannedView {
            color: None,
            depth: Picture { stamp: Stamp { nanoseconds: i as i64 }, file: 0, place },
            table_from_camera: shift.map(|x| Isometry3::translation(x, 0.0, 0.0)),
        };
        shifts.iter().enumerate().map(view).collect()
    }

    fn kept(shifts: &[Option<f64>], query: &str, every: usize) -> Vec<i64> {
        let options = RecordingOptions::default().with_query(query).expect("options");
        thinned(views(shifts), &options, every).iter().map(|view| view.depth.stamp.nanoseconds).collect()
    }

    #[test]
    fn the_step_between_views_is_by_number_or_by_motion() {
        let shifts = [Some(0.0), Some(0.004), None, Some(0.011), Some(0.012), Some(0.03)];
        assert_eq!(kept(&shifts, "", 1), [0, 1, 2, 3, 4, 5]);
        assert_eq!(kept(&shifts, "", 2), [0, 2, 4]);
        assert_eq!(kept(&shifts, "shift_mm=10", 1), [0, 2, 3, 5]);
        assert_eq!(kept(&shifts, "shift_mm=10", 2), [0, 2, 4]);
        assert_eq!(kept(&shifts, "turn_deg=1", 1), [0, 2]);
    }
}
