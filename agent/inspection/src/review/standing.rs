//! Which decisions stand, subject by subject, and which contradict each other.
//!
//! A person decides about the version of a subject that they saw. Where somebody else has decided about that version
//! meanwhile, both decisions are kept and neither counts, until a later one names both. Changes of a finding's class are told
//! apart from decisions about it: each has its own place here.
//!
//! What stands is extended entry by entry, and keeps of the log only what counts: the cost of an entry does not grow with the
//! number of those before it.

use semascan_model::finding::FindingId;
use semascan_model::review::{Review, ReviewAction, ReviewEntry, ReviewId, Subject};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What stands about one subject.
#[derive(Clone, Debug, Default)]
pub(super) struct Standing {
    /// Decisions: one, or several that contradict each other.
    pub(super) decisions: Vec<Arc<ReviewEntry>>,
    /// Changes of the class, the same.
    pub(super) changes: Vec<Arc<ReviewEntry>>,
    /// Place of the last of both.
    pub(super) version: u64,
}

impl Standing {
    /// The decisions and changes that contradict each other.
    pub(super) fn conflict(&self) -> Vec<ReviewId> {
        let several = [&self.decisions, &self.changes].into_iter().filter(|list| list.len() > 1);
        several.flatten().map(|entry| entry.review.id).collect()
    }

    /// What stands of the kind of `action`; `None` where it decides nothing.
    pub(super) fn of_kind(&self, action: &ReviewAction) -> Option<&[Arc<ReviewEntry>]> {
        match action {
            ReviewAction::Reclassify { .. } => Some(&self.changes),
            action if action.decision().is_some() => Some(&self.decisions),
            _ => None,
        }
    }

    /// The reviews beside which `review` would stand: those that its person did not see, or those that contradict each other
    /// already and that it does not name.
    pub(super) fn contradicted_by(&self, review: &Review) -> Vec<ReviewId> {
        let Some(standing) = self.of_kind(&review.action) else { return Vec::new() };
        let is_seen = standing.len() < 2 && standing.iter().all(|entry| entry.sequence <= review.seen);
        if is_seen || standing.iter().all(|entry| review.resolves.contains(&entry.review.id)) {
            return Vec::new();
        }
        standing.iter().map(|entry| entry.review.id).collect()
    }
}

/// Everything that stands after the entries of one inspection.
#[derive(Clone, Debug, Default)]
pub(super) struct Standings {
    pub(super) subjects: BTreeMap<Subject, Standing>,
    /// Entries that draw a finding, in order.
    pub(super) drawn: Vec<Arc<ReviewEntry>>,
    /// Entries that keep a measurement which nobody has withdrawn, in order.
    pub(super) measured: Vec<Arc<ReviewEntry>>,
    /// Place of the last entry; 0 where there is none.
    pub(super) last: u64,
}

impl Standings {
    pub(super) fn of(entries: &[ReviewEntry]) -> Self {
        let mut all = Self::default();
        entries.iter().for_each(|entry| all.extend(&Arc::new(entry.clone())));
        all
    }

    /// Takes in the entry that follows.
    pub(super) fn extend(&mut self, entry: &Arc<ReviewEntry>) {
        self.last = entry.sequence;
        match &entry.review.action {
            ReviewAction::NewFinding { .. } => self.drawn.push(Arc::clone(entry)),
            ReviewAction::Measure { .. } => self.measured.push(Arc::clone(entry)),
            ReviewAction::Withdraw { review } => self.measured.retain(|kept| kept.review.id != *review),
            _ => {}
        }
        let standing = self.subjects.entry(entry.review.subject.clone()).or_default();
        let list = match entry.review.action {
            ReviewAction::Reclassify { .. } => &mut standing.changes,
            _ if entry.review.action.decision().is_some() => &mut standing.decisions,
            _ => return,
        };
        if entry.conflicts_with.is_empty() {
            list.clear();
        }
        list.push(Arc::clone(entry));
        standing.version = entry.sequence;
    }

    pub(super) fn of_subject(&self, subject: &Subject) -> Option<&Standing> {
        self.subjects.get(subject)
    }

    /// The change of a finding's class that counts.
    pub(super) fn change(&self, finding: FindingId) -> Option<&ReviewEntry> {
        match self.of_subject(&Subject::Finding { finding })?.changes.as_slice() {
            [one] => Some(one),
            _ => None,
        }
    }

    /// Subjects with reviews that contradict each other.
    pub(super) fn conflicts(&self) -> u32 {
        self.subjects.values().filter(|standing| !standing.conflict().is_empty()).count() as u32
    }
}
