//! What happens to the measurements.

use super::Kind;
use crate::features::inspect::PickedPoint;
use semascan_model::LengthUnit;

/// One thing that happens to the measurements.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasureEvent {
    /// The person begins to measure this, or to measure nothing; points picked so far are dropped.
    Choose(Option<Kind>),
    /// The person picked this point, or a place where nothing lies.
    Picked(Option<PickedPoint>),
    /// The person takes back the last point, or ends measuring where there is none.
    Back,
    /// The person takes this measurement away.
    Remove(u32),
    /// The person takes the newest measurement away.
    RemoveLast,
    /// The person takes all measurements away.
    RemoveAll,
    /// The person chose the unit of lengths.
    Unit(LengthUnit),
    /// The model has changed: what was measured was the one before.
    Outdated,
}
