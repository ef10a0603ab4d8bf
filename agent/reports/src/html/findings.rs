//! Every finding: an overview, then each with its pictures, its figures and what its uncertainty is made of.

use super::model::{listed, scale_bar};
use super::summary::{class, time};
use super::{data_url, or_dash, reviews};
use crate::figure::{Unit, alone, plain, with_uncertainty};
use crate::photograph::Photograph;
use crate::{Report, described};
use maud::{Markup, html};
use semascan_model::finding::{AreaBudget, Finding, FindingKind, Quantity, RegionFigures, Spread};
use semascan_model::verdict::{Decision, VerdictLine};

/// Findings that have a section of their own; the rest is in the overview.
const MOST_SECTIONS: usize = 300;

pub(super) fn findings(report: &Report<'_>) -> Markup {
    let list = crate::findings(report.record);
    html! {
        section #findings {
            h2 { "Findings" }
            @if list.is_empty() {
                p { (nothing(report)) }
            } @else {
                (overview(report, list))
                @if list.len() > MOST_SECTIONS {
                    p.note { "The first " (MOST_SECTIONS) " are shown one by one below; all are in inspection.json." }
                }
                @for (i, finding) in list.iter().enumerate().take(MOST_SECTIONS) { (one(report, i + 1, finding)) }
            }
        }
    }
}

/// Why there are none: only where defects were looked for is that a statement about the part.
fn nothing(report: &Report<'_>) -> String {
    match &report.record.findings {
        None => "Nothing is known of findings: the record holds none, which is no sign that there are none.".into(),
        Some(found) => match &found.not_looked {
            Some(why) => format!("Nobody looked for defects: {why}."),
            None => {
                let names: Vec<&str> = found.looked_for.iter().map(|class| class.name.as_str()).collect();
                format!(
                    "None. Looked for: {}; regions below {} mm² are no findings.",
                    names.join(", "),
                    alone(found.least_area, Unit::SquareMillimetre)
                )
            }
        },
    }
}

fn overview(report: &Report<'_>, list: &[Finding]) -> Markup {
    let cell = |quantity: Option<Quantity>, unit| or_dash(quantity.map(|q| with_uncertainty(q, unit)));
    html! {
        table.overview {
            thead { tr {
                th { "#" } th { "Finding" } th.number { "Area" br; "mm²" } th.number { "Length" br; "mm" }
                th.number { "Width" br; "mm" } th.number { "Depth" br; "mm" } th.number { "Confidence" } th.number { "Views" }
                th { "Follows" }
            } }
            tbody {
                @for (i, finding) in list.iter().enumerate() {
                    @let region = finding.region.as_ref();
                    tr {
                        td { @if i < MOST_SECTIONS { a href=(format!("#finding-{}", i + 1)) { (i + 1) } } @else { (i + 1) } }
                        td { (described::finding(finding)) }
                        td.number { (cell(finding.area(), Unit::SquareMillimetre)) }
                        td.number { (cell(region.map(|r| r.length), Unit::Millimetre)) }
                        td.number { (cell(region.map(|r| r.width), Unit::Millimetre)) }
                        td.number { (cell(region.and_then(depth), Unit::Millimetre)) }
                        td.number { (or_dash(region.map(|r| plain(r.confidence.mean, 2)))) }
                        td.number { (or_dash(region.map(|r| r.views.len().to_string()))) }
                        td { (follows(report, finding)) }
                    }
                }
            }
        }
    }
}

/// The depth that counts: against the reference where there is one.
fn depth(region: &RegionFigures) -> Option<Quantity> {
    region.depth.reference.or(region.depth.fitted)
}

/// What follows from a finding by the criteria: the heaviest of its lines.
fn follows(report: &Report<'_>, finding: &Finding) -> Markup {
    let lines = lines_of(report, finding);
    let decision = lines.iter().map(|line| line.decision).reduce(Decision::with);
    html! {
        @match decision {
            Some(decision) => span.badge.(class(decision)) { (described::decision(decision)) },
            None => span.none { "–" },
        }
    }
}

fn lines_of<'a>(report: &'a Report<'_>, finding: &Finding) -> Vec<&'a VerdictLine> {
    let verdict = report.record.verdict.as_ref();
    verdict.into_iter().flat_map(|verdict| &verdict.lines).filter(|line| line.findings.contains(&finding.id)).collect()
}

fn one(report: &Report<'_>, number: usize, finding: &Finding) -> Markup {
    html! {
        article.finding id=(format!("finding-{number}")) {
            h3 {
                span.number { (number) } " " (described::finding(finding)) " " (follows(report, finding))
                code.id { (finding.id) }
            }
            @if let Some(region) = &finding.region { (pictures(report, finding, region)) }
            div.columns {
                div { (figures(finding)) (drawn_note(report, finding)) }
                div {
                    @if let Some(region) = &finding.region { (budget(&region.area_budget, region.area)) }
                    @let lines = lines_of(report, finding);
                    @if !lines.is_empty() {
                        h4 { "Judged" }
                        ul.judged {
                            @for line in lines {
                                li { span.badge.(class(line.decision)) { (described::decision(line.decision)) } " " (line.reason) }
                            }
                        }
                    }
                    (reviews::of_finding(report, finding.id))
                }
            }
        }
    }
}

fn pictures(report: &Report<'_>, finding: &Finding, region: &RegionFigures) -> Markup {
    let drawn = report.pictures.findings.get(&finding.id);
    let photographs = report.photographs.of.get(&finding.id).map_or(&[][..], Vec::as_slice);
    html! {
        div.grid.three {
            @if let Some(picture) = drawn {
                @let (width, height) = picture.size;
                figure.picture {
                    div.frame {
                        img src=(data_url(&picture.jpeg)) width=(width) height=(height) alt="the finding on the model";
                        svg.overlay viewBox=(format!("0 0 {width} {height}")) aria-hidden="true" {
                            (scale_bar(picture.pixel, picture.size))
                        }
                    }
                    figcaption {
                        "model"
                        @if picture.seen < 0.95 { "; " (plain(100.0 * picture.seen, 0)) " % of the outline is seen from here" }
                    }
                }
            }
            @for photograph in photographs { (shot(finding, region, photograph)) }
        }
        @if drawn.is_none() && photographs.is_empty() {
            p.note { "No pictures of this finding: see “What was left out”." }
        }
    }
}

fn shot(finding: &Finding, region: &RegionFigures, photograph: &Photograph) -> Markup {
    let Photograph { view, crop, jpeg, outline } = photograph;
    let seen = region.views.iter().find(|seen| seen.view == *view);
    html! {
        figure.picture.photograph data-finding=(finding.id) data-view=(view)
            data-crop=(format!("{} {} {} {}", crop.left, crop.top, crop.width, crop.height))
            data-contradicted[outline.contradicted] {
            div.frame {
                img src=(data_url(jpeg)) width=(crop.width) height=(crop.height) alt=(format!("photograph of view {view}"));
                svg.overlay viewBox=(format!("0 0 {} {}", crop.width, crop.height)) preserveAspectRatio="none"
                    aria-hidden="true" {
                    @if !outline.seen.is_empty() { path.halo d=(outline.seen) {} path.outline d=(outline.seen) {} }
                    @if !outline.unmeasured.is_empty() {
                        path.halo d=(outline.unmeasured) {} path.outline.dashed d=(outline.unmeasured) {}
                    }
                }
            }
            figcaption {
                "photograph, view " (view)
                @if let Some(seen) = seen {
                    ": " (plain(100.0 * seen.share, 0)) " % seen at " (plain(seen.cosine.clamp(-1.0, 1.0).acos().to_degrees(), 0)) "°"
                }
                @if !outline.unmeasured.is_empty() { "; dashed: no depth" }
                @if outline.contradicted { "; no outline: the view's depth does not agree with it" }
            }
        }
    }
}

fn figures(finding: &Finding) -> Markup {
    let row = |name: &str, value: Markup| html! { tr { th { (name) } td { (value) } } };
    let with_unit = |quantity: Quantity, unit: Unit| html! { (with_uncertainty(quantity, unit)) " " (unit.symbol()) };
    html! {
        table.figures {
            tbody {
                @if !finding.instances.is_empty() { (row("Instances", html! { (listed(&finding.instances)) })) }
                (about(&finding.kind))
                @if let Some(region) = &finding.region {
                    (row("Area", with_unit(region.area, Unit::SquareMillimetre)))
                    (row("Length", with_unit(region.length, Unit::Millimetre)))
                    (row("Width", with_unit(region.width, Unit::Millimetre)))
                    (row("Outline", html! {
                        (alone(region.perimeter, Unit::Millimetre)) " mm"
                        @if region.outlines.len() > 1 { " in " (region.outlines.len()) " curves" }
                    }))
                    (row("Depth", html! {
                        @match (&region.depth.fitted, &region.depth.unknown) {
                            (Some(depth), _) => { (with_unit(*depth, Unit::Millimetre)) " below its surroundings" },
                            (None, Some(why)) => { "not known: " (why) },
                            (None, None) => "not known",
                        }
                    }))
                    @if let Some(depth) = region.depth.reference {
                        (row("", html! { (with_unit(depth, Unit::Millimetre)) " below the reference" }))
                    }
                    (row("Confidence", spread(&region.confidence)))
                    (row("Sigma", html! {
                        (spread(&region.sigma.all))
                        @if let (Some(data), Some(model)) = (region.sigma.data, region.sigma.model) {
                            "; data " (plain(data.mean, 3)) ", model " (plain(model.mean, 3))
                        }
                    }))
                    (row("Position", html! { (vector(region.position, 1e3, 1)) " mm, table frame" }))
                    @if region.normal != [0.0; 3] { (row("Normal", html! { (vector(region.normal, 1.0, 2)) })) }
                    (row("Views", html! {
                        (region.views.len())
                        @if !region.views.is_empty() { ": " (views(region)) }
                    }))
                }
            }
        }
    }
}

/// What the figures of a drawn finding mean, and what they leave out.
fn drawn_note(report: &Report<'_>, finding: &Finding) -> Markup {
    let outlines = report.reviewed.map_or(&[][..], |reviewed| &reviewed.state.drawn);
    let note = outlines.iter().find(|outline| outline.finding == finding.id).and_then(|outline| outline.note.as_ref());
    html! {
        @if matches!(finding.kind, FindingKind::Drawn { .. }) && finding.region.is_some() {
            p.note {
                "Measured on the model within the curve that was drawn: how well the curve follows the defect is not in the "
                "uncertainty. Confidence and sigma are those of the model's own labels there."
            }
        }
        @if let Some(note) = note { p.note { "Of the drawn curve: " (note) "." } }
    }
}

/// What only findings of a kind have.
fn about(kind: &FindingKind) -> Markup {
    let row = |name: &str, value: Markup| html! { tr { th { (name) } td { (value) } } };
    match kind {
        FindingKind::Defect { .. } => html! {},
        FindingKind::Completeness { share, least, missing } => html! {
            (row("Seen", html! {
                @match share {
                    Some(share) => { (with_uncertainty(*share, Unit::Percent)) " % of the expected area" },
                    None if *missing => "nothing",
                    None => "less than expected",
                }
            }))
            (row("Expected", html! { "at least " (plain(100.0 * least, 1)) " %" }))
        },
        FindingKind::Deviation { tolerance, greatest } => html! {
            (row("Deviation", html! { (with_uncertainty(*greatest, Unit::Millimetre)) " mm at most" }))
            (row("Tolerated", html! { (alone(*tolerance, Unit::Millimetre)) " mm" }))
        },
        FindingKind::Drawn { person, at, comment, .. } => html! {
            (row("Drawn by", html! { (person) ", " (time(*at)) }))
            (row("Comment", html! { (comment) }))
        },
    }
}

fn spread(spread: &Spread) -> Markup {
    html! { (plain(spread.mean, 3)) " (" (plain(spread.least, 2)) " to " (plain(spread.greatest, 2)) ")" }
}

fn vector(v: [f64; 3], factor: f64, digits: usize) -> String {
    v.map(|c| plain(c * factor, digits)).join(", ")
}

fn views(region: &RegionFigures) -> String {
    const MOST: usize = 8;
    let shown = region.views.iter().take(MOST).map(|view| format!("{} ({:.0} %)", view.view, 100.0 * view.share));
    let list = shown.collect::<Vec<_>>().join(", ");
    match region.views.len().checked_sub(MOST) {
        Some(more) if more > 0 => format!("{list} and {more} more"),
        _ => list,
    }
}

/// What the uncertainty of an area is made of, as bars of standard uncertainties.
fn budget(budget: &AreaBudget, area: Quantity) -> Markup {
    let AreaBudget { grid, other_components, unseen, convention, labels, poses } = *budget;
    let parts = [
        ("grid", Some(grid)),
        ("rim to other components", Some(other_components)),
        ("rim to the unseen", Some(unseen)),
        ("convention of areas", Some(convention)),
        ("labels", Some(labels)),
        ("poses", poses),
    ];
    let largest = parts.iter().filter_map(|(_, part)| *part).fold(0.0, f64::max);
    html! {
        h4 { "Standard uncertainty of the area" }
        table.budget {
            tbody {
                @for (name, part) in parts {
                    tr {
                        th { (name) }
                        td.bar {
                            @if let Some(part) = part.filter(|part| *part > 0.0 && largest > 0.0) {
                                svg.bar viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true" {
                                    rect width=(format!("{:.1}", 100.0 * part / largest)) height="8" {}
                                }
                            }
                        }
                        td.number {
                            @match part {
                                Some(part) => { (alone(part, Unit::SquareMillimetre)) " mm²" },
                                None => "not known",
                            }
                        }
                    }
                }
                tr.sum {
                    th { "combined, times 2" } td {}
                    td.number {
                        @match area.expanded {
                            Some(expanded) => { "± " (alone(expanded, Unit::SquareMillimetre)) " mm²" },
                            None => "not known",
                        }
                    }
                }
            }
        }
    }
}
