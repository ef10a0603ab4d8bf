//! What was left out, and why: whoever reads the report knows what it does not speak of.

use crate::figure::{Unit, alone, plain};
use crate::{MOST_PICTURED, Report, described};
use maud::{Markup, html};
use semascan_model::record::{InspectionRecord, LabelSource, Outcome};

/// Views that are named; of more the number is said.
const MOST_NAMED: usize = 20;

pub(super) fn left_out(report: &Report<'_>) -> Markup {
    let said = statements(report);
    html! {
        section #left-out {
            h2 { "What was left out" }
            @if said.is_empty() { p { "Nothing: every view was used whole." } } @else {
                ul { @for statement in said { li { (statement) } } }
            }
        }
    }
}

fn statements(report: &Report<'_>) -> Vec<String> {
    let record = report.record;
    let mut said = Vec::new();
    if record.outcome != Outcome::Finished {
        said.push(format!("The inspection: {}.", described::outcome(&record.outcome)));
    }
    rejected_views(record, &mut said);
    out_of_domain(record, &mut said);
    if let Some(run) = &record.run {
        if !run.sufficient {
            said.push(format!(
                "Only {:.0} % of the views were used; {:.0} % were asked for.",
                100.0 * run.share,
                100.0 * run.least_share
            ));
        }
        if run.region.left_out() > 0 {
            said.push(format!("Region of interest: {}.", run.region));
        }
        if run.surfaces_thinned == Some(false) {
            said.push("Noisy surfaces were not made thin: they are as thick as the noise of the depth.".into());
        }
    }
    let surface: u64 = record.components.iter().map(|c| c.points).sum();
    if surface < record.points {
        said.push(format!(
            "{} of {} points are stray, uncertain or background: they are in cloud.ply, and no figure counts them.",
            record.points - surface,
            record.points
        ));
    }
    if record.labels == LabelSource::None {
        said.push("No labels were used: components and defects are not known.".into());
    }
    findings(report, &mut said);
    let misidentified: usize = record.views.iter().map(|view| view.misidentified.len()).sum();
    if misidentified > 0 {
        said.push(format!(
            "{misidentified} objects of views are not what their labels say; their labels did not count."
        ));
    }
    said
}

fn rejected_views(record: &InspectionRecord, said: &mut Vec<String>) {
    let rejected: Vec<_> = record.views.iter().filter(|view| !view.accepted).collect();
    for view in rejected.iter().take(MOST_NAMED) {
        let reason = view.reason.as_deref().unwrap_or("no reason is recorded");
        said.push(format!("View {}: {reason}.", view.index));
    }
    if rejected.len() > MOST_NAMED {
        said.push(format!("{} more views, each with its reason in inspection.json.", rejected.len() - MOST_NAMED));
    }
}

fn out_of_domain(record: &InspectionRecord, said: &mut Vec<String>) {
    let judged: Vec<_> = record.views.iter().filter_map(|view| Some((view, view.networks.as_ref()?))).collect();
    let outside: Vec<String> = judged
        .iter()
        .filter(|(_, networks)| networks.domain.is_some_and(|domain| domain.outside))
        .map(|(view, _)| view.index.to_string())
        .collect();
    if !outside.is_empty() {
        let named = outside.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join(", ");
        let more = if outside.len() > MOST_NAMED { " and more" } else { "" };
        said.push(format!(
            "Labels of {} of {} views (view {named}{more}): they are unlike those that the networks were trained for.",
            outside.len(),
            judged.len()
        ));
    }
    let unknown = judged.iter().filter(|(_, networks)| networks.domain.is_none()).count();
    if unknown > 0 {
        said.push(format!(
            "Whether {unknown} of {} views are like those that the networks were trained for is not known.",
            judged.len()
        ));
    }
    let blind = judged.iter().filter(|(_, networks)| networks.window.is_none()).count();
    if blind > 0 {
        said.push(format!("In {blind} views the part was out of the networks' sight."));
    }
}

fn findings(report: &Report<'_>, said: &mut Vec<String>) {
    let Report { record, pictures, photographs, .. } = report;
    let Some(found) = &record.findings else {
        said.push("Findings: the record holds none, which is no sign that there are none.".into());
        return;
    };
    if let Some(why) = &found.not_looked {
        said.push(format!("Defects: {why}."));
    }
    let (regions, area) = found.left_out.iter().fold((0, 0.0), |(n, a), one| (n + one.regions, a + one.area));
    if regions > 0 {
        said.push(format!(
            "{regions} regions below {} mm², {} mm² together, are no findings.",
            alone(found.least_area, Unit::SquareMillimetre),
            alone(area, Unit::SquareMillimetre)
        ));
    }
    let unjudged: f64 = found.components.iter().map(|component| component.unjudged).sum();
    if unjudged > 0.0 && found.not_looked.is_none() {
        let whole: f64 = found.components.iter().map(|component| component.area.value).sum();
        said.push(format!(
            "On {} mm² of the components ({} %) nobody knows whether there is a defect: no label speaks of it.",
            alone(unjudged, Unit::SquareMillimetre),
            plain(100.0 * unjudged / whole.max(f64::MIN_POSITIVE), 2)
        ));
    }
    let placed = found.list.iter().filter(|finding| finding.region.is_some()).count();
    if placed > MOST_PICTURED {
        said.push(format!("Pictures of {} findings: the {MOST_PICTURED} largest have some.", placed - MOST_PICTURED));
    }
    if placed > 0 && pictures.findings.is_empty() {
        said.push("Drawn pictures of findings: there is no mesh to draw.".into());
    }
    if let Some(why) = &photographs.missing {
        said.push(format!("Photographs: {why}."));
    }
    let unseen = found.list.iter().filter(|f| f.region.as_ref().is_some_and(|region| region.views.is_empty())).count();
    if unseen > 0 {
        said.push(format!("{unseen} findings have no view of their own: they cannot be photographed."));
    }
}
