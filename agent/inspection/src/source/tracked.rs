//! A moving camera without poses: it is followed frame by frame ([`Tracker`]), and its keyframes go on to be inspected.
//!
//! Every frame is tracked and makes the surface of its keyframe better that the next ones are tracked against. Only keyframes
//! are labelled, registered against the model and fused into it, each with the tracked pose as evidence: the pipeline treats
//! them as the posed views of any other source. The table frame is that of the first view's camera. What a source
//! says of poses itself is not looked at. A frame that is lost is no view; how many were is counted.

use crate::source::{CaptureTrigger, Source, SourceError, SourceInfo, TrueMesh};
use crate::stop::StopSwitch;
use semascan_perception::register::tracking::Tracker;
use semascan_perception::view::{PoseEvidence, View};

const SETTING: &str = "tracking";

/// The keyframes of a source whose camera is tracked.
pub struct TrackedSource {
    source: Box<dyn Source>,
    info: SourceInfo,
    tracker: Tracker,
    counts: Counts,
}

/// What became of the frames.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    frames: u32,
    keyframes: u32,
    lost: u32,
    found_again: u32,
    loops: usize,
}

impl TrackedSource {
    /// Tracks the camera of `source`. How many keyframes there will be is not known before.
    pub fn new(source: Box<dyn Source>) -> Self {
        // Measuring volume and disc are known in the source's own table frame.
        let info = SourceInfo { view_count: None, turntable: None, volume: None, ..source.info().clone() };
        let mut tracked = Self { source, info, tracker: Tracker::default(), counts: Counts::default() };
        tracked.info.settings.push((SETTING.into(), String::new()));
        tracked.note();
        tracked
    }

    /// The record says what became of the frames.
    fn note(&mut self) {
        let Counts { frames, keyframes, lost, found_again, loops } = self.counts;
        if let Some((_, value)) = self.info.settings.iter_mut().find(|(key, _)| key == SETTING) {
            *value = format!(
                "{keyframes} keyframes of {frames} frames, {loops} loops closed; {lost} frames lost, found again {found_again} times"
            );
        }
    }

    /// The view with its tracked pose, if it is a keyframe.
    fn follow(&mut self, view: View) -> Option<View> {
        let tracked = self.tracker.track(&view);
        self.counts.frames += 1;
        self.counts.keyframes += u32::from(tracked.keyframe);
        self.counts.lost += u32::from(tracked.world_from_camera.is_none());
        self.counts.found_again += u32::from(tracked.found_again);
        self.counts.loops += tracked.loops;
        let table_from_camera = tracked.world_from_camera.filter(|_| tracked.keyframe)?;
        Some(View { pose: PoseEvidence::World { table_from_camera, covariance: self.tracker.covariance() }, ..view })
    }
}

impl Source for TrackedSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        loop {
            let next = self.source.next_view();
            self.info.follow_settings(self.source.info());
            let keyframe = match next? {
                Ok(view) => self.follow(view),
                Err(error) => return Some(Err(error)),
            };
            self.note();
            if let Some(view) = keyframe {
                return Some(Ok(view));
            }
        }
    }

    fn rewind(&mut self) -> bool {
        let rewound = self.source.rewind();
        if rewound {
            (self.tracker, self.counts) = (Tracker::default(), Counts::default());
            self.note();
        }
        rewound
    }

    fn end_with(&mut self, stop: &StopSwitch) {
        self.source.end_with(stop);
    }

    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        self.source.capture_trigger()
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::fixtures::Counting;

    #[test]
    fn keyframes_have_tracked_poses_whatever_the_source_says_and_the_rest_is_counted() {
        let mut source = TrackedSource::new(Box::new(Counting::default()));
        let setting = |source: &TrackedSource| {
            source
                .info()
                .settings
                .iter()
                .find(|(key, _)| key == SETTING)
                .map(|(_, value)| value.clone())
                .expect("counted")
        };
        for _ in 0..2 {
            let first = source.next_view().expect("a keyframe").expect("a view");
            // The source says that the camera moves; nothing of the blank wall that it sees does.
            assert_eq!(first.pose.table_from_camera(), Some(nalgebra::Isometry3::identity()));
            assert!(source.next_view().is_none(), "nothing new is seen");
            assert!(setting(&source).starts_with("1 keyframes of 3 frames"), "{}", setting(&source));
            assert_eq!(source.info().settings.iter().filter(|(key, _)| key == Counting::SETTING).count(), 1);
            assert!(source.rewind());
        }
        assert!(setting(&source).starts_with("0 keyframes of 0 frames"), "{}", setting(&source));
    }
}
