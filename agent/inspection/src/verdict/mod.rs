//! From findings and criteria to a verdict, line by line with its reason.
//!
//! A figure keeps its limit where its whole interval does, and breaks it where no part of the interval keeps it
//! ([ISO 14253-1]). Where the limit lies within the interval, where the figure or its uncertainty is not known, where nobody
//! looked or nothing was seen, a person decides: what is not known is never accepted.

use crate::criteria::CheckedCriteria;
use crate::findings::{LEAST_VOXELS, completeness, expected_findings};
use jiff::Timestamp;
use semascan_model::criteria::{ComponentRule, DefectRule, ReferenceRule};
use semascan_model::finding::{
    ComponentFigures, Finding, FindingId, FindingKind, FindingsRecord, NamedClass, Quantity,
};
use semascan_model::record::{InspectionRecord, LabelSource, Outcome, SoftwareRecord};
use semascan_model::verdict::{Conformity, Decision, JudgedFigure, Verdict, VerdictLine};
use semascan_model::{SemanticMesh, Taxonomy};

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

/// Completeness and confidence of a component.
fn component_lines(
    lines: &mut Vec<VerdictLine>,
    record: &InspectionRecord,
    findings: &FindingsRecord,
    rule: &ComponentRule,
) {
    let name = &rule.component;
    let figures = findings.components.iter().find(|c| c.component.name == *name);
    if record.labels == LabelSource::None || figures.is_none() {
        let reason = format!("{name}: nobody looked for components");
        lines.push(undecided(JudgedFigure::Completeness, &reason));
        return;
    }
    let Some(figures) = figures else { return };
    let own = |f: &&Finding| {
        matches!(f.kind, FindingKind::Completeness { .. }) && f.component.class == figures.component.class
    };
    let ids: Vec<FindingId> = findings.list.iter().filter(own).map(|f| f.id).collect();
    let line = |figure| VerdictLine { component: Some(figures.component.clone()), ..undecided(figure, "") };
    if figures.area.value <= 0.0 {
        lines.push(VerdictLine {
            findings: ids,
            conformity: Conformity::Broken,
            decision: rule.then,
            reason: format!("nothing of {name} was seen"),
            ..line(JudgedFigure::Completeness)
        });
        return;
    }
    if let Some(least) = rule.least_completeness {
        let value = completeness(rule, figures);
        let conformity = value.map_or(Conformity::Undecided, |v| at_least(v, least));
        lines.push(VerdictLine {
            findings: ids,
            value,
            limit: Some(least),
            conformity,
            decision: follows(conformity, rule.then),
            reason: format!(
                "{name}: {} of its surface was seen, at least {} is asked for",
                percent(value),
                shown_share(least)
            ),
            ..line(JudgedFigure::Completeness)
        });
    }
    if let Some(least) = rule.least_confidence {
        // A label's standard uncertainty is that of its probability.
        let value = figures.confidence.zip(figures.sigma).map(|(c, s)| Quantity::with_standard(c.mean, s.mean));
        let conformity = value.map_or(Conformity::Undecided, |v| at_least(v, least));
        lines.push(VerdictLine {
            value,
            limit: Some(least),
            conformity,
            decision: follows(conformity, rule.then),
            reason: format!("{name}: confidence {}, at least {} is asked for", percent(value), shown_share(least)),
            ..line(JudgedFigure::Confidence)
        });
    }
}

/// What a rule says of the findings of its defect on one component. `expected` says whether another rule judges whether the
/// component was seen.
fn defect_lines(
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
    let region = |f: &Finding, of: fn(&semascan_model::finding::RegionFigures) -> Option<Quantity>| {
        f.region.as_ref().and_then(of)
    };
    if let Some(limit) = rule.largest_area_mm2.map(|a| a * MM2) {
        let values: Vec<_> = own.iter().map(|f| (f.id, region(f, |r| Some(r.area)))).collect();
        let mut compared = Compared::at_most(&values, limit);
        compared.doubt(small.is_some() && limit < record.least_area);
        let reason = format!("{on}: largest area {} mm2, at most {}", shown(compared.value, MM2), plain(limit / MM2));
        lines.push(compared.line(line(JudgedFigure::Area), rule.then, limit, &reason));
    }
    if let Some(limit) = rule.largest_length_mm.map(|l| l * MM) {
        let values: Vec<_> = own.iter().map(|f| (f.id, region(f, |r| Some(r.length)))).collect();
        let mut compared = Compared::at_most(&values, limit);
        // Small regions may be thin and long, but not longer than all their voxels in a row.
        let longest = small.map_or(0.0, |_| (LEAST_VOXELS * record.least_area).sqrt());
        compared.doubt(limit < longest);
        let reason = format!("{on}: largest length {} mm, at most {}", shown(compared.value, MM), plain(limit / MM));
        lines.push(compared.line(line(JudgedFigure::Length), rule.then, limit, &reason));
    }
    if let Some(limit) = rule.largest_depth_mm.map(|l| l * MM) {
        let values: Vec<_> = own.iter().map(|f| (f.id, region(f, |r| r.depth.reference.or(r.depth.fitted)))).collect();
        let compared = Compared::at_most(&values, limit);
        let reason = format!("{on}: largest depth {} mm, at most {}", shown(compared.value, MM), plain(limit / MM));
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
            reason: format!("{on}: {between} findings of {} mm2 or more, at most {limit}", plain(from / MM2)),
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
            "largest distance from the reference {} mm, at most {}",
            shown(compared.value, MM),
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

/// Several figures against one limit.
struct Compared {
    conformity: Conformity,
    /// The figure that is nearest to breaking the limit, or farthest beyond; `None` without any, and where one is not known.
    value: Option<Quantity>,
    /// The findings whose figures do not hold; all of them where all hold.
    findings: Vec<FindingId>,
}

impl Compared {
    fn at_most(values: &[(FindingId, Option<Quantity>)], limit: f64) -> Self {
        Self::new(values, |v| at_most(v, limit), |a, b| a.value.total_cmp(&b.value))
    }

    fn at_least(values: &[(FindingId, Option<Quantity>)], limit: f64) -> Self {
        Self::new(values, |v| at_least(v, limit), |a, b| b.value.total_cmp(&a.value))
    }

    fn new(
        values: &[(FindingId, Option<Quantity>)],
        compare: impl Fn(Quantity) -> Conformity,
        order: impl Fn(&Quantity, &Quantity) -> std::cmp::Ordering,
    ) -> Self {
        let judged: Vec<(FindingId, Option<Quantity>, Conformity)> =
            values.iter().map(|(id, v)| (*id, *v, v.map_or(Conformity::Undecided, &compare))).collect();
        let any = |wanted: Conformity| judged.iter().any(|(.., c)| *c == wanted);
        let conformity = [Conformity::Broken, Conformity::Undecided]
            .into_iter()
            .find(|wanted| any(*wanted))
            .unwrap_or(Conformity::Holds);
        let of = || judged.iter().filter(|(.., c)| *c == conformity);
        // Where a figure is not known it is what the line is about, and not another finding's.
        let unknown = conformity == Conformity::Undecided && of().any(|(_, v, _)| v.is_none());
        let value = if unknown { None } else { of().filter_map(|(_, v, _)| *v).max_by(order) };
        Self { conformity, value, findings: of().map(|(id, ..)| *id).collect() }
    }

    /// What holds may not hold: there may be more than was measured.
    fn doubt(&mut self, doubtful: bool) {
        if doubtful && self.conformity == Conformity::Holds {
            self.conformity = Conformity::Undecided;
        }
    }

    fn line(self, line: VerdictLine, then: Decision, limit: f64, reason: &str) -> VerdictLine {
        let Self { conformity, value, findings } = self;
        let decision = follows(conformity, then);
        VerdictLine { findings, value, limit: Some(limit), conformity, decision, reason: reason.into(), ..line }
    }
}

fn at_most(value: Quantity, limit: f64) -> Conformity {
    match value.interval() {
        Some((_, high)) if high <= limit => Conformity::Holds,
        Some((low, _)) if low > limit => Conformity::Broken,
        _ => Conformity::Undecided,
    }
}

fn at_least(value: Quantity, limit: f64) -> Conformity {
    match value.interval() {
        Some((low, _)) if low >= limit => Conformity::Holds,
        Some((_, high)) if high < limit => Conformity::Broken,
        _ => Conformity::Undecided,
    }
}

fn follows(conformity: Conformity, then: Decision) -> Decision {
    match conformity {
        Conformity::Holds => Decision::Accept,
        Conformity::Broken => then,
        Conformity::Undecided => Decision::Person,
    }
}

/// A line that a person decides.
pub(crate) fn undecided(figure: JudgedFigure, reason: &str) -> VerdictLine {
    VerdictLine {
        figure,
        component: None::<NamedClass>,
        defect: None,
        findings: Vec::new(),
        value: None,
        limit: None,
        conformity: Conformity::Undecided,
        decision: Decision::Person,
        reason: reason.into(),
    }
}

/// A figure and its uncertainty in another unit.
fn shown(value: Option<Quantity>, unit: f64) -> String {
    match value {
        None => "not known or none".into(),
        Some(Quantity { value, expanded: Some(u) }) => format!("{:.2} +- {:.2}", value / unit, u / unit),
        Some(Quantity { value, expanded: None }) => format!("{:.2} (uncertainty not known)", value / unit),
    }
}

fn percent(value: Option<Quantity>) -> String {
    format!("{} %", shown(value, 0.01))
}

fn shown_share(share: f64) -> String {
    format!("{} %", plain(share * 100.0))
}

/// A number as people write it.
fn plain(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
pub(crate) mod tests;
