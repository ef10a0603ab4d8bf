//! Which stops the inspection has, and which is shown.

use super::TimelineEvent;
use crate::display::Display;
use crate::features::Feature;
use crate::link::player::Stop;
use crate::words::t;

/// The timeline of what is shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Timeline {
    /// The stops in their order; none where nothing is played.
    pub stops: Vec<Stop>,
    /// Place of the one that is shown.
    pub at: usize,
    /// Whether it goes on by itself.
    pub is_playing: bool,
    /// Whether the agent was asked for the inspection and has not answered.
    pub is_loading: bool,
}

impl Timeline {
    /// Whether there is something to be played.
    pub fn is_open(&self) -> bool {
        !self.stops.is_empty()
    }

    /// Place of the last stop.
    pub fn last(&self) -> usize {
        self.stops.len().saturating_sub(1)
    }

    /// What is shown, in words.
    pub fn place(&self) -> String {
        let most = self.stops.last().map_or(0, |stop| stop.views);
        match self.stops.get(self.at).map_or(0, |stop| stop.views) {
            0 => t!("timeline.before").into(),
            _ if self.at == self.last() => t!("timeline.after_all", count = most),
            views => t!("timeline.after", views, most),
        }
    }
}

impl Feature for Timeline {
    type Event = TimelineEvent;

    fn reduce(&mut self, event: &TimelineEvent, _: &mut Display) {
        match event {
            TimelineEvent::Requested => self.is_loading = true,
            TimelineEvent::NotLoaded => self.is_loading = false,
            TimelineEvent::Loaded(stops) => {
                let at = stops.len().saturating_sub(1);
                *self = Self { stops: stops.clone(), at, ..Self::default() };
            }
            TimelineEvent::Closed => *self = Self::default(),
            TimelineEvent::To(place) => {
                self.at = (*place).min(self.last());
                self.is_playing = false;
            }
            TimelineEvent::Step(step) => {
                let step = isize::try_from(*step).unwrap_or_default();
                self.at = self.at.saturating_add_signed(step).min(self.last());
                self.is_playing = false;
            }
            TimelineEvent::Play(is_playing) => {
                self.is_playing = *is_playing && self.stops.len() > 1;
                if self.is_playing && self.at == self.last() {
                    self.at = 0;
                }
            }
            TimelineEvent::Advanced if self.is_playing => {
                self.at = (self.at + 1).min(self.last());
                self.is_playing = self.at < self.last();
            }
            TimelineEvent::Advanced => {}
        }
    }
    // A model that begins is as often another stop of the same inspection.
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::player::stops;
    use TimelineEvent::{Advanced, Closed, Loaded, Play, Step, To};
    use semascan_protocol::FileMessage;

    /// After no view, and after each of three.
    fn loaded() -> TimelineEvent {
        let message = |views| FileMessage { views, ..FileMessage::default() };
        Loaded(stops(&(0..4).map(message).collect::<Vec<_>>()))
    }

    fn after(events: impl IntoIterator<Item = TimelineEvent>) -> (usize, bool, String) {
        let mut timeline = Timeline::default();
        events.into_iter().for_each(|event| timeline.reduce(&event, &mut Display::default()));
        (timeline.at, timeline.is_playing, timeline.place())
    }

    #[test]
    fn the_end_is_shown_first_and_stops_are_stepped_through() {
        assert_eq!(after([loaded()]), (3, false, "After all 3 views".into()));
        assert_eq!(after([loaded(), Step(-1)]), (2, false, "After view 2 of 3".into()));
        assert_eq!(after([loaded(), Step(-9), Step(-1)]), (0, false, "Before the first view".into()));
        assert_eq!(after([loaded(), To(9), Step(i32::MAX)]).0, 3);
    }

    #[test]
    fn it_plays_from_the_beginning_to_the_end() {
        assert_eq!(after([loaded(), Play(true)]), (0, true, "Before the first view".into()));
        assert_eq!(after([loaded(), Play(true), Advanced, Advanced]), (2, true, "After view 2 of 3".into()));
        assert!(!after([loaded(), Play(true), Advanced, Advanced, Advanced]).1, "it has ended");
        assert_eq!(after([loaded(), To(1), Play(true)]).0, 1, "from what is shown");
        assert_eq!(after([loaded(), Play(true), Play(false), Advanced]), (0, false, "Before the first view".into()));
        assert_eq!(after([loaded(), Play(true), To(2), Advanced]), (2, false, "After view 2 of 3".into()));
    }

    #[test]
    fn without_stops_there_is_nothing_to_play() {
        assert_eq!(after([Play(true), Advanced, Step(1), To(4)]).0, 0);
        let mut timeline = Timeline::default();
        for event in [loaded(), Play(true), Closed] {
            timeline.reduce(&event, &mut Display::default());
        }
        assert_eq!(timeline, Timeline::default());
    }
}
