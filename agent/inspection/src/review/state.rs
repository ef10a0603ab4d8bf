//! What an inspection comes to with everything that people decided: the state that follows from the log alone, so that it is
//! the same whenever it is computed.

use super::measurements;
use super::rules::flat_figures;
use super::standing::Standings;
use crate::criteria::CheckedCriteria;
use crate::verdict::{judge, undecided};
use semascan_model::finding::{Finding, FindingId, FindingKind, FindingsRecord, NamedClass};
use semascan_model::record::{ClassSummary, InspectionRecord};
use semascan_model::review::{
    DrawnOutline, Review, ReviewAction, ReviewEntry, ReviewId, ReviewedState, Subject, SubjectState,
};
use semascan_model::verdict::{Decision, JudgedFigure, Override, Verdict, VerdictLine};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The findings as people changed them.
#[derive(Clone, Debug, Default)]
pub(super) struct Amended {
    /// The list; `None` where nobody looked and nobody drew.
    pub(super) findings: Option<Vec<Finding>>,
    pub(super) drawn: Vec<DrawnOutline>,
    pub(super) found_in_error: Vec<FindingId>,
    /// Whether anything was changed.
    pub(super) is_changed: bool,
}

/// The state of an inspection with this record after `entries`, which are about it and in order. `criteria` are those that it
/// was judged by, where they are at hand: findings that people changed are judged by them again.
pub fn reviewed_state(
    record: &InspectionRecord,
    entries: &[ReviewEntry],
    criteria: Option<&CheckedCriteria>,
) -> ReviewedState {
    let standings = Standings::of(entries);
    Judged::of(record, &standings, criteria).state(&standings)
}

/// What is found and judged with the classes that people changed and the findings that they drew, before decisions. It changes
/// with the record and with reviews that change findings, and with no others.
#[derive(Clone, Debug)]
pub(super) struct Judged {
    pub(super) amended: Amended,
    /// The verdict on the findings as they are now.
    verdict: Option<Verdict>,
    is_outdated: bool,
    /// Generation of the model.
    generation: Option<String>,
}

impl Judged {
    pub(super) fn of(record: &InspectionRecord, standings: &Standings, criteria: Option<&CheckedCriteria>) -> Self {
        let amended = amended(record, standings);
        let changed = amended.findings.as_ref().filter(|_| amended.is_changed);
        let (verdict, is_outdated) = verdict_of(record, changed, criteria);
        let generation = record.files.as_ref().map(|files| files.generation.clone());
        Self { amended, verdict, is_outdated, generation }
    }

    /// The state with the decisions of people.
    pub(super) fn state(&self, standings: &Standings) -> ReviewedState {
        let Self { amended, verdict, is_outdated, generation } = self.clone();
        let Amended { findings, drawn, found_in_error, is_changed: _ } = amended;
        let verdict = verdict.map(|verdict| with_people(verdict, standings));
        let part = standings.of_subject(&Subject::Part);
        let decision = match (&verdict, part.map(|part| part.decisions.as_slice())) {
            (Some(verdict), _) => Some(verdict.decision()),
            (None, Some([one])) => one.review.action.decision(),
            (None, Some([_, _, ..])) => Some(Decision::Person),
            (None, _) => None,
        };
        let mut subjects: Vec<SubjectState> = Vec::new();
        if part.is_none() {
            subjects.push(SubjectState { subject: Subject::Part, version: 0, decision: None, conflict: Vec::new() });
        }
        for (subject, standing) in &standings.subjects {
            let decision = match standing.decisions.as_slice() {
                [one] => one.review.action.decision(),
                _ => None,
            };
            let (version, conflict) = (standing.version, standing.conflict());
            subjects.push(SubjectState { subject: subject.clone(), version, decision, conflict });
        }
        ReviewedState {
            sequence: standings.last,
            subjects,
            findings,
            drawn,
            measurements: measurements::kept(standings, generation.as_deref()),
            found_in_error,
            verdict,
            is_verdict_outdated: is_outdated,
            decision,
            conflicts: standings.conflicts(),
        }
    }
}

/// The measured findings with the classes that people gave them, and those that people drew.
fn amended(record: &InspectionRecord, standings: &Standings) -> Amended {
    let mut list = record.findings.as_ref().map(|findings| findings.list.clone());
    let (mut drawn, mut found_in_error, mut is_changed) = (Vec::new(), Vec::new(), false);
    for entry in &standings.drawn {
        let ReviewAction::NewFinding { outline, component, defect } = &entry.review.action else { continue };
        let (Some(component), defect) =
            (class(&record.components, component), defect.as_deref().and_then(|defect| class(&record.defects, defect)))
        else {
            continue;
        };
        let id = drawn_name(entry.review.id);
        let kind = FindingKind::Drawn {
            defect,
            person: entry.review.person.clone(),
            at: entry.at,
            comment: entry.review.reason.clone(),
        };
        let figures = entry.drawn.clone().unwrap_or_default();
        let (instances, region) = (figures.instances, figures.region);
        list.get_or_insert_default().push(Finding { id, kind, component, instances, region });
        let (flat_area, perimeter) = flat_figures(outline);
        let (review, outline) = (entry.review.id, outline.clone());
        drawn.push(DrawnOutline { finding: id, review, outline, perimeter, flat_area, note: figures.note });
        is_changed = true;
    }
    for finding in list.iter_mut().flatten() {
        let Some(change) = standings.change(finding.id) else { continue };
        let ReviewAction::Reclassify { component, defect } = &change.review.action else { continue };
        is_changed = true;
        if let Some(component) = component.as_deref().and_then(|name| class(&record.components, name)) {
            finding.component = component;
        }
        let changed = defect.as_deref().and_then(|name| class(&record.defects, name)).filter(|class| class.class != 0);
        match (changed, &mut finding.kind) {
            (Some(changed), FindingKind::Defect { defect }) => *defect = changed,
            (Some(changed), FindingKind::Drawn { defect, .. }) => *defect = Some(changed),
            _ => found_in_error.push(finding.id),
        }
    }
    if let Some(list) = &mut list {
        list.retain(|finding| !found_in_error.contains(&finding.id));
    }
    Amended { findings: list, drawn, found_in_error, is_changed }
}

fn class(classes: &[ClassSummary], name: &str) -> Option<NamedClass> {
    let summary = classes.iter().find(|class| class.name == name)?;
    Some(NamedClass { class: summary.class, name: summary.name.clone() })
}

/// The record with the findings that people drew beside those that were measured, for reports and tables. Without a list of
/// findings nobody looked, which drawing one does not change.
pub fn with_drawn(record: &InspectionRecord, state: &ReviewedState) -> InspectionRecord {
    let mut record = record.clone();
    let drawn = state.findings.iter().flatten().filter(|finding| matches!(finding.kind, FindingKind::Drawn { .. }));
    if let Some(findings) = &mut record.findings {
        findings.list.extend(drawn.cloned());
    }
    record
}

/// The name of the finding that a review drew.
pub fn drawn_name(review: ReviewId) -> FindingId {
    let digest = Sha256::new().chain_update(b"drawn").chain_update(review.0.as_bytes()).finalize();
    FindingId::from_bytes(std::array::from_fn(|i| digest[i]))
}

/// The verdict on the findings as they are now, and whether it is still that on the measured ones although `changed` differ:
/// the criteria are not at hand, or compare with a reference, for which the mesh is needed.
fn verdict_of(
    record: &InspectionRecord,
    changed: Option<&Vec<Finding>>,
    criteria: Option<&CheckedCriteria>,
) -> (Option<Verdict>, bool) {
    let (Some(verdict), Some(changed)) = (&record.verdict, changed) else { return (record.verdict.clone(), false) };
    let usable = criteria.filter(|c| c.record.sha256 == verdict.criteria.sha256 && c.criteria.reference.is_none());
    let (Some(criteria), Some(findings)) = (usable, &record.findings) else { return (Some(verdict.clone()), true) };
    let mut amended = record.clone();
    amended.findings = Some(FindingsRecord { list: changed.clone(), ..findings.clone() });
    judge(&mut amended, criteria, None, verdict.at);
    (amended.verdict, false)
}

/// The verdict with what people decided: about findings and components line by line, about the part in place of all lines.
fn with_people(mut verdict: Verdict, standings: &Standings) -> Verdict {
    let mut used = BTreeSet::new();
    for line in &mut verdict.lines {
        decide_line(line, standings, &mut used);
    }
    for (subject, standing) in &standings.subjects {
        let (component, findings) = match subject {
            Subject::Part => continue,
            Subject::Component { component } => (Some(component), Vec::new()),
            Subject::Finding { finding } => (None, vec![*finding]),
        };
        if used.contains(subject) || standing.decisions.is_empty() {
            continue;
        }
        // No criterion speaks of it: what a person decided about it is a line of its own.
        let (decision, mut reason) = together(&standing.decisions);
        if let Some(component) = component {
            reason = format!("{component}: {reason}");
        }
        let line = undecided(JudgedFigure::Coverage, &reason);
        verdict.lines.push(VerdictLine { findings, decision, ..line });
    }
    let standing = standings.of_subject(&Subject::Part).map_or(&[][..], |part| part.decisions.as_slice());
    if standing.len() > 1 {
        let decided: Vec<String> = standing.iter().map(|entry| in_words(entry)).collect();
        verdict.lines.push(VerdictLine {
            decision: Decision::Person,
            reason: format!("decisions about the part contradict each other: {}", decided.join("; ")),
            ..undecided(JudgedFigure::Inspection, "")
        });
    }
    verdict.automatic = verdict.lines.iter().fold(Decision::Accept, |all, line| all.with(line.decision));
    if let [entry] = standing
        && let Some(decision) = entry.review.action.decision()
    {
        let Review { person, reason, .. } = &entry.review;
        let overriding = Override { decision, person: person.clone(), at: entry.at, reason: reason.clone() };
        verdict.overrides.push(overriding);
    }
    verdict
}

/// Puts what people decided about all findings of a line in its place, or else what they decided about its component.
fn decide_line<'a>(line: &mut VerdictLine, standings: &'a Standings, used: &mut BTreeSet<&'a Subject>) {
    let of_subject = |subject: Subject| {
        let (subject, standing) = standings.subjects.get_key_value(&subject)?;
        (!standing.decisions.is_empty()).then_some((subject, standing.decisions.as_slice()))
    };
    let findings = line.findings.iter().map(|finding| of_subject(Subject::Finding { finding: *finding }));
    let mut decided: Vec<_> = findings.collect::<Option<_>>().unwrap_or_default();
    if decided.is_empty()
        && let Some(component) = &line.component
    {
        decided.extend(of_subject(Subject::Component { component: component.name.clone() }));
    }
    if decided.is_empty() {
        return;
    }
    let (mut decision, mut words) = (Decision::Accept, Vec::new());
    for (subject, standing) in decided {
        used.insert(subject);
        let (one, reason) = together(standing);
        decision = decision.with(one);
        words.push(reason);
    }
    line.decision = decision;
    line.reason = format!("{}; {}", line.reason, words.join("; "));
}

/// What decisions about one subject come to, and in words: one counts; of several that contradict each other none does, and a
/// person decides.
fn together(standing: &[Arc<ReviewEntry>]) -> (Decision, String) {
    let words: Vec<String> = standing.iter().map(|entry| in_words(entry)).collect();
    match standing {
        [one] => (one.review.action.decision().unwrap_or(Decision::Person), words.join("")),
        _ => (Decision::Person, format!("decisions contradict each other: {}", words.join("; "))),
    }
}

fn in_words(entry: &ReviewEntry) -> String {
    let Review { action, person, reason, .. } = &entry.review;
    format!("{person} decided {} ({reason})", action.name())
}
