//! What happens to the inspected points.

use super::PickedPoint;

/// One thing that happens to the inspected points.
#[derive(Clone, Debug, PartialEq)]
pub enum InspectEvent {
    /// The person picked this point, or a place where nothing lies.
    Picked(Option<PickedPoint>),
    /// The mouse rests on this point, or on none any more.
    Hovered(Option<PickedPoint>),
    /// The person wants a label at the point of the card.
    Pin,
    /// The person closes the card.
    Close,
    /// The person takes this label away.
    Remove(u32),
    /// The person takes the newest label away.
    RemoveLast,
    /// The person takes all labels away.
    RemoveAll,
    /// The model has changed: what was picked was of the one before.
    Outdated,
}
