//! Where the frames are that transforms name: each is known by its parent, and moves as messages come.

use glam::{DAffine3, DQuat, DVec3};
use semascan_foxglove_schema::{FrameTransform, Pose};
use std::collections::BTreeMap;

/// The frame that a scan is shown in, where there is one of this name: that of the turntable.
const TABLE: &str = "table";
/// Longest way to the root.
const MOST_PARENTS: usize = 64;

/// The frames as the transforms have told them by now.
#[derive(Debug, Default)]
pub(crate) struct Frames {
    /// Parent of each frame, and `parent_from_frame`, metres.
    parents: BTreeMap<String, (String, DAffine3)>,
}

impl Frames {
    /// A frame has a place, or another one.
    pub(crate) fn place(&mut self, transform: &FrameTransform) {
        let translation = transform.translation.as_ref().map_or(DVec3::ZERO, |t| DVec3::new(t.x, t.y, t.z));
        let rotation = transform.rotation.as_ref().map_or(DQuat::IDENTITY, |q| DQuat::from_xyzw(q.x, q.y, q.z, q.w));
        if let Some(parent_from_frame) = rigid(rotation, translation) {
            let parent = transform.parent_frame_id.clone();
            self.parents.insert(transform.child_frame_id.clone(), (parent, parent_from_frame));
        }
    }

    /// `shown_from_frame`: shown is the turntable where a way leads there, else what the frame hangs from in the end. `None` for a
    /// frame that no transform names.
    pub(crate) fn shown_from(&self, frame: &str) -> Option<DAffine3> {
        if frame == TABLE {
            return Some(DAffine3::IDENTITY);
        }
        let (root, root_from_frame) = self.root_from(frame)?;
        let way = match self.root_from(TABLE) {
            Some((of_table, root_from_table)) if of_table == root => root_from_table.inverse() * root_from_frame,
            _ => root_from_frame,
        };
        (root != frame || root == TABLE).then_some(way)
    }

    /// What a frame hangs from in the end, and `root_from_frame`; `None` if it never ends.
    fn root_from(&self, frame: &str) -> Option<(String, DAffine3)> {
        let (mut at, mut pose) = (frame.to_owned(), DAffine3::IDENTITY);
        for _ in 0..MOST_PARENTS {
            let Some((parent, parent_from_frame)) = self.parents.get(&at) else { return Some((at, pose)) };
            pose = *parent_from_frame * pose;
            at.clone_from(parent);
        }
        None
    }
}

/// A pose as a message has it; the identity where it says none.
pub(crate) fn pose(pose: Option<&Pose>) -> Option<DAffine3> {
    let Some(pose) = pose else { return Some(DAffine3::IDENTITY) };
    let translation = pose.position.as_ref().map_or(DVec3::ZERO, |t| DVec3::new(t.x, t.y, t.z));
    let rotation = pose.orientation.as_ref().map_or(DQuat::IDENTITY, |q| DQuat::from_xyzw(q.x, q.y, q.z, q.w));
    rigid(rotation, translation)
}

/// `None` where a number is none, or the quaternion no rotation.
fn rigid(rotation: DQuat, translation: DVec3) -> Option<DAffine3> {
    let length = rotation.length();
    let is_rotation = (length - 1.0).abs() < 1e-2;
    (is_rotation && translation.is_finite())
        .then(|| DAffine3::from_rotation_translation(rotation.normalize(), translation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_foxglove_schema::{Quaternion, Vector3};

    fn transform(parent: &str, child: &str, x: f64, angle: f64) -> FrameTransform {
        let half = 0.5 * angle;
        FrameTransform {
            timestamp: None,
            parent_frame_id: parent.into(),
            child_frame_id: child.into(),
            translation: Some(Vector3 { x, y: 0.0, z: 0.0 }),
            rotation: Some(Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() }),
        }
    }

    #[test]
    fn a_camera_on_a_robot_is_seen_from_the_table_as_it_turns() {
        let mut frames = Frames::default();
        for step in [("base", "ee", 1.0), ("ee", "camera", 0.5), ("base", "table", 2.0)] {
            frames.place(&transform(step.0, step.1, step.2, 0.0));
        }
        let place = |frames: &Frames| frames.shown_from("camera").expect("known").translation;
        assert!((place(&frames) - DVec3::new(-0.5, 0.0, 0.0)).length() < 1e-12);
        frames.place(&transform("base", "table", 2.0, std::f64::consts::FRAC_PI_2));
        assert!((place(&frames) - DVec3::new(0.0, 0.5, 0.0)).length() < 1e-12, "{}", place(&frames));
    }

    #[test]
    fn without_a_table_the_root_is_shown_and_what_hangs_nowhere_or_in_a_circle_has_no_place() {
        let mut frames = Frames::default();
        assert_eq!(frames.shown_from("camera"), None);
        frames.place(&transform("map", "camera", 3.0, 0.0));
        assert_eq!(frames.shown_from("camera").expect("known").translation, DVec3::new(3.0, 0.0, 0.0));
        frames.place(&transform("a", "b", 0.0, 0.0));
        frames.place(&transform("b", "a", 0.0, 0.0));
        assert_eq!(frames.shown_from("a"), None);
        let mut broken = transform("map", "camera", f64::NAN, 0.0);
        frames.place(&broken);
        broken = transform("map", "camera", 5.0, 0.0);
        broken.rotation = Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 });
        frames.place(&broken);
        assert_eq!(frames.shown_from("camera").expect("known").translation.x, 3.0);
    }
}
