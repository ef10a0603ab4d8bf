//! A decision before it is sent, and one that has not arrived yet.

use super::Case;
use crate::words::t;
use semascan_model::finding::FindingId;
use semascan_model::review::{Review, ReviewAction, ReviewId, Subject};
use serde::{Deserialize, Serialize};

/// What a person can say by one key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ruling {
    /// It is good as it is.
    Accept,
    /// It is to be worked on.
    Rework,
    /// It is not used.
    Reject,
    /// A remark.
    Comment,
}

impl Ruling {
    /// All, in the order of the buttons.
    pub const ALL: [Self; 4] = [Self::Accept, Self::Rework, Self::Reject, Self::Comment];

    /// Stable name for tests and styles.
    pub fn key(self) -> &'static str {
        match self {
            Self::Accept => "accept",
            Self::Rework => "rework",
            Self::Reject => "reject",
            Self::Comment => "comment",
        }
    }

    /// Its key on the keyboard.
    pub fn shortcut(self) -> &'static str {
        match self {
            Self::Accept => "Y",
            Self::Rework => "R",
            Self::Reject => "X",
            Self::Comment => "I",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Accept => t!("ruling.accept"),
            Self::Rework => t!("ruling.rework"),
            Self::Reject => t!("ruling.reject"),
            Self::Comment => t!("ruling.comment"),
        }
    }

    /// As the agent takes it.
    pub fn action(self) -> ReviewAction {
        match self {
            Self::Accept => ReviewAction::Accept,
            Self::Rework => ReviewAction::Rework,
            Self::Reject => ReviewAction::Reject,
            Self::Comment => ReviewAction::Comment,
        }
    }
}

/// A decision whose reason is still to be given.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// What it is about: a finding, or the part.
    pub subject: Subject,
    /// What is done.
    pub action: ReviewAction,
}

impl Draft {
    /// About a finding, or about the part where none is chosen.
    pub fn about(finding: Option<FindingId>, ruling: Ruling) -> Self {
        let subject = finding.map_or(Subject::Part, |finding| Subject::Finding { finding });
        Self { subject, action: ruling.action() }
    }

    /// A finding is another defect, or none: it was found in error.
    pub fn reclassify(finding: FindingId, defect: Option<String>) -> Self {
        let action = ReviewAction::Reclassify { component: None, defect };
        Self { subject: Subject::Finding { finding }, action }
    }

    /// What a person can say by one key, if it is that.
    pub fn ruling(&self) -> Option<Ruling> {
        Ruling::ALL.into_iter().find(|ruling| ruling.action() == self.action)
    }

    /// What is done, in words that the subject follows.
    pub fn words(&self) -> String {
        match (&self.action, self.ruling()) {
            (_, Some(ruling)) => ruling.label().to_owned(),
            (ReviewAction::Reclassify { defect: Some(defect), .. }, _) => t!("review.call_it", defect),
            _ => t!("review.in_error").to_owned(),
        }
    }

    /// The review as it is sent. Where decisions about its subject contradict each other it settles them all.
    pub fn review(&self, id: ReviewId, case: &Case, person: &str, reason: &str) -> Review {
        let state = case.subject(&self.subject);
        let conflict = state.map(|state| state.conflict.clone()).unwrap_or_default();
        Review {
            id,
            subject: self.subject.clone(),
            seen: state.map_or(0, |state| state.version),
            model: case.model.clone(),
            action: self.action.clone(),
            person: person.trim().to_owned(),
            reason: reason.trim().to_owned(),
            resolves: if self.action == ReviewAction::Comment { Vec::new() } else { conflict },
        }
    }
}

/// A decision that the agent has not confirmed yet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unsent {
    /// The inspection.
    pub inspection: String,
    /// The review.
    pub review: Review,
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::review::SubjectState;
    use uuid::Uuid;

    fn name(n: u128) -> ReviewId {
        ReviewId(Uuid::from_u128(n))
    }

    #[test]
    fn a_decision_says_what_the_person_saw_and_settles_what_is_contested() {
        let finding = FindingId::from_bytes([7; 16]);
        let subject = Subject::Finding { finding };
        let mut case = Case { model: Some("m1".into()), ..Case::default() };
        let draft = Draft::about(Some(finding), Ruling::Rework);
        let first = draft.review(name(1), &case, " A. Reviewer ", " can be ground ");
        assert_eq!((first.seen, first.reason.as_str(), first.person.as_str()), (0, "can be ground", "A. Reviewer"));
        assert_eq!((first.action.clone(), first.model.as_deref()), (ReviewAction::Rework, Some("m1")));
        case.subjects = vec![SubjectState { subject, version: 9, decision: None, conflict: vec![name(4), name(5)] }];
        let second = draft.review(name(2), &case, "A", "b");
        assert_eq!((second.seen, second.resolves), (9, vec![name(4), name(5)]));
        let remark = Draft::about(Some(finding), Ruling::Comment).review(name(3), &case, "A", "b");
        assert!(remark.resolves.is_empty(), "a remark settles nothing");
        assert_eq!(Draft::about(None, Ruling::Accept).subject, Subject::Part);
    }

    #[test]
    fn a_finding_may_be_another_defect_or_none() {
        let finding = FindingId::from_bytes([7; 16]);
        let draft = Draft::reclassify(finding, Some("wear".into()));
        assert_eq!((draft.words().as_str(), draft.ruling()), ("Call it wear:", None));
        assert_eq!(draft.subject, Subject::Finding { finding });
        let error = Draft::reclassify(finding, None).review(name(1), &Case::default(), "A", "a shadow");
        assert_eq!(error.action, ReviewAction::Reclassify { component: None, defect: None });
        assert_eq!(Draft::about(None, Ruling::Rework).words(), "Rework");
    }

    #[test]
    fn what_is_not_sent_is_kept_as_it_is() {
        let review = Draft::about(None, Ruling::Accept).review(name(1), &Case::default(), "A", "good");
        let unsent = vec![Unsent { inspection: "018f".into(), review }];
        let text = serde_json::to_string(&unsent).expect("plain data");
        assert_eq!(serde_json::from_str::<Vec<Unsent>>(&text).expect("its own"), unsent);
    }
}
