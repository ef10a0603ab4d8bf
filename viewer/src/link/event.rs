//! What happens on the live link, in the order in which it happened.

use semascan_protocol as wire;
use semascan_protocol::WireError;
use semascan_protocol::server_message::Body;

pub use semascan_protocol::chunk::DecodedChunk;

/// One thing that happened on the link. The worker sends them, the page follows them; see [`super::transfer`] for how
/// they cross.
#[derive(Clone, Debug, PartialEq)]
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
    /// The viewer's own side of the link has stopped; there will be no further attempt.
    Broken {
        /// Why, for people.
        reason: String,
    },
    /// A new inspection or a rebuilt map: drop every chunk.
    Cleared(wire::Inspection),
    /// Any other control message, as the agent sent it: progress, stages, views.
    Message(Body),
    /// The whole content of one chunk; replaces every earlier revision.
    Chunk(DecodedChunk),
    /// A chunk emptied.
    ChunkGone {
        /// Chunk coordinates.
        id: [i32; 3],
    },
    /// Memory does not suffice for all points: of each chunk, those that are held too, what is left after so many halvings counts
    /// from here on ([`super::halving`]).
    Halved {
        /// 0: all points.
        halvings: u32,
    },
    /// This chunk is more than the viewer can hold: it is not shown, and what was held of it goes.
    LeftOut {
        /// Chunk coordinates.
        id: [i32; 3],
    },
    /// A message could not be understood; it is skipped and the link goes on.
    Malformed {
        /// Which field, and what is wrong with it.
        reason: String,
    },
}

impl LinkEvent {
    /// What a message of the control lane says.
    ///
    /// # Errors
    /// [`WireError::Field`] where a message lacks its inspection, or is one of the bulk lane.
    pub fn from_control(message: Body) -> Result<Self, WireError> {
        Ok(match message {
            Body::Welcome(welcome) => Self::Connected {
                inspection: required("welcome.inspection", welcome.inspection)?,
                resumed: welcome.resumed,
                agent: welcome.agent,
            },
            Body::Refused(refused) => Self::Refused { reason: refused.reason },
            Body::Clear(clear) => Self::Cleared(required("clear.inspection", clear.inspection)?),
            Body::Chunk(_) | Body::Gone(_) => {
                return Err(WireError::Field { field: "body", reason: "a chunk in the control lane".to_owned() });
            }
            other => Self::Message(other),
        })
    }

    /// Whether it is of the bulk lane, which carries the model and says nothing else.
    pub fn is_bulk(&self) -> bool {
        matches!(self, Self::Chunk(_) | Self::ChunkGone { .. })
    }
}

/// The value of a field that has to be there.
pub(super) fn required<T>(field: &'static str, value: Option<T>) -> Result<T, WireError> {
    value.ok_or_else(|| WireError::Field { field, reason: "missing".to_owned() })
}
