//! Keyframes: of a camera that moves all the time, the views worth inspecting ([Wang 2023], "Method of generating
//! semantic point clouds for keyframes").
//!
//! A view is skipped where the camera has hardly moved since a keyframe, taken where it has moved far (labels gain from
//! another angle), and in between taken if enough of what it shows was in none of the last keyframes. The paper names
//! no rule; this is the overlap test of keyframe-based mapping [Mur-Artal 2017] on depth. What is skipped is counted,
//! and a view without a pose or that cannot be read is passed on: others judge that.

use crate::planning::SteeredCamera;
use crate::source::{CaptureTrigger, Source, SourceError, SourceInfo, TrueMesh};
use crate::stop::StopSwitch;
use nalgebra::{Isometry3, Point3};
use semascan_perception::view::{DepthImage, Intrinsics, View};
use std::collections::VecDeque;
use std::sync::Arc;

/// Keyframes that a view is compared with.
const REMEMBERED: usize = 8;
/// Every so many columns and rows of a view are looked up in the keyframes.
const STRIDE: u32 = 12;
/// Depths that differ by less show the same surface: metres, and a share of the depth.
const SAME_SURFACE: (f64, f64) = (0.004, 0.01);

/// When a view is a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeRule {
    /// Motion since the nearest keyframe below which a view brings nothing: metres of the camera's centre.
    pub least_shift: f64,
    /// The same in radians.
    pub least_turn: f64,
    /// Motion that makes a keyframe whatever is seen: metres.
    pub far_shift: f64,
    /// The same in radians.
    pub far_turn: f64,
    /// Largest share of a keyframe's points that the last keyframes show already.
    pub most_overlap: f64,
}

impl Default for KeyframeRule {
    fn default() -> Self {
        Self { least_shift: 0.01, least_turn: 0.03, far_shift: 0.25, far_turn: 0.5, most_overlap: 0.8 }
    }
}

/// A source of which only the keyframes come through.
pub struct Keyframes {
    source: Box<dyn Source>,
    info: SourceInfo,
    rule: KeyframeRule,
    last: VecDeque<Keyframe>,
    seen: u32,
    taken: u32,
    /// Views that were taken because nothing is known of where they were.
    without_pose: u32,
}

/// What is remembered of a keyframe.
struct Keyframe {
    intrinsics: Intrinsics,
    depth: Arc<DepthImage>,
    table_from_camera: Isometry3<f64>,
}

impl Keyframes {
    /// The keyframes of `source`. How many there will be is not known before.
    pub fn new(source: Box<dyn Source>, rule: KeyframeRule) -> Self {
        let info = SourceInfo { view_count: None, ..source.info().clone() };
        let mut keyframes = Self { source, info, rule, last: VecDeque::new(), seen: 0, taken: 0, without_pose: 0 };
        keyframes.info.settings.push((SETTING.into(), String::new()));
        keyframes.note();
        keyframes
    }

    /// The record says how many views there were.
    fn note(&mut self) {
        if let Some((_, value)) = self.info.settings.iter_mut().find(|(key, _)| key == SETTING) {
            *value = format!("{} of {} views", self.taken, self.seen);
            if self.without_pose > 0 {
                *value += &format!(" ({} have no pose and cannot be judged: they are kept)", self.without_pose);
            }
        }
    }

    /// Whether `view`, taken from `pose`, is worth inspecting.
    fn wanted(&self, view: &View, pose: &Isometry3<f64>) -> bool {
        let rule = &self.rule;
        let moved = |k: &Keyframe| {
            let way = k.table_from_camera.inverse() * pose;
            (way.translation.vector.norm(), way.rotation.angle())
        };
        let motions: Vec<(f64, f64)> = self.last.iter().map(moved).collect();
        if motions.iter().any(|(shift, turn)| *shift < rule.least_shift && *turn < rule.least_turn) {
            return false;
        }
        let far = motions.iter().all(|(shift, turn)| *shift > rule.far_shift || *turn > rule.far_turn);
        far || self.overlap(view, pose) <= rule.most_overlap
    }

    /// Share of the view's points that a keyframe shows at the same depth; 0 without depth.
    fn overlap(&self, view: &View, pose: &Isometry3<f64>) -> f64 {
        let (mut points, mut known) = (0_u32, 0_u32);
        for v in (STRIDE / 2..view.depth.height).step_by(STRIDE as usize) {
            for u in (STRIDE / 2..view.depth.width).step_by(STRIDE as usize) {
                let Some(z) = view.depth.at(u, v) else { continue };
                let point = pose * view.intrinsics.unproject(u.into(), v.into(), z.into());
                points += 1;
                known += u32::from(self.last.iter().any(|keyframe| keyframe.shows(&point)));
            }
        }
        if points == 0 { 0.0 } else { f64::from(known) / f64::from(points) }
    }
}

const SETTING: &str = "keyframes";

impl Keyframe {
    /// Whether `point` (table frame) lies on the surface that the keyframe shows there.
    fn shows(&self, point: &Point3<f64>) -> bool {
        let p = self.table_from_camera.inverse() * point;
        let Some((u, v)) = self.intrinsics.project(&p) else { return false };
        let (u, v) = (u.round(), v.round());
        let inside = u >= 0.0 && v >= 0.0 && u < f64::from(self.depth.width) && v < f64::from(self.depth.height);
        let seen = if inside { self.depth.at(u as u32, v as u32) } else { None };
        seen.is_some_and(|z| (f64::from(z) - p.z).abs() < SAME_SURFACE.0 + SAME_SURFACE.1 * p.z)
    }
}

impl Source for Keyframes {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        loop {
            let next = self.source.next_view();
            self.info.follow_settings(self.source.info());
            let next = next?;
            self.seen += 1;
            let pose = next.as_ref().ok().and_then(|view| view.pose.table_from_camera());
            let wanted = match (&next, &pose) {
                (Ok(view), Some(pose)) => self.wanted(view, pose),
                _ => true,
            };
            self.taken += u32::from(wanted);
            self.without_pose += u32::from(next.is_ok() && pose.is_none());
            self.note();
            if !wanted {
                continue;
            }
            if let (Ok(view), Some(table_from_camera)) = (&next, pose) {
                if self.last.len() == REMEMBERED {
                    self.last.pop_front();
                }
                let (intrinsics, depth) = (view.intrinsics, view.depth.clone());
                self.last.push_back(Keyframe { intrinsics, depth, table_from_camera });
            }
            return Some(next);
        }
    }

    fn end_with(&mut self, stop: &StopSwitch) {
        self.source.end_with(stop);
    }

    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        self.source.capture_trigger()
    }

    fn steered(&mut self) -> Option<&mut dyn SteeredCamera> {
        self.source.steered()
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use nalgebra::Vector3;
    use semascan_model::Taxonomy;
    use semascan_perception::view::{PoseEvidence, covariance_of_prior};

    /// A wall at 0.5 m, seen by a camera that goes along it; poses from `shifts` (metres), `None` without a pose.
    struct Wall {
        info: SourceInfo,
        shifts: Vec<Option<f64>>,
        next: usize,
    }

    impl Source for Wall {
        fn info(&self) -> &SourceInfo {
            &self.info
        }

        fn next_view(&mut self) -> Option<Result<View, SourceError>> {
            let shift = *self.shifts.get(self.next)?;
            let index = self.next as u32;
            self.next += 1;
            let intrinsics = Intrinsics { width: 96, height: 72, fx: 80.0, fy: 80.0, cx: 47.5, cy: 35.5 };
            let pose = shift.map_or(PoseEvidence::None, |x| PoseEvidence::World {
                table_from_camera: Isometry3::translation(x, 0.0, 0.0),
                covariance: covariance_of_prior(0.01, 0.001),
            });
            Some(Ok(View {
                index,
                stamp: None,
                intrinsics,
                rgb: Arc::new(RgbImage::new(96, 72)),
                depth: Arc::new(DepthImage { width: 96, height: 72, metres: vec![0.5; 96 * 72] }),
                pose,
                labels: None,
                truth: None,
            }))
        }
    }

    fn keyframes(shifts: Vec<Option<f64>>, rule: KeyframeRule) -> (Vec<u32>, String) {
        let info = SourceInfo {
            uri: "wall".into(),
            part: "wall".into(),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: Some(shifts.len() as u32),
            turntable: None,
            volume: None,
            no_labels: None,
            settings: Vec::new(),
        };
        let mut source = Keyframes::new(Box::new(Wall { info, shifts, next: 0 }), rule);
        let mut taken = Vec::new();
        while let Some(view) = source.next_view() {
            taken.push(view.expect("a view").index);
        }
        (taken, source.info().settings.first().expect("the count").1.clone())
    }

    #[test]
    fn a_moving_camera_gives_a_keyframe_when_a_fifth_of_the_picture_is_new() {
        // The picture is 0.6 m wide at the wall: a fifth is 0.12 m.
        let rule = KeyframeRule { far_shift: 9.0, ..KeyframeRule::default() };
        let (taken, count) = keyframes((0..60).map(|i| Some(f64::from(i) * 0.01)).collect(), rule);
        assert!(taken.windows(2).all(|w| (11..=13).contains(&(w[1] - w[0]))), "{taken:?}");
        assert_eq!(count, format!("{} of 60 views", taken.len()));
    }

    #[test]
    fn a_camera_that_stands_still_gives_one_and_one_that_comes_back_none_more() {
        let shifts = [0.0, 0.001, 0.002, 0.2, 0.201, 0.003, 0.199];
        let (taken, _) = keyframes(shifts.map(Some).to_vec(), KeyframeRule::default());
        assert_eq!(taken, [0, 3]);
    }

    #[test]
    fn far_motion_and_unknown_poses_pass() {
        let rule = KeyframeRule { most_overlap: 0.0, ..KeyframeRule::default() };
        let (taken, count) = keyframes(vec![Some(0.0), None, Some(0.1), Some(0.3), None], rule);
        assert_eq!(taken, [0, 1, 3, 4]);
        assert_eq!(count, "4 of 5 views (2 have no pose and cannot be judged: they are kept)");
    }

    #[test]
    fn a_turned_camera_sees_something_new() {
        let turned = Isometry3::new(Vector3::zeros(), Vector3::new(0.0, 0.9, 0.0));
        let keyframe = Keyframe {
            intrinsics: Intrinsics { width: 96, height: 72, fx: 80.0, fy: 80.0, cx: 47.5, cy: 35.5 },
            depth: Arc::new(DepthImage { width: 96, height: 72, metres: vec![0.5; 96 * 72] }),
            table_from_camera: Isometry3::identity(),
        };
        assert!(keyframe.shows(&Point3::new(0.05, 0.02, 0.5)));
        assert!(!keyframe.shows(&Point3::new(0.05, 0.02, 0.45)), "before the wall");
        assert!(!keyframe.shows(&(turned * Point3::new(0.0, 0.0, 0.5))), "beside the picture");
        assert!(!keyframe.shows(&Point3::new(0.0, 0.0, -0.5)), "behind the camera");
    }
}
