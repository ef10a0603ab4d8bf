//! Who the person is to the agent, and what it keeps (`GET /api/v1/me`).

use semascan_model::Role;
use serde::Deserialize;

/// The person and the agent.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Account {
    /// Their name; of somebody who has not logged in a general one.
    pub name: String,
    /// What they may do.
    pub role: Role,
    /// Whether the agent knows its users: then reviews carry the name of who is logged in.
    pub login: bool,
    /// Whether inspections are kept: only then are there photographs in full size, findings and reviews.
    pub keeps: bool,
}
