//! Messages to others: what happened here, for whoever follows several agents.

use super::PortError;

/// A message about something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusMessage {
    /// Names the message for good: publishing one twice delivers it once.
    pub id: String,
    /// What it is about, from the general to the particular, with dots between: `inspection.<id>.view_finished`.
    pub subject: String,
    /// JSON.
    pub payload: String,
}

/// Takes messages and delivers each at least once, in the order in which they were published.
pub trait Bus: Send + Sync {
    /// Takes messages; they are durable once this returns.
    ///
    /// # Errors
    /// [`PortError`] with the reason; none of them was taken.
    fn publish(&self, messages: &[BusMessage]) -> Result<(), PortError>;
}
