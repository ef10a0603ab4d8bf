//! The log of reviews: appended to, never changed.

use super::{BusMessage, FindingRow, PortError, ResultRow};
use semascan_model::InspectionId;
use semascan_model::review::{ReviewEntry, ReviewId};

/// An entry of the log with the hash that chains it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedReview {
    /// The entry.
    pub entry: ReviewEntry,
    /// Its hash, hexadecimal.
    pub hash: String,
}

/// What an inspection comes to after a review.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReviewResult {
    /// In short.
    pub row: ResultRow,
    /// Its findings; `None` where the review changed none of them.
    pub findings: Option<Vec<FindingRow>>,
}

/// The log of reviews of all inspections. What [`append`](Self::append) has returned from is durable. Every method fails with a
/// [`PortError`] that names the log and the reason.
#[allow(clippy::missing_errors_doc)]
pub trait ReviewLog: Send + Sync {
    /// The first `limit` entries about an inspection that stand at place `first` of the log or behind it, in order. No other
    /// entry is read.
    fn entries(&self, inspection: InspectionId, first: u64, limit: u32) -> Result<Vec<LoggedReview>, PortError>;

    /// All entries about an inspection, in order.
    fn all_entries(&self, inspection: InspectionId) -> Result<Vec<ReviewEntry>, PortError> {
        Ok(self.entries(inspection, 0, u32::MAX)?.into_iter().map(|logged| logged.entry).collect())
    }

    /// The entry of the review of this name, whatever inspection it is about.
    fn entry(&self, review: ReviewId) -> Result<Option<ReviewEntry>, PortError>;

    /// Place of the last entry; 0 where there is none.
    fn last(&self) -> Result<u64, PortError>;

    /// Appends an entry whose place is the next one, notes what the inspection then comes to, and publishes `message`: all of
    /// it or nothing. Returns the entry's hash.
    fn append(&self, entry: &ReviewEntry, result: &ReviewResult, message: &BusMessage) -> Result<String, PortError>;
}
