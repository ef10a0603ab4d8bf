//! What happens to the measurements.

use super::{Kind, Taken};
use crate::features::inspect::PickedPoint;
use semascan_model::LengthUnit;
use semascan_model::measurement::KeptMeasurement;
use semascan_model::review::ReviewId;

/// One thing that happens to the measurements.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasureEvent {
    /// The person begins to measure this, or to measure nothing; what was picked so far is dropped.
    Choose(Option<Kind>),
    /// The person picked this point, or a place where nothing lies.
    Picked(Option<PickedPoint>),
    /// What the mesh has where the person picked; else why it has nothing, in words.
    Surveyed(Result<Box<Taken>, String>),
    /// The person picks the element of this measurement.
    Use(u32),
    /// The person takes back what was picked last, or ends measuring where there is nothing.
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
    /// The person signed measurements: by their numbers the reviews that keep them with the inspection.
    Kept(Vec<(u32, ReviewId)>),
    /// The agent said what is kept with the inspection.
    Known(Vec<KeptMeasurement>),
    /// What is kept is shown or hidden.
    ShowKept(bool),
    /// The person wants to withdraw what this review keeps, or does not any more.
    Withdraw(Option<ReviewId>),
}
