//! What happens to the timeline.

use crate::link::player::Stop;

/// One thing that happens to the timeline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TimelineEvent {
    /// The person wants the inspection that the agent keeps to be played.
    Requested,
    /// It cannot be had.
    NotLoaded,
    /// An inspection is there, with these stops; its end is shown.
    Loaded(Vec<Stop>),
    /// What is shown has no timeline.
    Closed,
    /// The person wants to see this stop.
    To(usize),
    /// The person wants to see the stop so many places further.
    Step(i32),
    /// Play on from what is shown, from the beginning if that is the end; or stop.
    Play(bool),
    /// It is time for the next stop.
    Advanced,
}
