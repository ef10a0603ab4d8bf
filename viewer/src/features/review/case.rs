//! What there is to decide about: the findings, the verdict and the decisions of an inspection, as the agent says them.

use super::Unsent;
use semascan_model::finding::{Finding, FindingId};
use semascan_model::review::{Review, ReviewAction, ReviewId, Subject, SubjectState};
use semascan_model::verdict::{Decision, Verdict, VerdictLine};
use serde::Deserialize;

/// The answer of `/inspections/{inspection}/findings`, as far as it is shown.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct FindingsAnswer {
    /// What was measured; absent where nobody looked.
    #[serde(default)]
    pub measured: Option<Measured>,
    /// The findings after all reviews; absent where nobody looked and nobody drew.
    #[serde(default)]
    pub now: Option<Vec<Finding>>,
}

/// What was measured, apart from the findings themselves.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Measured {
    /// Why nobody looked for defects.
    #[serde(default)]
    pub not_looked: Option<String>,
}

/// The answer of `/inspections/{inspection}/verdict`, as far as it is shown.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct VerdictAnswer {
    /// What counts.
    #[serde(default)]
    pub decision: Option<Decision>,
    /// The verdict with what people decided; absent where it was not judged.
    #[serde(default)]
    pub now: Option<Verdict>,
    /// The part, and what else was reviewed.
    pub subjects: Vec<SubjectState>,
}

/// The answer of `/inspections/{inspection}/reviews`, as far as it is used.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct ReviewsAnswer {
    /// The model's generation.
    #[serde(default)]
    pub model: Option<String>,
}

/// All that is known of an inspection's findings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Case {
    /// Name of the inspection.
    pub inspection: String,
    /// Generation of the model.
    pub model: Option<String>,
    /// The findings in their order; `None` where nobody looked and nobody drew.
    pub findings: Option<Vec<Finding>>,
    /// Why nobody looked for defects.
    pub not_looked: Option<String>,
    /// What counts for the part.
    pub decision: Option<Decision>,
    /// Every criterion.
    pub lines: Vec<VerdictLine>,
    /// The part, and what else was reviewed.
    pub subjects: Vec<SubjectState>,
}

impl Case {
    /// Of the three answers about `inspection`.
    pub fn of(inspection: String, findings: FindingsAnswer, verdict: VerdictAnswer, reviews: ReviewsAnswer) -> Self {
        Self {
            inspection,
            model: reviews.model,
            findings: findings.now,
            not_looked: findings.measured.and_then(|measured| measured.not_looked),
            decision: verdict.decision,
            lines: verdict.now.map(|verdict| verdict.lines).unwrap_or_default(),
            subjects: verdict.subjects,
        }
    }

    /// What is done with the part as a whole, ready to be sent.
    pub fn unsent(&self, id: ReviewId, action: ReviewAction, person: &str, reason: &str) -> Unsent {
        let review = Review {
            id,
            subject: Subject::Part,
            seen: self.subject(&Subject::Part).map_or(0, |state| state.version),
            model: self.model.clone(),
            action,
            person: person.trim().to_owned(),
            reason: reason.trim().to_owned(),
            resolves: Vec::new(),
        };
        Unsent { inspection: self.inspection.clone(), review }
    }

    /// The findings in their order.
    pub fn findings(&self) -> &[Finding] {
        self.findings.as_deref().unwrap_or_default()
    }

    /// The finding of that name, and its place.
    pub fn finding(&self, id: FindingId) -> Option<(usize, &Finding)> {
        self.findings().iter().enumerate().find(|(_, finding)| finding.id == id)
    }

    /// How a subject stands; `None` where nobody said anything of it.
    pub fn subject(&self, subject: &Subject) -> Option<&SubjectState> {
        self.subjects.iter().find(|state| state.subject == *subject)
    }

    /// What a person decided about a finding.
    pub fn decided(&self, id: FindingId) -> Option<Decision> {
        self.subject(&Subject::Finding { finding: id })?.decision
    }

    /// Whether people contradict each other about a finding.
    pub fn is_contested(&self, id: FindingId) -> bool {
        self.subject(&Subject::Finding { finding: id }).is_some_and(|state| !state.conflict.is_empty())
    }

    /// The criteria that are about a finding.
    pub fn lines_of(&self, id: FindingId) -> impl Iterator<Item = &VerdictLine> {
        self.lines.iter().filter(move |line| line.findings.contains(&id))
    }

    /// What follows from a finding by the criteria: the heaviest of its lines.
    pub fn follows(&self, id: FindingId) -> Option<Decision> {
        self.lines_of(id).map(|line| line.decision).reduce(Decision::with)
    }
}
