//! The head of the report: what was inspected, what follows, and the figures that one looks for first.

use crate::{Report, Reviewed, described, findings};
use maud::{Markup, html};
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::review::{ReviewEntry, Subject};
use semascan_model::verdict::{Conformity, Decision, Verdict};

pub(super) fn summary(report: &Report<'_>) -> Markup {
    let record = report.record;
    html! {
        header {
            div.title {
                p.kicker { "Inspection report" }
                h1 { (record.part) }
                p.sub { "Inspection " code { (record.id) } }
            }
            (seal(report))
        }
        @if record.outcome != Outcome::Finished {
            p.warning { "This inspection is not complete: " (described::outcome(&record.outcome)) "." }
        }
        (reasons(record))
        dl.facts {
            (fact("Began", &time(record.began)))
            (fact("Took", &record.ended.map_or_else(|| "not known".into(), |ended| {
                format!("{:.1} s", ended.duration_since(record.began).as_secs_f64())
            })))
            (fact("Views used", &views(record)))
            (fact("Voxel", &record.voxel.map_or_else(|| "none".into(), |v| format!("{:.3} mm", v * 1e3))))
            (fact("Findings", &finding_count(record)))
            (fact("Labels", described::labels(record.labels)))
            (fact("Criteria", &record.verdict.as_ref().map_or_else(|| "not judged".into(), |v| {
                format!("{}, revision {}", v.criteria.name, v.criteria.revision)
            })))
            (fact("Software", &format!("{} {}", record.software.name, record.software.version)))
        }
    }
}

/// The decision that counts, and who made it.
fn seal(report: &Report<'_>) -> Markup {
    match report.reviewed.and_then(|reviewed| seal_of_reviews(report.record, reviewed)) {
        Some(seal) => seal,
        None => seal_of_record(report.record),
    }
}

/// What people made of it in the log of reviews; `None` where they left it at what the record says.
fn seal_of_reviews(record: &InspectionRecord, reviewed: &Reviewed) -> Option<Markup> {
    let automatic = record.verdict.as_ref().map(Verdict::decision);
    let part = reviewed.state.subjects.iter().find(|state| state.subject == Subject::Part);
    if part.is_some_and(|part| !part.conflict.is_empty()) {
        return Some(html! {
            div.seal.(class(Decision::Person)) { strong { (described::decision(Decision::Person)) } span { "reviewers disagree" } }
        });
    }
    let of_part =
        |entry: &&ReviewEntry| entry.review.subject == Subject::Part && entry.review.action.decision().is_some();
    let decided = part.and_then(|part| part.decision).zip(reviewed.entries.iter().rfind(of_part));
    let (decision, by) = match decided {
        Some((decision, entry)) => (decision, format!("by {}, {}", entry.review.person, time(entry.at))),
        None => {
            let decision = reviewed.state.decision.filter(|decision| automatic.is_some_and(|a| a != *decision))?;
            (decision, "by the criteria, with findings as people changed them".to_owned())
        }
    };
    Some(html! {
        div.seal.(class(decision)) {
            strong { (described::decision(decision)) }
            span { (by) }
            @if let Some(automatic) = automatic.filter(|automatic| *automatic != decision) {
                span { "before reviews: " (described::decision(automatic)) }
            }
        }
    })
}

/// What the record says.
fn seal_of_record(record: &InspectionRecord) -> Markup {
    let Some(verdict) = &record.verdict else {
        return html! { div.seal.open { strong { "not judged" } span { "no criteria were applied" } } };
    };
    let decision = verdict.decision();
    let by = match verdict.overrides.last() {
        Some(person) => format!("by {}, {}", person.person, time(person.at)),
        None => format!("by the criteria, {}", time(verdict.at)),
    };
    html! {
        div.seal.(class(decision)) {
            strong { (described::decision(decision)) }
            span { (by) }
            @if !verdict.overrides.is_empty() && verdict.automatic != decision {
                span { "the criteria alone: " (described::decision(verdict.automatic)) }
            }
        }
    }
}

/// Lines that are not simply kept, the heaviest first, so that the first page says why.
fn reasons(record: &InspectionRecord) -> Markup {
    const MOST: usize = 6;
    let Some(verdict) = &record.verdict else { return html! {} };
    let order = [Decision::Reject, Decision::Person, Decision::Rework, Decision::Accept];
    let mut lines: Vec<_> = verdict
        .lines
        .iter()
        .filter(|line| line.decision != Decision::Accept || line.conformity != Conformity::Holds)
        .collect();
    lines.sort_by_key(|line| order.iter().position(|decision| *decision == line.decision));
    html! {
        @if lines.is_empty() {
            p.lead { "All " (verdict.lines.len()) " criteria hold." }
        } @else {
            ul.reasons {
                @for line in lines.iter().take(MOST) {
                    li { span.badge.(class(line.decision)) { (described::decision(line.decision)) } " " (line.reason) }
                }
                @if lines.len() > MOST {
                    li.more { "and " (lines.len() - MOST) " more, see “Verdict by criterion”" }
                }
            }
        }
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}

fn views(record: &InspectionRecord) -> String {
    match &record.run {
        Some(run) => format!("{} of {}", run.used, run.views),
        None => {
            format!("{} of {}", record.views.iter().filter(|view| view.accepted).count(), record.views.len())
        }
    }
}

fn finding_count(record: &InspectionRecord) -> String {
    match &record.findings {
        None => "not known".into(),
        Some(found) if found.not_looked.is_some() && found.list.is_empty() => "nobody looked for defects".into(),
        Some(_) => findings(record).len().to_string(),
    }
}

/// Seconds are enough for people.
pub(super) fn time(at: jiff::Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M:%S UTC").to_string()
}

/// The class of a decision in the style sheet.
pub(super) fn class(decision: Decision) -> &'static str {
    decision.name()
}
