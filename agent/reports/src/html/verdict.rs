//! Every criterion with its figure, its limit and its reason, and what people decided in place of it.

use super::or_dash;
use super::summary::{class, time};
use crate::{Report, described, findings};
use maud::{Markup, html};
use semascan_model::finding::FindingId;
use semascan_model::verdict::{Conformity, Decision, Verdict, VerdictLine};

pub(super) fn verdict(report: &Report<'_>) -> Markup {
    html! {
        section #verdict {
            h2 { "Verdict by criterion" }
            @match &report.record.verdict {
                None => p { "This inspection was not judged: no criteria were given. Nothing follows from it by itself." },
                Some(verdict) => (judged(report, verdict)),
            }
        }
    }
}

fn judged(report: &Report<'_>, verdict: &Verdict) -> Markup {
    let order = [Decision::Reject, Decision::Person, Decision::Rework, Decision::Accept];
    let mut lines: Vec<&VerdictLine> = verdict.lines.iter().collect();
    lines.sort_by_key(|line| order.iter().position(|decision| *decision == line.decision));
    let holds = |line: &&VerdictLine| line.decision == Decision::Accept && line.conformity == Conformity::Holds;
    let (held, open): (Vec<&VerdictLine>, Vec<&VerdictLine>) = lines.into_iter().partition(holds);
    html! {
        p {
            "Judged " (time(verdict.at)) " by " (verdict.software.name) " " (verdict.software.version) " with the criteria “"
            (verdict.criteria.name) "”, revision " (verdict.criteria.revision) ". A limit within the interval of its figure is "
            "decided by a person (ISO 14253-1)."
        }
        @if !open.is_empty() {
            table.lines {
                thead { tr {
                    th { "Criterion" } th.number { "Figure" } th.number { "Limit" } th { "Limit is" } th { "Follows" }
                    th { "Reason" }
                } }
                tbody {
                    @for line in open {
                        @let (value, limit) = described::value_and_limit(line);
                        tr {
                            td { (criterion(line)) (numbers(report, &line.findings)) }
                            td.number { (or_dash(value)) }
                            td.number { (or_dash(limit)) }
                            td.state { (described::conformity(line.conformity)) }
                            td { span.badge.(class(line.decision)) { (described::decision(line.decision)) } }
                            td.reason { (line.reason) }
                        }
                    }
                }
            }
        }
        @if !held.is_empty() {
            h3 { "Criteria that hold (" (held.len()) ")" }
            table.lines.held {
                thead { tr { th { "Criterion" } th.number { "Figure" } th.number { "Limit" } th { "Remark" } } }
                tbody {
                    @for line in held {
                        @let (value, limit) = described::value_and_limit(line);
                        @let is_known = value.is_some();
                        tr {
                            td { (criterion(line)) (numbers(report, &line.findings)) }
                            td.number { (or_dash(value)) }
                            td.number { (or_dash(limit)) }
                            // Where there is no figure the reason says why.
                            td.reason { @if !is_known { (line.reason) } }
                        }
                    }
                }
            }
        }
        @if !verdict.overrides.is_empty() {
            h3 { "Decisions of people" }
            p { "The last one counts." }
            table {
                thead { tr { th { "When" } th { "Who" } th { "Decision" } th { "Reason" } } }
                tbody {
                    @for person in &verdict.overrides {
                        tr {
                            td { (time(person.at)) }
                            td { (person.person) }
                            td { span.badge.(class(person.decision)) { (described::decision(person.decision)) } }
                            td { (person.reason) }
                        }
                    }
                }
            }
        }
    }
}

/// What a line is about.
fn criterion(line: &VerdictLine) -> Markup {
    let (figure, _) = described::judged(line.figure);
    html! {
        @match (&line.defect, &line.component) {
            (Some(defect), Some(component)) => { (defect.name) " on " (component.name) ": " (figure) },
            (None, Some(component)) => { (component.name) ": " (figure) },
            (Some(defect), None) => { (defect.name) ": " (figure) },
            (None, None) => (figure),
        }
    }
}

/// Links to the findings that a line is about.
fn numbers(report: &Report<'_>, ids: &[FindingId]) -> Markup {
    const MOST: usize = 12;
    let places = || ids.iter().filter_map(|id| findings(report.record).iter().position(|finding| finding.id == *id));
    html! {
        @if !ids.is_empty() {
            span.numbers {
                @for place in places().take(MOST) {
                    " " a href=(format!("#finding-{}", place + 1)) { "#" (place + 1) }
                }
                @if ids.len() > MOST { " and " (ids.len() - MOST) " more" }
            }
        }
    }
}
