//! What happens to the corrections.

use super::{Corrections, Naming, NoPatch, Patch, Teaching, Tool};
use crate::features::inspect::PickedPoint;
use glam::Vec2;

/// One thing that happens to the corrections.
#[derive(Clone, Debug, PartialEq)]
pub enum CorrectEvent {
    /// The person takes a tool, or lays it down.
    Choose(Option<Tool>),
    /// The person chose the class that the tool in hand gives.
    Name(Naming),
    /// The person chose the radius of the brush, metres.
    Radius(f32),
    /// The brush becomes wider by a step, or narrower.
    Step(i32),
    /// A stroke begins; picks of its places follow.
    Begun {
        /// Number of the stroke, greater than those before.
        number: u32,
    },
    /// A stroke goes through this point, or beside the model.
    Drawn {
        /// Number of the stroke.
        number: u32,
        /// The point.
        point: Option<PickedPoint>,
    },
    /// The stroke of this number is over; picks of it may still come.
    Lifted(u32),
    /// The person clicked with the tool in hand: a dot of the brush, a corner of an outline.
    Dotted(Option<PickedPoint>),
    /// The loop goes on to this place, as a share of the viewport.
    Looped(Vec2),
    /// The loop is closed.
    LoopClosed,
    /// What the tool in hand takes at once.
    Taken(Result<Patch, NoPatch>),
    /// The outline of clicked corners is to be closed.
    Close,
    /// The last mark is taken back.
    Undo,
    /// What was taken back last is there again.
    Redo,
    /// All marks are taken back.
    Discard,
    /// The marks have become reviews.
    Signed,
    /// What people corrected before, as the agent says it.
    Known(Box<Corrections>),
    /// Earlier corrections are shown, or not.
    ShowEarlier(bool),
    /// The person wants to know where a label would teach most, or not any more.
    AskTeaching(bool),
    /// The agent said where.
    Teaching(Box<Teaching>),
    /// The person chose one of these places.
    Teach(usize),
}
