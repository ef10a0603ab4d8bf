//! The head of the report: what was inspected, what follows, and the figures that one looks for first.

use crate::{Report, described, findings};
use maud::{Markup, html};
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::verdict::{Conformity, Decision};

pub(super) fn summary(report: &Report<'_>) -> Markup {
    let record = report.record;
    html! {
        header {
            div.title {
                p.kicker { "Inspection report" }
                h1 { (record.part) }
                p.sub { "Inspection " code { (record.id) } }
            }
            (seal(record))
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

/// The decision, and who made it.
fn seal(record: &InspectionRecord) -> Markup {
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
