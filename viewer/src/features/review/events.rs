//! What happens to findings and decisions.

use super::{Case, Ruling, Unsent};
use semascan_model::finding::FindingId;
use semascan_model::review::ReviewId;

/// One thing that happens to them.
#[derive(Clone, Debug, PartialEq)]
pub enum ReviewEvent {
    /// The agent is asked.
    Asked,
    /// The agent said what there is.
    Known(Box<Case>),
    /// It did not, and why.
    Unknown(String),
    /// The person chose a finding, or none.
    Select(Option<FindingId>),
    /// The person followed a link to a finding, which may not be known yet.
    Wanted(FindingId),
    /// The person wants the finding so many places further.
    Step(i32),
    /// The person begins a decision about the chosen finding, or the part.
    Draft(Ruling),
    /// The person says that the chosen finding is another defect, or none: it was found in error.
    Reclassify(Option<String>),
    /// The person gives it up, or has signed it.
    Discard,
    /// The person says who they are.
    Person(String),
    /// The person made a decision, or one is left from an earlier visit or another tab.
    Decided(Box<Unsent>),
    /// It has arrived.
    Sent(ReviewId),
    /// The agent refused it, and why.
    Refused {
        /// Which.
        id: ReviewId,
        /// Why.
        reason: String,
    },
}
