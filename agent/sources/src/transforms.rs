//! A tree of frames whose poses to each other were published with stamps, as ROS's tf and Foxglove's transforms are: the
//! pose between any two of its frames at a time.
//!
//! Between two stamps a link's translation is interpolated linearly and its rotation along the shortest arc ([Shoemake 1985]:
//! spherical linear interpolation). Outside of its stamps, or within a long silence, nothing is invented: the last pose is
//! held for a stated tolerance, then it is an error that names the link. A link that is published as static is valid at
//! any time.

use crate::messages::{Stamp, StampedTransform};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// Silence of a link, in nanoseconds, over which nothing is interpolated unless both ends are the same pose.
const LONGEST_SILENCE: u64 = 1_000_000_000;
/// Most frames of a tree; robots have some hundred.
const MOST_FRAMES: usize = 4096;
/// Poses that differ by less are the same: metres and radians.
const SAME_POSE: (f64, f64) = (1e-4, 1e-4);

/// How long a published transform is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validity {
    /// At any time: `/tf_static`.
    Always,
    /// At its stamp; between two stamps there is something to interpolate.
    AtStamp,
    /// As [`AtStamp`](Self::AtStamp), but a link that was published only once is valid at any time: programs that have no
    /// static transforms publish fixed frames once.
    AtStampOrAlone,
}

/// Why there is no pose between two frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TransformError {
    /// No transform names the frame.
    #[error("no transform names the frame {frame:?}; there are {}", known.join(", "))]
    UnknownFrame {
        /// The frame.
        frame: String,
        /// Some that there are.
        known: Vec<String>,
    },
    /// The frames are in different trees.
    #[error(
        "the frames {from:?} and {to:?} are not connected: a transform between {from_root:?} and {to_root:?} is missing"
    )]
    NotConnected {
        /// One frame.
        from: String,
        /// The other.
        to: String,
        /// The root of the first one's tree.
        from_root: String,
        /// The root of the other's tree.
        to_root: String,
    },
    /// A link on the way has no pose at the time.
    #[error("no transform from {child:?} to {parent:?} at the time {}: {reason}", seconds(*stamp))]
    NoPose {
        /// The link's parent.
        parent: String,
        /// The link's child.
        child: String,
        /// The time.
        stamp: Stamp,
        /// What there is instead.
        reason: String,
    },
    /// A frame has two parents.
    #[error("the frame {child:?} has two parents, {first:?} and {second:?}: the second is not used")]
    TwoParents {
        /// The frame.
        child: String,
        /// The parent that stays.
        first: String,
        /// The other one.
        second: String,
    },
    /// There are more frames than any robot has.
    #[error("the tree has {MOST_FRAMES} frames: no more are taken in")]
    TooMany,
    /// A frame hangs on itself.
    #[error("the frame {child:?} cannot hang on {parent:?}, which hangs on it")]
    Loop {
        /// The frame.
        child: String,
        /// Its parent.
        parent: String,
    },
}

/// Frames and the links between them.
#[derive(Clone, Debug)]
pub struct TransformTree {
    /// By the child's name.
    links: BTreeMap<String, Link>,
    /// How long a link's first and last pose are held, nanoseconds.
    tolerance: u64,
}

/// A frame's pose in its parent.
#[derive(Clone, Debug)]
struct Link {
    parent: String,
    /// One of them where the link is fixed.
    poses: BTreeMap<Stamp, Isometry3<f64>>,
    validity: Validity,
}

impl TransformTree {
    /// No frames yet. A link's first and last pose are held for `tolerance` nanoseconds.
    pub fn new(tolerance: u64) -> Self {
        Self { links: BTreeMap::new(), tolerance }
    }

    /// Whether there is no transform.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Forgets poses of before `stamp`, but for the last two of each link: of a stream that goes on for hours.
    pub fn forget_before(&mut self, stamp: Stamp) {
        for link in self.links.values_mut() {
            let before = link.poses.range(..stamp).count();
            for _ in 2..before {
                link.poses.pop_first();
            }
        }
    }

    /// Forgets the links that move: the clock that their stamps are of is another one by now.
    pub fn forget_moving(&mut self) {
        self.links.retain(|_, link| link.is_fixed());
    }

    /// Takes a transform in.
    ///
    /// # Errors
    /// [`TransformError`] where it does not fit into a tree; the tree stays as it was.
    pub fn add(&mut self, transform: StampedTransform, validity: Validity) -> Result<(), TransformError> {
        let StampedTransform { stamp, parent, child, parent_from_child } = transform;
        if let Some(link) = self.links.get_mut(&child) {
            if link.parent != parent {
                return Err(TransformError::TwoParents { child, first: link.parent.clone(), second: parent });
            }
            link.add(stamp, parent_from_child, validity);
            return Ok(());
        }
        // What has no parent yet is a root.
        if self.root_of(&parent) == child {
            return Err(TransformError::Loop { child, parent });
        }
        if self.links.len() == MOST_FRAMES {
            return Err(TransformError::TooMany);
        }
        let poses = BTreeMap::from([(stamp, parent_from_child)]);
        self.links.insert(child, Link { parent, poses, validity });
        Ok(())
    }

    /// Whether some transform names `frame`.
    pub fn knows(&self, frame: &str) -> bool {
        self.links.contains_key(frame) || self.links.values().any(|link| link.parent == frame)
    }

    /// The frame that `frame` hangs on in the end; itself where nothing is known of it.
    pub fn root_of<'a>(&'a self, frame: &'a str) -> &'a str {
        self.to_root(frame).last().map_or(frame, |(_, link)| &link.parent)
    }

    /// Whether the way between two frames is fixed: it says nothing of motion.
    pub fn is_fixed(&self, target: &str, source: &str) -> bool {
        let in_common = |frame: &str, other: &str| self.to_root(other).any(|(child, _)| child == frame);
        let fixed = |from: &str, to: &str| {
            self.to_root(from).filter(|(child, _)| !in_common(child, to)).all(|(_, link)| link.is_fixed())
        };
        fixed(source, target) && fixed(target, source)
    }

    /// The pose `target_from_source` at `stamp`.
    ///
    /// # Errors
    /// [`TransformError`] naming the frame or link that is missing.
    pub fn pose(&self, target: &str, source: &str, stamp: Stamp) -> Result<Isometry3<f64>, TransformError> {
        for frame in [target, source] {
            if target != source && !self.knows(frame) {
                return Err(TransformError::UnknownFrame { frame: frame.to_owned(), known: self.some_frames() });
            }
        }
        let (source_root, target_root) = (self.root_of(source), self.root_of(target));
        if source_root != target_root {
            return Err(TransformError::NotConnected {
                from: source.to_owned(),
                to: target.to_owned(),
                from_root: source_root.to_owned(),
                to_root: target_root.to_owned(),
            });
        }
        let ancestor = self.common_ancestor(target, source);
        let ancestor_from_source = self.in_ancestor(ancestor, source, stamp)?;
        let ancestor_from_target = self.in_ancestor(ancestor, target, stamp)?;
        Ok(ancestor_from_target.inverse() * ancestor_from_source)
    }

    /// The first frame on the way from `source` to the root that is on the way from `target`, too.
    fn common_ancestor<'a>(&'a self, target: &'a str, source: &'a str) -> &'a str {
        let way = |from: &'a str| std::iter::once(from).chain(self.to_root(from).map(|(_, link)| link.parent.as_str()));
        let of_target: Vec<&str> = way(target).collect();
        way(source).find(|frame| of_target.contains(frame)).unwrap_or(target)
    }

    /// The pose of `frame` in its `ancestor`.
    fn in_ancestor(&self, ancestor: &str, frame: &str, stamp: Stamp) -> Result<Isometry3<f64>, TransformError> {
        let mut ancestor_from_frame = Isometry3::identity();
        for (child, link) in self.to_root(frame).take_while(|(child, _)| *child != ancestor) {
            let parent_from_child = link.at(stamp, self.tolerance).map_err(|reason| TransformError::NoPose {
                parent: link.parent.clone(),
                child: child.to_owned(),
                stamp,
                reason,
            })?;
            ancestor_from_frame = parent_from_child * ancestor_from_frame;
        }
        Ok(ancestor_from_frame)
    }

    /// The links from `frame` to the root, with the name of each one's child. There are no loops.
    fn to_root<'a>(&'a self, frame: &'a str) -> impl Iterator<Item = (&'a str, &'a Link)> {
        let mut at = frame;
        std::iter::from_fn(move || {
            let (child, link) = (at, self.links.get(at)?);
            at = &link.parent;
            Some((child, link))
        })
    }

    fn some_frames(&self) -> Vec<String> {
        let parents = self.links.values().map(|link| &link.parent);
        let mut known: Vec<String> = self.links.keys().chain(parents).cloned().collect();
        known.sort();
        known.dedup();
        known.truncate(20);
        known
    }
}

impl Link {
    fn is_fixed(&self) -> bool {
        match self.validity {
            Validity::Always => true,
            Validity::AtStampOrAlone => self.poses.len() == 1,
            Validity::AtStamp => false,
        }
    }

    fn add(&mut self, stamp: Stamp, pose: Isometry3<f64>, validity: Validity) {
        match (self.validity, validity) {
            // The last word of a static transform is the one that is valid.
            (Validity::Always, Validity::Always) => self.poses = BTreeMap::from([(stamp, pose)]),
            // Who says that it moves knows more.
            (Validity::Always, moving) => (self.poses, self.validity) = (BTreeMap::from([(stamp, pose)]), moving),
            (_, Validity::Always) => {}
            _ => {
                self.poses.insert(stamp, pose);
            }
        }
    }

    /// The pose at `stamp`, or what there is instead.
    fn at(&self, stamp: Stamp, tolerance: u64) -> Result<Isometry3<f64>, String> {
        let before = self.poses.range(..stamp).next_back();
        let next = self.poses.range(stamp..).next();
        if let (true, Some((_, pose))) = (self.is_fixed(), before.or(next)) {
            return Ok(*pose);
        }
        match (before, next) {
            (_, Some((known, pose))) if *known == stamp => Ok(*pose),
            (Some((start, from)), Some((end, to))) => {
                let silence = start.distance(*end);
                if silence > LONGEST_SILENCE && !is_same(from, to) {
                    return Err(format!("none was published for {:.3} s around it", silence as f64 * 1e-9));
                }
                Ok(between(from, to, start.distance(stamp) as f64 / silence as f64))
            }
            (Some((known, pose)), None) | (None, Some((known, pose))) => {
                let distance = known.distance(stamp);
                if distance <= tolerance {
                    return Ok(*pose);
                }
                let (distance, tolerance) = (distance as f64 * 1e-9, tolerance as f64 * 1e-9);
                Err(format!("the nearest is {distance:.3} s away, and {tolerance:.3} s are allowed"))
            }
            (None, None) => Err("none was published".to_owned()),
        }
    }
}

/// The pose at a share of the way between two.
fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let translation: Vector3<f64> = from.translation.vector.lerp(&to.translation.vector, share);
    // Half a turn has no shortest arc: the nearer end stands for it.
    let nearer = if share < 0.5 { from.rotation } else { to.rotation };
    let rotation: UnitQuaternion<f64> = from.rotation.try_slerp(&to.rotation, share, 1e-9).unwrap_or(nearer);
    Isometry3::from_parts(translation.into(), rotation)
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    let way = a.inverse() * b;
    way.translation.vector.norm() < SAME_POSE.0 && way.rotation.angle() < SAME_POSE.1
}

fn seconds(stamp: Stamp) -> String {
    format!("{:.3} s", stamp.seconds())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn transform(parent: &str, child: &str, milliseconds: i64, x: f64, turn: f64) -> StampedTransform {
        StampedTransform {
            stamp: at(milliseconds),
            parent: parent.into(),
            child: child.into(),
            parent_from_child: Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::z() * turn),
        }
    }

    fn at(milliseconds: i64) -> Stamp {
        Stamp { nanoseconds: milliseconds * 1_000_000 }
    }

    /// map <- base (moves) <- tool (fixed) <- camera (fixed), map <- table (fixed).
    fn cell() -> TransformTree {
        let mut tree = TransformTree::new(20_000_000);
        for (milliseconds, x, turn) in [(200, 1.0, 1.0), (100, 0.0, 0.0), (300, 2.0, -3.0)] {
            tree.add(transform("map", "base", milliseconds, x, turn), Validity::AtStamp).expect("fits");
        }
        tree.add(transform("base", "tool", 0, 0.5, 0.0), Validity::Always).expect("fits");
        tree.add(transform("tool", "camera", 0, 0.25, 0.0), Validity::Always).expect("fits");
        tree.add(transform("map", "table", 7, -1.0, 0.0), Validity::Always).expect("fits");
        tree
    }

    #[test]
    fn poses_are_interpolated_between_stamps_along_the_shortest_arc() {
        let tree = cell();
        let half = tree.pose("map", "camera", at(150)).expect("between two stamps");
        let expected =
            Isometry3::new(Vector3::new(0.5, 0.0, 0.0), Vector3::z() * 0.5) * Isometry3::translation(0.75, 0.0, 0.0);
        assert!((half.inverse() * expected).translation.vector.norm() < 1e-12, "{half} {expected}");
        assert!((half.rotation.angle() - 0.5).abs() < 1e-9);
        // From 1 to -3 rad it is 2.28 rad onwards, not 4 rad back.
        let shortest = tree.pose("map", "base", at(250)).expect("between two stamps").rotation;
        assert!((shortest.angle() - (1.0 + (std::f64::consts::TAU - 4.0) / 2.0)).abs() < 1e-9);
        let in_table = tree.pose("table", "base", at(200)).expect("at a stamp");
        assert!((in_table.translation.x - 2.0).abs() < 1e-12);
        let round = tree.pose("base", "table", at(200)).expect("back") * in_table;
        assert!(round.translation.vector.norm() < 1e-9 && round.rotation.angle() < 1e-9);
    }

    #[test]
    fn outside_of_the_stamps_a_pose_is_held_for_the_tolerance_and_then_the_link_is_named() {
        let tree = cell();
        let held = tree.pose("map", "base", at(320)).expect("20 ms behind");
        assert!((held.translation.x - 2.0).abs() < 1e-12);
        let error = tree.pose("map", "camera", at(400)).expect_err("100 ms behind").to_string();
        assert!(error.contains("\"base\"") && error.contains("\"map\"") && error.contains("0.100 s"), "{error}");
        assert!(tree.pose("map", "base", at(70)).is_err());
        assert!(tree.pose("map", "table", at(99_999)).is_ok(), "static");
    }

    #[test]
    fn a_long_silence_is_no_motion() {
        let mut tree = TransformTree::new(0);
        for (milliseconds, x) in [(0, 0.0), (1500, 1.0), (9000, 1.0)] {
            tree.add(transform("map", "base", milliseconds, x, 0.0), Validity::AtStamp).expect("fits");
        }
        assert!(tree.pose("map", "base", at(700)).expect_err("it moved").to_string().contains("1.500 s"));
        assert!(tree.pose("map", "base", at(5000)).is_ok(), "it stood still");
    }

    #[test]
    fn missing_frames_and_links_are_named() {
        let mut tree = cell();
        let unknown = tree.pose("map", "gripper", at(200)).expect_err("unknown").to_string();
        assert!(unknown.contains("\"gripper\"") && unknown.contains("camera"), "{unknown}");
        tree.add(transform("world", "robot", 0, 0.0, 0.0), Validity::Always).expect("another tree");
        let apart = tree.pose("world", "camera", at(200)).expect_err("two trees").to_string();
        assert!(apart.contains("between \"map\" and \"world\""), "{apart}");
        let second = tree.add(transform("table", "camera", 0, 0.0, 0.0), Validity::AtStamp).expect_err("two parents");
        assert!(second.to_string().contains("\"tool\" and \"table\""), "{second}");
        assert!(matches!(
            tree.add(transform("camera", "map", 0, 0.0, 0.0), Validity::AtStamp),
            Err(TransformError::Loop { .. })
        ));
        assert_eq!((tree.root_of("camera"), tree.root_of("nowhere")), ("map", "nowhere"));
    }

    #[test]
    fn a_tree_takes_no_more_frames_than_any_robot_has() {
        let mut tree = TransformTree::new(0);
        let add = |tree: &mut TransformTree, child: usize| {
            tree.add(transform(&format!("{}", child + 1), &format!("{child}"), 0, 0.0, 0.0), Validity::Always)
        };
        assert!((0..MOST_FRAMES).all(|child| add(&mut tree, child).is_ok()));
        assert_eq!(add(&mut tree, MOST_FRAMES), Err(TransformError::TooMany));
        assert!(add(&mut tree, 0).is_ok(), "a frame that is known");
    }

    #[test]
    fn a_fixed_way_is_known_as_such() {
        let mut tree = cell();
        assert!(tree.is_fixed("base", "camera") && !tree.is_fixed("map", "camera"));
        assert!(!tree.is_fixed("table", "camera") && tree.is_fixed("camera", "base"));
        tree.add(transform("camera", "lens", 5, 0.0, 0.0), Validity::AtStampOrAlone).expect("fits");
        assert!(tree.is_fixed("base", "lens") && tree.pose("base", "lens", at(9999)).is_ok(), "published once");
        tree.add(transform("camera", "lens", 6, 0.0, 0.0), Validity::AtStampOrAlone).expect("fits");
        assert!(!tree.is_fixed("base", "lens"));
    }

    proptest! {
        #[test]
        fn any_transforms_make_a_tree_in_which_every_question_is_answered(
            links in prop::collection::vec((0..6_u8, 0..6_u8, any::<i64>(), any::<bool>()), 0..30),
            stamp in any::<i64>(),
        ) {
            let mut tree = TransformTree::new(1000);
            for (parent, child, nanoseconds, is_static) in links {
                let validity = if is_static { Validity::Always } else { Validity::AtStamp };
                let stamped = transform(&parent.to_string(), &child.to_string(), 0, 1.0, 2.0);
                let _ = tree.add(StampedTransform { stamp: Stamp { nanoseconds }, ..stamped }, validity);
            }
            for target in 0..6 {
                for source in 0..6 {
                    let (target, source) = (target.to_string(), source.to_string());
                    if let Ok(pose) = tree.pose(&target, &source, Stamp { nanoseconds: stamp }) {
                        prop_assert!(pose.translation.vector.iter().all(|x| x.is_finite()));
                    }
                    let _ = tree.is_fixed(&target, &source);
                }
            }
        }
    }
}
