//! The views that are refined together, of which there are never more than a fixed number: memory and time of the joint
//! refinement do not grow with the length of a recording.
//!
//! A handheld camera delivers hundreds of views that see nearly the same. Of these the most redundant are dropped, and
//! each follows the kept view next to it: it keeps its pose relative to it, as views follow their keyframe in
//! [Mur-Artal 2017].

use super::joint_refinement::{JointConfig, JointRefinement, RefinedView, refine};
use super::se3::adjoint;
use nalgebra::{Isometry3, Matrix6};

/// Most views that are refined together; a turn of a turntable has fewer.
const MOST_VIEWS: usize = 64;

/// An accepted view.
#[derive(Debug)]
struct Member {
    /// `table_from_camera` before the refinement.
    pose: Isometry3<f64>,
    /// Covariance of the way from the model to the view, over (rotation, translation), camera frame.
    registered: Matrix6<f64>,
    /// The kept view, by its place among the members, that it follows; its own place if it is kept.
    follows: usize,
}

/// A view that is kept for the refinement.
#[derive(Debug)]
struct Kept {
    /// Its place among the members.
    member: usize,
    view: RefinedView,
}

/// Accepted views, in order: some kept for the refinement, the others following them.
#[derive(Debug)]
pub(super) struct RefinementSet {
    most: usize,
    members: Vec<Member>,
    /// In order.
    kept: Vec<Kept>,
}

impl Default for RefinementSet {
    fn default() -> Self {
        Self::holding(MOST_VIEWS)
    }
}

impl RefinementSet {
    /// A set that keeps at most `most` views, at least two.
    fn holding(most: usize) -> Self {
        Self { most: most.max(2), members: Vec::new(), kept: Vec::new() }
    }

    /// The first view, which says where the model stands.
    pub(super) fn first(&self) -> Option<&RefinedView> {
        self.kept().next()
    }

    /// The views that are kept, in order.
    pub(super) fn kept(&self) -> impl Iterator<Item = &RefinedView> {
        self.kept.iter().map(|kept| &kept.view)
    }

    /// Adds the next view.
    pub(super) fn push(&mut self, view: RefinedView) {
        let member = self.members.len();
        let (pose, registered) = (view.surface.table_from_camera, view.registered);
        self.members.push(Member { pose, registered, follows: member });
        self.kept.push(Kept { member, view });
        if self.kept.len() > self.most {
            self.drop_the_most_redundant();
        }
    }

    /// Of the two kept views that are nearest to each other, the one that is nearer to a third is dropped.
    fn drop_the_most_redundant(&mut self) {
        // The two nearest neighbours of each but the first view, which stays.
        let mut nearest: Vec<(f64, f64, usize)> = Vec::with_capacity(self.kept.len());
        for (i, kept) in self.kept.iter().enumerate().skip(1) {
            let mut distances: Vec<f64> = self.kept.iter().map(|other| kept.view.distance_to(&other.view)).collect();
            distances.swap_remove(i);
            distances.sort_unstable_by(f64::total_cmp);
            nearest.push((distances[0], distances.get(1).copied().unwrap_or(f64::INFINITY), i));
        }
        let by_distance = |a: &(f64, f64, usize), b: &(f64, f64, usize)| {
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
        };
        let Some(&(_, _, dropped)) = nearest.iter().min_by(|a, b| by_distance(a, b)) else { return };
        let Kept { member: dropped, view } = self.kept.remove(dropped);
        let distance = |kept: &&Kept| kept.view.distance_to(&view);
        let Some(next) = self.kept.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else { return };
        let next = next.member;
        for member in self.members.iter_mut().filter(|member| member.follows == dropped) {
            member.follows = next;
        }
    }

    /// Refines the kept views together and moves the others with them; as [`refine`], poses of all members in order.
    pub(super) fn refine(&self, config: &JointConfig) -> Option<JointRefinement> {
        let views: Vec<&RefinedView> = self.kept.iter().map(|kept| &kept.view).collect();
        let refined = refine(&views, config)?;
        let mut poses: Vec<Isometry3<f64>> = self.members.iter().map(|member| member.pose).collect();
        let mut covariances = vec![Matrix6::zeros(); poses.len()];
        for (kept, (pose, covariance)) in
            self.kept.iter().zip(refined.table_from_camera.iter().zip(&refined.covariances))
        {
            (poses[kept.member], covariances[kept.member]) = (*pose, *covariance);
        }
        for (i, member) in self.members.iter().enumerate().filter(|(i, member)| member.follows != *i) {
            let kept_from_camera = self.members[member.follows].pose.inverse() * member.pose;
            poses[i] = poses[member.follows] * kept_from_camera;
            // Both ends of the way between the two views are as uncertain as they were registered.
            let carry = adjoint(&kept_from_camera.inverse());
            let kept = covariances[member.follows] + self.members[member.follows].registered;
            covariances[i] = carry * kept * carry.transpose() + member.registered;
        }
        Some(JointRefinement { table_from_camera: poses, covariances, ..refined })
    }
}

#[cfg(test)]
mod tests {
    use super::super::joint_refinement::tests::{above, view};
    use super::*;

    /// Four views at each of three places along a table.
    #[test]
    fn views_that_are_not_kept_follow_one_that_is() {
        let mut set = RefinementSet::holding(3);
        let places: Vec<f64> = (0..12).map(|i| 0.05 * f64::from(i / 4) + 0.0005 * f64::from(i % 4)).collect();
        for (i, x) in places.iter().enumerate() {
            // All views of the second place are off together, as drift is.
            let error = if i / 4 == 1 { 0.002 } else { 0.0 };
            set.push(view(&above(*x), &above(x + error), 1.0));
        }
        assert_eq!(set.kept.len(), 3);
        let mut kept: Vec<usize> = set.kept.iter().map(|kept| kept.member / 4).collect();
        kept.dedup();
        assert_eq!(kept, [0, 1, 2], "one view of each place is kept");
        assert_eq!(set.kept[0].member, 0, "the first view stays");
        let refined = set.refine(&JointConfig { weakest: 2e-3, same_label: false }).expect("refined");
        assert_eq!(refined.table_from_camera.len(), 12);
        for (i, pose) in refined.table_from_camera.iter().enumerate() {
            let found = refined.table_from_camera[0].inverse() * pose;
            let true_way = above(places[0]).inverse() * above(places[i]);
            let error = (found.translation.vector - true_way.translation.vector).norm();
            assert!(error < 4e-4, "view {i} is {error} m off");
        }
    }
}
