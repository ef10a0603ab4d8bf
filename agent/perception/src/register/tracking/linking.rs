//! The ways from earlier keyframes to a new one: those that hold the chain together, and those that close loops (keyframes and loops
//! of [Kerl 2013], section IV). Each is weighed by what surfaces and pictures say of it, in the directions that they say it of.

use super::alignment::{Alignment, Search, align, left_of};
use super::frame::Frame;
use super::graph::Link;
use super::health::Health;
use super::{FOUND, GUESS, LEAST_REACH, LINK_FLOOR, Tracker, WIDE};
use crate::view::covariance_of_prior;
use nalgebra::{Isometry3, Matrix6};

/// Earlier keyframes that a new one is tried to be linked with: by what they show, and by their looks.
const BY_SURFACE: usize = 4;
const BY_LOOKS: usize = 2;
/// Share of a keyframe that another has to show of it to be linked.
const LINKED: f64 = 0.3;
/// Least likeness of the thumbnails of a place that is seen again.
const ALIKE: f32 = 0.55;
/// Least correlation of the pictures of a loop that is closed.
const SURELY_ALIKE: f64 = 0.6;
/// Information of a way that is taken as it is, before [`LINK_FLOOR`].
const STIFF: f64 = 1e12;

impl Tracker {
    /// The ways from earlier keyframes to the frame at `pose` that becomes keyframe `new`: from those that show most of it, and
    /// from those that look alike, each aligned by itself. That from the reference is always there.
    pub(super) fn links(&self, frame: &Frame, pose: &Isometry3<f64>, new: usize, local: &[usize]) -> Vec<Link> {
        let mut candidates: Vec<usize> = self
            .shares(frame, pose, (0..new).collect())
            .into_iter()
            .filter(|(share, i)| *share > LINKED && *i != self.reference)
            .map(|(_, i)| i)
            .take(BY_SURFACE)
            .collect();
        let mut looks: Vec<(f32, usize)> = self
            .places
            .iter()
            .filter(|place| place.at.keyframe != self.reference && !local.contains(&place.at.keyframe))
            .map(|place| (frame.thumbnail.alike(&place.thumbnail), place.at.keyframe))
            .filter(|(alike, _)| *alike > ALIKE)
            .collect();
        looks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        looks.dedup_by_key(|(_, keyframe)| *keyframe);
        candidates.extend(looks.into_iter().map(|(_, keyframe)| keyframe).take(BY_LOOKS));
        candidates.sort_unstable();
        candidates.dedup();
        // That from the reference holds the chain together: where it leaves a direction open, the pose stands that was found among all.
        let of_reference = self.measured(frame, pose, self.reference, true).filter(|found| found.left_open == 0);
        let mut links = vec![match &of_reference {
            Some(found) => self.link(self.reference, new, found),
            None => self.link_of(self.reference, new, pose, &(Matrix6::identity() * STIFF)),
        }];
        for earlier in candidates {
            if let Some(found) = self.measured(frame, pose, earlier, local.contains(&earlier)) {
                links.push(self.link(earlier, new, &found));
            }
        }
        links
    }

    /// Aligns a frame at about `pose` with one earlier keyframe; `None` where the two are not sure to show the same place.
    fn measured(&self, frame: &Frame, pose: &Isometry3<f64>, earlier: usize, is_local: bool) -> Option<Alignment> {
        let (rotation, translation) = GUESS;
        let reach = if is_local { LEAST_REACH } else { WIDE } * frame.centre.z;
        let search = Search { start: *pose, covariance: covariance_of_prior(rotation, translation), reach };
        let found = align(frame, &[self.keyframes[earlier].target()], &search)?;
        let health = Health::of(&found, frame.centre.z).ok()?;
        // A loop that is none costs more than one that is missed.
        let is_sure = health.overlap > FOUND && health.alike.is_some_and(|alike| alike > SURELY_ALIKE);
        (is_local || is_sure).then_some(found)
    }

    /// The way from keyframe `earlier` to the frame that becomes keyframe `new`, which was found at `world_from_new`. `data` is
    /// the inverse covariance, singular where something is left open.
    fn link_of(&self, earlier: usize, new: usize, world_from_new: &Isometry3<f64>, data: &Matrix6<f64>) -> Link {
        let floor = covariance_of_prior(LINK_FLOOR.0, LINK_FLOOR.1);
        let information = left_of(data, &floor) * data;
        let information = 0.5 * (information + information.transpose());
        Link { a: earlier, b: new, a_from_b: self.keyframes[earlier].pose().inverse() * world_from_new, information }
    }

    fn link(&self, earlier: usize, new: usize, found: &Alignment) -> Link {
        self.link_of(earlier, new, &found.world_from_camera, &found.information)
    }
}
