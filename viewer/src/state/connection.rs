//! Where the link to the agent and the graphics device stand.

use super::units;
use crate::words::t;

/// The link to the agent, as the person sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Connection {
    /// The first try is under way.
    Connecting {
        /// Number of the try.
        attempt: u32,
    },
    /// Messages flow.
    Connected {
        /// Name and version of the agent.
        agent: String,
    },
    /// The connection broke, or could not be made, and is tried again.
    Reconnecting {
        /// Why it broke.
        reason: String,
        /// Number of the try, 0 before the first.
        attempt: u32,
        /// Milliseconds until the next try; 0 while it is under way.
        retry_ms: u32,
    },
    /// The agent refused the viewer for good, or the viewer may not connect to it.
    Refused {
        /// Why.
        reason: String,
    },
    /// A file is shown, and no agent followed.
    File {
        /// Its name.
        name: String,
    },
    /// What the agent keeps of an inspection is played, and its stream not followed.
    Recorded,
    /// The viewer's own side has stopped for good.
    Broken {
        /// Why.
        reason: String,
    },
}

impl Default for Connection {
    fn default() -> Self {
        Self::Connecting { attempt: 1 }
    }
}

impl Connection {
    /// A try begins. After a loss it stays a reconnection until it succeeds.
    pub(super) fn connecting(&mut self, attempt: u32) {
        match self {
            Self::Reconnecting { attempt: a, retry_ms, .. } => (*a, *retry_ms) = (attempt, 0),
            _ => *self = Self::Connecting { attempt },
        }
    }

    /// The connection broke.
    pub(super) fn lost(&mut self, reason: String, retry_ms: u32) {
        let tries = match self {
            Self::Reconnecting { attempt, .. } | Self::Connecting { attempt } => *attempt,
            _ => 0,
        };
        *self = Self::Reconnecting { reason, attempt: tries, retry_ms };
    }

    /// Counts down to the next try.
    pub(super) fn elapsed(&mut self, ms: u32) {
        if let Self::Reconnecting { retry_ms, .. } = self {
            *retry_ms = retry_ms.saturating_sub(ms);
        }
    }

    /// Stable name for styles and tests.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Connecting { .. } => "connecting",
            Self::Connected { .. } => "connected",
            Self::Reconnecting { .. } => "reconnecting",
            Self::Refused { .. } => "refused",
            Self::File { .. } => "file",
            Self::Recorded => "recorded",
            Self::Broken { .. } => "broken",
        }
    }

    /// Whether messages flow, so that what the agent said last is how things stand.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Connected { .. })
    }

    /// Whether a file is shown in the place of an agent's model, its own file of an inspection too.
    pub fn is_file(&self) -> bool {
        matches!(self, Self::File { .. } | Self::Recorded)
    }

    /// Whether what the agent keeps of an inspection is played.
    pub fn is_recorded(&self) -> bool {
        matches!(self, Self::Recorded)
    }

    /// Short label for the header.
    pub fn label(&self) -> String {
        match self {
            Self::Connecting { .. } => t!("connection.connecting").into(),
            Self::Connected { .. } => t!("connection.connected").into(),
            Self::Reconnecting { retry_ms: 0, .. } => t!("connection.reconnecting").into(),
            Self::Reconnecting { retry_ms, .. } => {
                t!("connection.reconnecting_in", seconds = retry_ms.div_ceil(1000))
            }
            Self::Refused { .. } => t!("connection.refused").into(),
            Self::File { .. } => t!("connection.file").into(),
            Self::Recorded => t!("connection.recorded").into(),
            Self::Broken { .. } => t!("connection.broken").into(),
        }
    }

    /// A sentence for the live region; it does not change with every second of a countdown.
    pub(super) fn sentence(&self) -> String {
        match self {
            Self::Connecting { .. } => t!("connection.said.connecting").into(),
            Self::Connected { .. } => t!("connection.said.connected").into(),
            Self::Reconnecting { .. } => t!("connection.said.lost").into(),
            Self::Refused { reason } => t!("connection.was_refused", reason = units::sentence(reason)),
            Self::File { name } => t!("connection.said.file", name),
            Self::Recorded => t!("connection.said.recorded").into(),
            Self::Broken { reason } => t!("connection.said.broken", reason = units::sentence(reason)),
        }
    }
}

/// The graphics device, as the person sees it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum GraphicsStatus {
    /// It is being set up.
    #[default]
    Starting,
    /// It draws.
    Ready {
        /// `webgpu` or `webgl2`.
        backend: String,
    },
    /// There is none that works, or it went away: the panels go on without the 3D view.
    Unavailable {
        /// Why.
        reason: String,
    },
}
