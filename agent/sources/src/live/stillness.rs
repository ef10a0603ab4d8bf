//! When a view is taken of a stream: every pair that is far enough from the last one, or where the camera rests, too.

use super::LiveAddress;
use crate::recording::RecordingOptions;
use nalgebra::Isometry3;

/// How far a camera that rests moves: metres and radians.
const REST: (f64, f64) = (2e-4, 5e-4);

/// What has been taken, and what is asked for.
#[derive(Clone, Debug)]
pub(super) struct Stillness {
    waits_for_rest: bool,
    options: RecordingOptions,
    last: Option<Isometry3<f64>>,
}

impl Stillness {
    pub(super) fn new(address: &LiveAddress) -> Self {
        Self { waits_for_rest: address.waits_for_rest, options: address.recording.clone(), last: None }
    }

    /// Whether a pair becomes a view that was taken at a pose; `earlier` tells where the camera was as long before as it has to
    /// rest. Without poses nothing is known of motion: where rest is waited for, no pair is taken then, and else every one.
    pub(super) fn takes(
        &mut self,
        table_from_camera: Option<&Isometry3<f64>>,
        earlier: impl FnOnce() -> Option<Isometry3<f64>>,
    ) -> bool {
        let Some(pose) = table_from_camera else { return !self.waits_for_rest };
        if self.last.is_some_and(|last| !self.options.is_step(&last, pose)) {
            return false;
        }
        if self.waits_for_rest {
            let rests = earlier().is_some_and(|earlier| {
                let way = earlier.inverse() * pose;
                way.translation.vector.norm() <= REST.0 && way.rotation.angle() <= REST.1
            });
            if !rests {
                return false;
            }
        }
        self.last = Some(*pose);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places along x of a camera, a pair each, of which these are taken.
    fn taken(query: &str, places: &[f64]) -> Vec<usize> {
        let mut stillness = Stillness::new(&LiveAddress::read(&format!("ws://a?{query}")).expect("an address"));
        let pose = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let takes = |i: &usize| {
            let earlier = i.checked_sub(1).map(|before| pose(places[before]));
            stillness.takes(Some(&pose(places[*i])), || earlier)
        };
        (0..places.len()).filter(takes).collect()
    }

    #[test]
    fn views_are_taken_where_the_camera_rests_at_another_place() {
        let places = [0.0, 0.0, 0.0, 0.004, 0.05, 0.1, 0.1, 0.1001, 0.2, 0.2];
        assert_eq!(taken("trigger=still", &places), [1, 6, 9]);
        assert_eq!(taken("", &places).len(), places.len());
        assert_eq!(taken("shift_mm=60", &places), [0, 5, 8]);
    }

    #[test]
    fn without_poses_there_is_no_rest() {
        let mut waits = Stillness::new(&LiveAddress::read("ws://a?trigger=still").expect("an address"));
        assert!(!waits.takes(None, || None));
        let mut takes_all = Stillness::new(&LiveAddress::read("ws://a").expect("an address"));
        assert!(takes_all.takes(None, || None));
    }
}
