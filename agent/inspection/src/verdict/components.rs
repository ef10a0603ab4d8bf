//! Rules for components: how much of each was seen, and how sure its labels are.

use super::comparison::{at_least, follows, undecided};
use super::wording::{percent, shown_share};
use crate::findings::completeness;
use semascan_model::criteria::ComponentRule;
use semascan_model::finding::{Finding, FindingId, FindingKind, FindingsRecord, Quantity};
use semascan_model::record::{InspectionRecord, LabelSource};
use semascan_model::verdict::{Conformity, JudgedFigure, VerdictLine};

/// Completeness and confidence of a component.
pub(super) fn component_lines(
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
