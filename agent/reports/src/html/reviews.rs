//! What people decided after the inspection, entry by entry, and whether the log that says so is what was written.

use super::summary::{class, time};
use crate::{Audit, Report, Reviewed, described, findings};
use maud::{Markup, html};
use semascan_model::finding::FindingId;
use semascan_model::review::{ReviewAction, ReviewEntry, ReviewId, Subject};

pub(super) fn reviews(report: &Report<'_>) -> Markup {
    let Some(reviewed) = report.reviewed else { return html! {} };
    html! {
        section #reviews {
            h2 { "Reviews" }
            @if reviewed.entries.is_empty() {
                p { "Nobody has reviewed this inspection." }
            } @else {
                (entries(report, reviewed))
                @if reviewed.state.is_verdict_outdated {
                    p.note {
                        "The lines of the verdict are those of the findings as they were measured: people have changed findings since."
                    }
                }
            }
            (audit(&reviewed.audit))
        }
    }
}

/// What was said of one finding, beside its figures.
pub(super) fn of_finding(report: &Report<'_>, id: FindingId) -> Markup {
    let all = report.reviewed.map_or(&[][..], |reviewed| &reviewed.entries);
    let of_it = |entry: &&ReviewEntry| entry.review.subject == Subject::Finding { finding: id };
    let entries: Vec<&ReviewEntry> = all.iter().filter(of_it).collect();
    html! {
        @if !entries.is_empty() {
            h4 { "Reviewed" }
            ul.judged { @for entry in entries { li { (said(entry)) " " (entry.review.reason) " (" (entry.review.person) ")" } } }
        }
    }
}

fn entries(report: &Report<'_>, reviewed: &Reviewed) -> Markup {
    html! {
        table.lines {
            thead { tr { th.number { "No." } th { "When" } th { "Who" } th { "What" } th { "Review" } th { "Reason" } } }
            tbody {
                @for entry in &reviewed.entries {
                    tr {
                        td.number { (entry.sequence) }
                        td { (time(entry.at)) }
                        td { (entry.review.person) }
                        td { (subject(report, &entry.review.subject)) }
                        td { (said(entry)) (references(reviewed, entry)) }
                        td.reason { (entry.review.reason) }
                    }
                }
            }
        }
    }
}

/// What a person did, decisions as badges.
fn said(entry: &ReviewEntry) -> Markup {
    let action = &entry.review.action;
    match action.decision() {
        Some(decision) => html! { span.badge.(class(decision)) { (described::decision(decision)) } },
        None => html! { (described::action(action)) },
    }
}

/// The entries that one contradicts, settles or withdraws.
fn references(reviewed: &Reviewed, entry: &ReviewEntry) -> Markup {
    let numbers = |ids: &[ReviewId]| {
        let of = |id: &ReviewId| reviewed.entries.iter().find(|entry| entry.review.id == *id);
        ids.iter().filter_map(of).map(|entry| entry.sequence.to_string()).collect::<Vec<_>>().join(", ")
    };
    html! {
        @if !entry.conflicts_with.is_empty() { " contradicts no. " (numbers(&entry.conflicts_with)) }
        @if let ReviewAction::Withdraw { review } = &entry.review.action { ": no. " (numbers(&[*review])) }
        @if !entry.review.resolves.is_empty() { " settles no. " (numbers(&entry.review.resolves)) }
    }
}

fn subject(report: &Report<'_>, subject: &Subject) -> Markup {
    match subject {
        Subject::Part => html! { "the part" },
        Subject::Component { component } => html! { (component) },
        Subject::Finding { finding } => match findings(report.record).iter().position(|known| known.id == *finding) {
            Some(place) => html! { a href=(format!("#finding-{}", place + 1)) { "finding #" (place + 1) } },
            None => html! { "drawn finding " code { (finding) } },
        },
    }
}

fn audit(audit: &Audit) -> Markup {
    html! {
        @match audit {
            Audit::Good { entries: 0, .. } => p.note { "The log of reviews is empty." },
            Audit::Good { entries, head } => p.note {
                "The log of reviews was read whole when this report was made, and is what was written: " (entries)
                @if *entries == 1 { " entry. " } @else { " entries. " }
                "The last one has the hash " code { (head) } "."
            },
            Audit::Broken { sequence, reason } => p.warning {
                "The log of reviews is not what was written: entry " (sequence) " " (reason) "."
            },
        }
    }
}
