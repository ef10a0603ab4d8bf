//! What the page hears from the live link, in the order in which it happened.

use semascan_protocol as wire;

pub use semascan_protocol::chunk::DecodedChunk;

/// One thing that happened on the link. The worker makes them, the page consumes them; see [`super::transfer`] for how
/// they cross.
#[derive(Clone, Debug)]
pub enum LinkEvent {
    /// A connection is being opened; `attempt` counts from 1 and starts again after every welcome.
    Connecting {
        /// How many attempts in a row, this one included.
        attempt: u32,
    },
    /// The agent answered. Unless `resumed`, everything held is void: clear it.
    Connected {
        /// What is being inspected.
        inspection: wire::Inspection,
        /// Whether only the difference to what is held follows.
        resumed: bool,
        /// Name and version of the agent.
        agent: String,
    },
    /// The connection is gone; the next attempt starts by itself.
    Disconnected {
        /// Why, for people.
        reason: String,
        /// Milliseconds until the next attempt.
        retry_ms: u32,
    },
    /// The agent (or the protocol version) refused this viewer; there will be no further attempt.
    Refused {
        /// Why, for people.
        reason: String,
    },
    /// A new inspection or a rebuilt map: drop every chunk.
    Cleared(wire::Inspection),
    /// Where the inspection stands.
    Progress(wire::Progress),
    /// A stage of a view began, ended or failed.
    Stage(wire::StageEvent),
    /// What became of a view.
    View(wire::ViewReport),
    /// The whole content of one chunk; replaces every earlier revision.
    Chunk(DecodedChunk),
    /// A chunk emptied.
    ChunkGone {
        /// Chunk coordinates.
        id: [i32; 3],
    },
    /// A message could not be understood; it is skipped and the link goes on.
    Malformed {
        /// Which field, and what is wrong with it.
        reason: String,
    },
}
