//! Which decisions stand, subject by subject, and which contradict each other.
//!
//! A person decides about the version of a subject that they saw. Where somebody else has decided about that version
//! meanwhile, both decisions are kept and neither counts, until a later one names both. Changes of a finding's class are told
//! apart from decisions about it: each has its own place here.

use semascan_model::finding::FindingId;
use semascan_model::review::{Review, ReviewAction, ReviewEntry, ReviewId, Subject};
use std::collections::BTreeMap;

/// What stands about one subject.
#[derive(Clone, Debug, Default)]
pub(super) struct Standing<'a> {
    /// Decisions: one, or several that contradict each other.
    pub(super) decisions: Vec<&'a ReviewEntry>,
    /// Changes of the class, the same.
    pub(super) changes: Vec<&'a ReviewEntry>,
    /// Place of the last of both.
    pub(super) version: u64,
}

impl Standing<'_> {
    /// The decisions and changes that contradict each other.
    pub(super) fn conflict(&self) -> Vec<ReviewId> {
        let several = [&self.decisions, &self.changes].into_iter().filter(|list| list.len() > 1);
        several.flatten().map(|entry| entry.review.id).collect()
    }

    /// What stands of the kind of `action`; `None` where it decides nothing.
    pub(super) fn of_kind(&self, action: &ReviewAction) -> Option<&[&ReviewEntry]> {
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
#[derive(Debug, Default)]
pub(super) struct Standings<'a> {
    pub(super) subjects: BTreeMap<Subject, Standing<'a>>,
}

impl<'a> Standings<'a> {
    pub(super) fn of(entries: &'a [ReviewEntry]) -> Self {
        let mut all = Self::default();
        for entry in entries {
            let standing = all.subjects.entry(entry.review.subject.clone()).or_default();
            let list = match entry.review.action {
                ReviewAction::Reclassify { .. } => &mut standing.changes,
                _ if entry.review.action.decision().is_some() => &mut standing.decisions,
                _ => continue,
            };
            if entry.conflicts_with.is_empty() {
                list.clear();
            }
            list.push(entry);
            standing.version = entry.sequence;
        }
        all
    }

    pub(super) fn of_subject(&self, subject: &Subject) -> Option<&Standing<'a>> {
        self.subjects.get(subject)
    }

    /// The change of a finding's class that counts.
    pub(super) fn change(&self, finding: FindingId) -> Option<&'a ReviewEntry> {
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
