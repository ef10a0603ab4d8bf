//! Where the inspection stands.

use crate::words::t;
use semascan_protocol::{self as wire, Phase};

/// Where the inspection stands; the latest [`wire::Progress`], made consistent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunProgress {
    /// The phase; unspecified before the agent has said it.
    pub phase: Phase,
    /// Integrated and rejected views together.
    pub views_done: u32,
    /// Rejected views, at most `views_done`.
    pub views_rejected: u32,
    /// Expected views, at least `views_done`; 0: unknown.
    pub views_expected: u32,
    /// Points of the model on the agent's side.
    pub points: u64,
    /// Chunks of the model on the agent's side.
    pub chunks: u32,
    /// Hash of the agent's whole model, 0 while it grows.
    pub model_hash: u64,
    /// For people: why it failed.
    pub message: String,
}

/// Where the inspection stands, as far as the viewer knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// As the agent said last.
    Known(Phase),
    /// It was under way when the connection was lost.
    Unknown,
}

impl Standing {
    /// Stable name for styles and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Known(Phase::Unspecified) => "unknown",
            Self::Known(Phase::Waiting) => "waiting",
            Self::Known(Phase::Running) => "running",
            Self::Known(Phase::Finished) => "finished",
            Self::Known(Phase::Failed) => "failed",
            Self::Unknown => "interrupted",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Known(Phase::Unspecified) => t!("standing.unknown"),
            Self::Known(Phase::Waiting) => t!("standing.waiting"),
            Self::Known(Phase::Running) => t!("standing.running"),
            Self::Known(Phase::Finished) => t!("standing.finished"),
            Self::Known(Phase::Failed) => t!("standing.failed"),
            Self::Unknown => t!("standing.not_known"),
        }
    }
}

impl RunProgress {
    /// Takes what the agent says.
    pub(super) fn update(&mut self, p: &wire::Progress) {
        *self = Self {
            phase: p.phase(),
            views_done: p.views_done,
            views_rejected: p.views_rejected.min(p.views_done),
            views_expected: if p.views_expected == 0 { 0 } else { p.views_expected.max(p.views_done) },
            points: p.points,
            chunks: p.chunks,
            model_hash: p.model_hash,
            message: p.message.clone(),
        };
    }

    /// Whether stages may be at work: the inspection runs, or nothing has been said of it yet.
    pub(super) fn may_run(&self) -> bool {
        matches!(self.phase, Phase::Running | Phase::Unspecified)
    }

    /// Share of the expected views that are done, 0..=1; `None` where the number is not known.
    pub fn fraction(&self) -> Option<f64> {
        (self.views_expected > 0).then(|| f64::from(self.views_done) / f64::from(self.views_expected))
    }

    /// Whether the phase may be another one by the time that the agent speaks again.
    pub(super) fn may_change(&self) -> bool {
        matches!(self.phase, Phase::Running | Phase::Waiting)
    }

    /// Stable name of the phase for styles and tests.
    pub fn phase_key(&self) -> &'static str {
        Standing::Known(self.phase).key()
    }

    /// A sentence for the live region.
    pub(super) fn sentence(&self) -> String {
        let views = match self.views_expected {
            0 => t!("progress.said.views", done = self.views_done),
            all => t!("progress.said.of_views", done = self.views_done, all),
        };
        match self.phase {
            Phase::Unspecified => String::new(),
            Phase::Waiting => t!("progress.said.waiting").into(),
            Phase::Running => t!("progress.said.running", views),
            Phase::Finished => t!("progress.said.finished", views, rejected = self.views_rejected),
            Phase::Failed => t!("progress.said.failed", reason = self.message),
        }
    }
}
