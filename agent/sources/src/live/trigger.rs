//! When a pair of a stream becomes a view: always, where the camera rests at another place, every so many seconds, when a message
//! comes on a topic, or when it is asked for. What is asked for by a [`CaptureTrigger`] is taken whatever the rule is.

use super::LiveAddress;
use crate::messages::Stamp;
use crate::recording::RecordingOptions;
use nalgebra::Isometry3;
use semascan_inspection::source::CaptureTrigger;
use std::time::{Duration, Instant};

/// How far a camera that rests moves: metres and radians.
const REST: (f64, f64) = (2e-4, 5e-4);

/// The rule by which pairs become views.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// Every pair that is far enough from the last one.
    Every,
    /// Those where the camera rests at another place.
    Still,
    /// One in so much time, by the pictures' stamps.
    Period(Duration),
    /// The one after a message of a topic, whatever that says.
    Topic(String),
    /// Those alone that are asked for.
    Asked,
}

/// How rules are written.
const TRIGGERS: &str = "every, still, period:SECONDS, topic:/NAME, asked";

impl Trigger {
    /// Reads a rule: `every`, `still`, `period:SECONDS`, `topic:/NAME` or `asked`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(text: &str) -> Result<Self, String> {
        let refuse = |reason: &str| Err(format!("trigger={text}: {reason}"));
        match text.split_once(':').unwrap_or((text, "")) {
            ("every", "") => Ok(Self::Every),
            ("still", "") => Ok(Self::Still),
            ("asked", "") => Ok(Self::Asked),
            ("period", seconds) => match seconds.parse::<f64>() {
                Ok(seconds) if (1e-3..=3600.0).contains(&seconds) => Ok(Self::Period(Duration::from_secs_f64(seconds))),
                _ => refuse("the period is a number of seconds, from 0.001 to 3600"),
            },
            ("topic", topic) if topic.len() > 1 && topic.starts_with('/') => Ok(Self::Topic(topic.to_owned())),
            ("topic", _) => refuse("a topic begins with /"),
            _ => refuse(&format!("is none of {TRIGGERS}")),
        }
    }

    /// Whether a pair of which the pose is unknown can be told to be one: without poses nothing is known of rest.
    pub(super) fn needs_poses(&self) -> bool {
        *self == Self::Still
    }
}

/// A pair that may become a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate<'a> {
    pub(super) stamp: Stamp,
    /// When its pictures had come.
    pub(super) arrived: Instant,
    pub(super) table_from_camera: Option<&'a Isometry3<f64>>,
}

/// Decides which pairs become views.
#[derive(Debug)]
pub(super) struct Selection {
    trigger: Trigger,
    asked: CaptureTrigger,
    options: RecordingOptions,
    /// The last view that was taken, and the one before it.
    last: [Option<Taken>; 2],
}

#[derive(Clone, Copy, Debug)]
struct Taken {
    stamp: Stamp,
    table_from_camera: Option<Isometry3<f64>>,
    was_asked: bool,
}

impl Selection {
    /// As `address` says; views can be asked for by `asked`, too.
    pub(super) fn new(address: &LiveAddress, asked: CaptureTrigger) -> Self {
        Self { trigger: address.trigger.clone(), asked, options: address.recording.clone(), last: [None; 2] }
    }

    /// Whether a pair becomes a view; `earlier` tells where the camera was as long before as it has to rest.
    pub(super) fn takes(&mut self, candidate: Candidate<'_>, earlier: impl FnOnce() -> Option<Isometry3<f64>>) -> bool {
        let was_asked = self.asked.is_answered_at(candidate.arrived);
        let is_taken = was_asked || self.is_step(candidate) && self.follows_rule(candidate, earlier);
        if is_taken {
            let Candidate { stamp, table_from_camera, .. } = candidate;
            let taken = Taken { stamp, table_from_camera: table_from_camera.copied(), was_asked };
            self.last = [Some(taken), self.last[0]];
        }
        is_taken
    }

    /// Forgets the last view, which is none: another one of the same place, or for the same request, is taken in its stead.
    pub(super) fn take_again(&mut self) {
        let [last, before] = self.last;
        if last.is_some_and(|last| last.was_asked) {
            self.asked.ask();
        }
        self.last = [before, None];
    }

    fn follows_rule(&self, candidate: Candidate<'_>, earlier: impl FnOnce() -> Option<Isometry3<f64>>) -> bool {
        match &self.trigger {
            Trigger::Every => true,
            Trigger::Asked | Trigger::Topic(_) => false,
            // A clock that was set back must not stop the views.
            Trigger::Period(period) => {
                self.last[0].is_none_or(|last| u128::from(last.stamp.distance(candidate.stamp)) >= period.as_nanos())
            }
            Trigger::Still => candidate.table_from_camera.zip(earlier()).is_some_and(|(pose, earlier)| {
                let way = earlier.inverse() * pose;
                way.translation.vector.norm() <= REST.0 && way.rotation.angle() <= REST.1
            }),
        }
    }

    /// Whether the camera has moved as far as is asked for since the last view.
    fn is_step(&self, candidate: Candidate<'_>) -> bool {
        let last = self.last[0].and_then(|last| last.table_from_camera);
        last.zip(candidate.table_from_camera).is_none_or(|(last, pose)| self.options.is_step(&last, pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn selection(query: &str) -> (Selection, CaptureTrigger) {
        let asked = CaptureTrigger::default();
        let address = LiveAddress::read(&format!("ws://a?{query}")).expect("an address");
        (Selection::new(&address, asked.clone()), asked)
    }

    /// Places along x of a camera, a pair each half second, of which these are taken.
    fn taken(query: &str, places: &[f64]) -> Vec<usize> {
        let (mut selection, _) = selection(query);
        let pose = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let takes = |i: &usize| {
            let earlier = i.checked_sub(1).map(|before| pose(places[before]));
            let at = pose(places[*i]);
            let stamp = Stamp { nanoseconds: *i as i64 * 500_000_000 };
            let candidate = Candidate { stamp, arrived: Instant::now(), table_from_camera: Some(&at) };
            selection.takes(candidate, || earlier)
        };
        (0..places.len()).filter(takes).collect()
    }

    #[test]
    fn views_are_taken_where_the_camera_rests_at_another_place() {
        let places = [0.0, 0.0, 0.0, 0.004, 0.05, 0.1, 0.1, 0.1001, 0.2, 0.2];
        assert_eq!(taken("trigger=still", &places), [1, 6, 9]);
        assert_eq!(taken("", &places).len(), places.len());
        assert_eq!(taken("shift_mm=60", &places), [0, 5, 8]);
        assert_eq!(taken("trigger=period:1", &places), [0, 2, 4, 6, 8]);
        assert_eq!(taken("trigger=period:1&shift_mm=60", &places), [0, 5, 8]);
        assert!(taken("trigger=asked", &places).is_empty() && taken("trigger=topic:/go", &places).is_empty());
    }

    #[test]
    fn without_poses_there_is_no_rest_and_what_is_asked_for_is_taken_all_the_same() {
        let candidate = || Candidate { stamp: Stamp::default(), arrived: Instant::now(), table_from_camera: None };
        let (mut waits, _) = selection("trigger=still");
        assert!(!waits.takes(candidate(), || None));
        let (mut takes_all, _) = selection("");
        assert!(takes_all.takes(candidate(), || None));
        for query in ["trigger=still", "trigger=asked", "trigger=topic:/go", "trigger=period:10"] {
            let (mut selection, asked) = selection(query);
            let earlier = candidate();
            asked.ask();
            assert_eq!(selection.takes(earlier, || None), query.contains("period"), "{query}: it came before");
            assert!(selection.takes(candidate(), || None), "{query}");
            assert!(!selection.takes(candidate(), || None), "{query}: once");
            selection.take_again();
            assert!(selection.takes(candidate(), || None), "{query}: the view was none");
        }
    }

    #[test]
    fn rules_are_read_and_what_is_none_is_refused() {
        assert_eq!(Trigger::read("period:0.5"), Ok(Trigger::Period(Duration::from_millis(500))));
        assert_eq!(Trigger::read("topic:/cell/capture"), Ok(Trigger::Topic("/cell/capture".into())));
        for wrong in ["", "noise", "every:1", "period:", "period:0", "period:nan", "topic:capture", "topic:/"] {
            assert!(Trigger::read(wrong).expect_err(wrong).contains("trigger="), "{wrong}");
        }
    }
}
