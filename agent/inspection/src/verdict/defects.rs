//! Rules for defects on a component: area, length, depth, share, count and confidence of the findings.

use super::comparison::{Compared, at_most, follows, undecided};
use super::wording::{percent, plain, shown, shown_share};
use super::{MM, MM2};
use crate::findings::LEAST_VOXELS;
use semascan_model::criteria::DefectRule;
use semascan_model::finding::{ComponentFigures, Finding, FindingId, FindingsRecord, Quantity, RegionFigures};
use semascan_model::verdict::{Conformity, Decision, JudgedFigure, VerdictLine};

/// What a rule says of the findings of its defect on one component. `expected` says whether another rule judges whether the
/// component was seen.
pub(super) fn defect_lines(
    lines: &mut Vec<VerdictLine>,
    record: &FindingsRecord,
    rule: &DefectRule,
    component: &ComponentFigures,
    expected: bool,
) {
    let on = format!("{} on {}", rule.defect, component.component.name);
    let defect = record.looked_for.iter().find(|class| class.name == rule.defect).cloned();
    let line = |figure| VerdictLine {
        component: Some(component.component.clone()),
        defect: defect.clone(),
        ..undecided(figure, "")
    };
    if component.area.value <= 0.0 {
        if !expected {
            let reason = format!("{on}: nothing of the component was seen, and no rule says whether it must be there");
            lines.push(VerdictLine { reason, ..line(JudgedFigure::Completeness) });
        }
        return;
    }
    let own: Vec<&Finding> = record
        .list
        .iter()
        .filter(|f| f.component.class == component.component.class)
        .filter(|f| f.kind.defect().is_some_and(|d| d.name == rule.defect))
        .collect();
    if rule.then == Decision::Accept {
        lines.push(VerdictLine {
            findings: own.iter().map(|f| f.id).collect(),
            conformity: Conformity::Holds,
            decision: Decision::Accept,
            reason: format!("{on}: {} findings, which are accepted whatever their size", own.len()),
            ..line(JudgedFigure::Coverage)
        });
        return;
    }
    let small =
        record.left_out.iter().find(|l| l.component.class == component.component.class && l.defect.name == rule.defect);
    let region = |f: &Finding, of: fn(&RegionFigures) -> Option<Quantity>| f.region.as_ref().and_then(of);
    if let Some(limit) = rule.largest_area_mm2.map(|a| a * MM2) {
        let values: Vec<_> = own.iter().map(|f| (f.id, region(f, |r| Some(r.area)))).collect();
        let mut compared = Compared::at_most(&values, limit);
        compared.doubt(small.is_some() && limit < record.least_area);
        let reason =
            format!("{on}: largest area {}, at most {}", shown(compared.value, (MM2, "mm2")), plain(limit / MM2));
        lines.push(compared.line(line(JudgedFigure::Area), rule.then, limit, &reason));
    }
    if let Some(limit) = rule.largest_length_mm.map(|l| l * MM) {
        let values: Vec<_> = own.iter().map(|f| (f.id, region(f, |r| Some(r.length)))).collect();
        let mut compared = Compared::at_most(&values, limit);
        // Small regions may be thin and long, but not longer than all their voxels in a row.
        let longest = small.map_or(0.0, |_| (LEAST_VOXELS * record.least_area).sqrt());
        compared.doubt(limit < longest);
        let reason =
            format!("{on}: largest length {}, at most {}", shown(compared.value, (MM, "mm")), plain(limit / MM));
        lines.push(compared.line(line(JudgedFigure::Length), rule.then, limit, &reason));
    }
    if let Some(limit) = rule.largest_depth_mm.map(|l| l * MM) {
        let values: Vec<_> = own.iter().map(|f| (f.id, region(f, |r| r.depth.reference.or(r.depth.fitted)))).collect();
        let compared = Compared::at_most(&values, limit);
        let reason =
            format!("{on}: largest depth {}, at most {}", shown(compared.value, (MM, "mm")), plain(limit / MM));
        lines.push(compared.line(line(JudgedFigure::Depth), rule.then, limit, &reason));
    }
    if let Some(limit) = rule.largest_share {
        let value = share(&own, component, small.map_or(0.0, |s| s.area));
        let conformity = value.map_or(Conformity::Undecided, |v| at_most(v, limit));
        lines.push(VerdictLine {
            findings: own.iter().map(|f| f.id).collect(),
            value,
            limit: Some(limit),
            conformity,
            decision: follows(conformity, rule.then),
            reason: format!("{on}: {} of the surface that was seen, at most {}", percent(value), shown_share(limit)),
            ..line(JudgedFigure::Share)
        });
    }
    if let Some(limit) = rule.largest_count {
        let from = rule.counted_from_mm2.map_or(record.least_area, |a| (a * MM2).max(record.least_area));
        let (value, ids) = count(&own, from);
        let conformity = at_most(value, f64::from(limit));
        let (low, high) = value.interval().unwrap_or((value.value, value.value));
        let between = if low < high { format!("{low} to {high}") } else { format!("{low}") };
        lines.push(VerdictLine {
            findings: ids,
            value: Some(value),
            limit: Some(f64::from(limit)),
            conformity,
            decision: follows(conformity, rule.then),
            reason: format!("{on}: {between} findings of {:.1} mm2 or more, at most {limit}", from / MM2),
            ..line(JudgedFigure::Count)
        });
    }
    if let Some(limit) = rule.least_confidence {
        let values: Vec<_> = own
            .iter()
            .map(|f| (f.id, region(f, |r| Some(Quantity::with_standard(r.confidence.mean, r.sigma.all.mean)))))
            .collect();
        let compared = Compared::at_least(&values, limit);
        let reason = format!("{on}: least confidence {}, at least {}", percent(compared.value), shown_share(limit));
        lines.push(compared.line(line(JudgedFigure::Confidence), rule.then, limit, &reason));
    }
}

/// The share of a component's seen area that findings take, with what is too small to be one.
fn share(findings: &[&Finding], component: &ComponentFigures, small: f64) -> Option<Quantity> {
    let areas: Vec<Quantity> = findings.iter().filter_map(|f| f.area()).collect();
    let value = (areas.iter().map(|a| a.value).sum::<f64>() + small) / component.area.value;
    // What makes one area too large makes others too large as well: their uncertainties are summed.
    let of_findings: Option<f64> = areas.iter().map(|a| a.expanded).sum();
    let relative = component.area.expanded? / component.area.value;
    Some(Quantity { value, expanded: of_findings.map(|u| (u / component.area.value).hypot(value * relative)) })
}

/// How many findings have at least the area `from`, with as much uncertainty as there are findings that may or may not; and
/// those that may.
fn count(findings: &[&Finding], from: f64) -> (Quantity, Vec<FindingId>) {
    let (mut surely, mut maybe) = (0_u32, Vec::new());
    for finding in findings {
        match finding.area().map(Quantity::interval) {
            Some(Some((low, _))) if low >= from => {
                surely += 1;
                maybe.push(finding.id);
            }
            Some(Some((_, high))) if high < from => {}
            _ => maybe.push(finding.id),
        }
    }
    let (low, high) = (f64::from(surely), maybe.len() as f64);
    (Quantity { value: 0.5 * (low + high), expanded: Some(0.5 * (high - low)) }, maybe)
}
