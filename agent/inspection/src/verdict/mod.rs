//! From findings and criteria to a verdict, line by line with its reason.
//!
//! A figure keeps its limit where its whole interval does, and breaks it where no part of the interval keeps it
//! ([ISO 14253-1]). Where the limit lies within the interval, where the figure or its uncertainty is not known, where nobody
//! looked or nothing was seen, a person decides: what is not known is never accepted.

mod comparison;
mod components;
mod defects;
mod wording;

use crate::criteria::CheckedCriteria;
use crate::findings::expected_findings;
use comparison::Compared;
pub(crate) use comparison::undecided;
use components::component_lines;
use defects::defect_lines;
use jiff::Timestamp;
use semascan_model::criteria::{DefectRule, ReferenceRule};
use semascan_model::finding::{ComponentFigures, Finding, FindingKind, FindingsRecord, Quantity};
use semascan_model::record::{InspectionRecord, Outcome, SoftwareRecord};
use semascan_model::verdict::{Conformity, Decision, JudgedFigure, Verdict, VerdictLine};
use semascan_model::{SemanticMesh, Taxonomy};
use wording::{percent, shown, shown_share};

/// Square metres in a square millimetre, metres in a millimetre.
const MM2: f64 = 1e-6;
const MM: f64 = 1e-3;

/// Judges an inspection. What the criteria expect and was not found becomes findings of the record (components that were
/// not seen, surface off the reference), in place of those that earlier criteria made; the verdict replaces an earlier one, of
/// which the decisions of people stay. `mesh` is that of the model, with its classes; without it nothing can be compared with a
/// reference.
pub fn judge(
    record: &mut InspectionRecord,
    checked: &CheckedCriteria,
    mesh: Option<(&SemanticMesh, &Taxonomy)>,
    at: Timestamp,
) {
    let mut compared = false;
    if let Some(findings) = &mut record.findings {
        compared = expected_findings(findings, &checked.criteria, checked.reference.as_ref(), mesh, record.voxel);
    }
    let lines = lines(record, checked, compared);
    let automatic = lines.iter().fold(Decision::Accept, |all, line| all.with(line.decision));
    let overrides = record.verdict.take().map(|earlier| earlier.overrides).unwrap_or_default();
    let software = SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() };
    record.verdict = Some(Verdict { criteria: checked.record.clone(), software, at, automatic, lines, overrides });
}

/// Every comparison. `compared` says whether the surface was compared with the reference.
fn lines(record: &InspectionRecord, checked: &CheckedCriteria, compared: bool) -> Vec<VerdictLine> {
    let criteria = &checked.criteria;
    let mut lines = vec![inspection_line(record)];
    let Some(findings) = &record.findings else {
        lines.push(undecided(
            JudgedFigure::Inspection,
            "the record holds no findings: nobody looked, or nothing was kept",
        ));
        return lines;
    };
    for rule in &criteria.components {
        component_lines(&mut lines, record, findings, rule);
    }
    for rule in &criteria.defects {
        if let Some(why) = not_looked(findings, rule) {
            let reason = format!("nobody looked for {}: {why}", rule.defect);
            lines.push(undecided(JudgedFigure::Coverage, &reason));
            continue;
        }
        for figures in &findings.components {
            let own = rule.component.as_ref().is_some_and(|name| *name == figures.component.name);
            let is_special = |other: &DefectRule| {
                other.defect == rule.defect && other.component.as_ref() == Some(&figures.component.name)
            };
            if own || (rule.component.is_none() && !criteria.defects.iter().any(is_special)) {
                let expected = criteria.components.iter().any(|c| c.component == figures.component.name);
                defect_lines(&mut lines, findings, rule, figures, expected);
            }
        }
    }
    if !criteria.defects.is_empty() && findings.not_looked.is_none() {
        let worst = |f: &&ComponentFigures| f.unjudged > criteria.largest_unjudged_share * f.area.value;
        for figures in findings.components.iter().filter(worst) {
            lines.push(unjudged_line(figures, criteria.largest_unjudged_share));
        }
    }
    if let Some(rule) = &criteria.reference {
        lines.push(reference_line(findings, rule, compared));
    }
    for finding in &findings.list {
        lines.extend(unlisted_line(finding, &criteria.defects, criteria.unlisted));
    }
    lines
}

/// Why nobody looked for the defect of a rule; `None` where somebody did.
fn not_looked(findings: &FindingsRecord, rule: &DefectRule) -> Option<String> {
    match &findings.not_looked {
        Some(why) => Some(why.clone()),
        None if findings.looked_for.iter().any(|class| class.name == rule.defect) => None,
        None => Some("the labels know no such class".into()),
    }
}

/// Whether the inspection is one that can be judged.
fn inspection_line(record: &InspectionRecord) -> VerdictLine {
    let reason = match (&record.outcome, &record.run) {
        (Outcome::Running, _) => "the inspection has not ended".to_owned(),
        (Outcome::Stopped, _) => "the inspection was stopped: its views are not all there".to_owned(),
        (Outcome::Failed { reason }, _) => format!("the inspection failed: {reason}"),
        (Outcome::Finished, Some(run)) if !run.sufficient => {
            format!("{} of {} views were used, which is less than was asked for", run.used, run.views)
        }
        (Outcome::Finished, None) => "the record does not say how many views were used".to_owned(),
        (Outcome::Finished, Some(run)) => {
            let reason = format!("the inspection finished with {} of {} views", run.used, run.views);
            return VerdictLine {
                conformity: Conformity::Holds,
                decision: Decision::Accept,
                ..undecided(JudgedFigure::Inspection, &reason)
            };
        }
    };
    undecided(JudgedFigure::Inspection, &reason)
}

/// A component of too much of which nobody knows whether there is a defect.
fn unjudged_line(figures: &ComponentFigures, limit: f64) -> VerdictLine {
    let value = Quantity::without_uncertainty(figures.unjudged / figures.area.value);
    let reason = format!(
        "{}: of {} of its surface nobody knows whether there is a defect, at most {} is asked for",
        figures.component.name,
        percent(Some(value)),
        shown_share(limit)
    );
    VerdictLine {
        component: Some(figures.component.clone()),
        value: Some(value),
        limit: Some(limit),
        ..undecided(JudgedFigure::Unjudged, &reason)
    }
}

/// The surface against the reference.
fn reference_line(findings: &FindingsRecord, rule: &ReferenceRule, compared: bool) -> VerdictLine {
    let limit = rule.tolerance_mm * MM;
    if !compared {
        return VerdictLine {
            limit: Some(limit),
            ..undecided(
                JudgedFigure::Deviation,
                "the surface could not be compared with the reference: there is no mesh",
            )
        };
    }
    let beyond = |f: &Finding| match f.kind {
        FindingKind::Deviation { greatest, .. } => {
            Some((f.id, Some(Quantity { value: greatest.value.abs(), ..greatest })))
        }
        _ => None,
    };
    let values: Vec<_> = findings.list.iter().filter_map(beyond).collect();
    let compared = Compared::at_most(&values, limit);
    let reason = match compared.value {
        Some(_) => format!(
            "largest distance from the reference {}, at most {}",
            shown(compared.value, (MM, "mm")),
            rule.tolerance_mm
        ),
        None => format!("no region is farther than {} mm from the reference", rule.tolerance_mm),
    };
    compared.line(undecided(JudgedFigure::Deviation, ""), rule.then, limit, &reason)
}

/// A finding that no rule covers.
fn unlisted_line(finding: &Finding, rules: &[DefectRule], then: Decision) -> Option<VerdictLine> {
    let (defect, reason) = match &finding.kind {
        FindingKind::Completeness { .. } | FindingKind::Deviation { .. } => return None,
        kind => match kind.defect() {
            Some(defect) => (Some(defect.clone()), format!("{} on {}", defect.name, finding.component.name)),
            None => (None, format!("a remark of a person on {}", finding.component.name)),
        },
    };
    let covers = |rule: &DefectRule| {
        defect.as_ref().is_some_and(|d| d.name == rule.defect)
            && rule.component.as_ref().is_none_or(|name| *name == finding.component.name)
            // Rules judge components, and what is on none of them is on none.
            && finding.component.class != 0
    };
    if rules.iter().any(covers) {
        return None;
    }
    Some(VerdictLine {
        component: Some(finding.component.clone()),
        defect,
        findings: vec![finding.id],
        value: finding.area(),
        decision: then,
        ..undecided(JudgedFigure::Coverage, &format!("{reason}: no rule covers it"))
    })
}

#[cfg(test)]
pub(crate) mod tests;
