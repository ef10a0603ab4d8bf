//! The log of reviews: appended to, never changed.

use super::{BusMessage, PortError, ResultRows};
use semascan_model::InspectionId;
use semascan_model::review::{ReviewEntry, ReviewId};

/// The log of reviews of all inspections. What [`append`](Self::append) has returned from is durable. Every method fails with a
/// [`PortError`] that names the log and the reason.
#[allow(clippy::missing_errors_doc)]
pub trait ReviewLog: Send + Sync {
    /// The entries about an inspection, in order.
    fn entries(&self, inspection: InspectionId) -> Result<Vec<ReviewEntry>, PortError>;

    /// The entry of the review of this name, whatever inspection it is about.
    fn entry(&self, review: ReviewId) -> Result<Option<ReviewEntry>, PortError>;

    /// Place of the last entry; 0 where there is none.
    fn last(&self) -> Result<u64, PortError>;

    /// Appends an entry whose place is the next one, notes what the inspection then comes to, and publishes `message`: all of
    /// it or nothing.
    fn append(&self, entry: &ReviewEntry, result: &ResultRows, message: &BusMessage) -> Result<(), PortError>;
}
