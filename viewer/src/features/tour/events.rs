//! What happens to the tour.

/// One thing that happens to the tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TourEvent {
    /// The person has not been here before: it is offered.
    Offered,
    /// It begins.
    Begin,
    /// The step so many places further; behind the last one it ends.
    Step(i32),
    /// It ends, or is not wanted.
    End,
}
