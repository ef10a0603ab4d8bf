//! Components that are expected and were not seen, or of which too little was seen. Without an expectation nothing follows
//! from what was not seen: nobody knows what there should be.

use semascan_model::criteria::ComponentRule;
use semascan_model::finding::{ComponentFigures, Finding, FindingId, FindingKind, Quantity};

/// Square metres in a square millimetre.
const MM2: f64 = 1e-6;

/// Seen area of a component as a share of the expected one; `None` where none is expected.
pub(crate) fn completeness(rule: &ComponentRule, figures: &ComponentFigures) -> Option<Quantity> {
    let expected = rule.expected_area_mm2? * MM2;
    let Quantity { value, expanded } = figures.area;
    Some(Quantity { value: value / expected, expanded: expanded.map(|u| u / expected) })
}

/// A finding for each of `rules` that `components` do not fulfil, or may not: the limit lies within the interval. Names are
/// given later.
pub(crate) fn incomplete_components(rules: &[ComponentRule], components: &[ComponentFigures]) -> Vec<Finding> {
    let finding = |rule: &ComponentRule| {
        let figures = components.iter().find(|c| c.component.name == rule.component)?;
        let share = completeness(rule, figures);
        let least = rule.least_completeness.unwrap_or(0.0);
        let missing = figures.area.value <= 0.0;
        let holds = share.is_none_or(|s| s.interval().is_some_and(|(low, _)| low >= least));
        (missing || !holds).then(|| Finding {
            id: FindingId::from_bytes([0; 16]),
            kind: FindingKind::Completeness { share, least, missing },
            component: figures.component.clone(),
            instances: figures.instances.clone(),
            region: None,
        })
    };
    rules.iter().filter_map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::finding::NamedClass;
    use semascan_model::verdict::Decision;

    fn seen(name: &str, mm2: f64) -> ComponentFigures {
        ComponentFigures {
            component: NamedClass { class: 1, name: name.into() },
            instances: Vec::new(),
            area: Quantity::with_standard(mm2 * MM2, 0.01 * mm2 * MM2),
            unjudged: 0.0,
            confidence: None,
            sigma: None,
        }
    }

    fn rule(name: &str, expected: Option<f64>, least: Option<f64>) -> ComponentRule {
        ComponentRule {
            component: name.into(),
            expected_area_mm2: expected,
            least_completeness: least,
            least_confidence: None,
            then: Decision::Person,
        }
    }

    #[test]
    fn what_is_expected_and_was_not_seen_is_a_finding() {
        let components = [seen("gear", 0.0), seen("housing", 790.0), seen("solenoid", 950.0), seen("cap", 0.0)];
        let rules = [
            rule("gear", None, None),
            rule("housing", Some(1000.0), Some(0.8)),
            rule("solenoid", Some(1000.0), Some(0.8)),
        ];
        let found = incomplete_components(&rules, &components);
        let names: Vec<&str> = found.iter().map(|f| f.component.name.as_str()).collect();
        assert_eq!(names, ["gear", "housing"], "nobody expects a cap");
        assert!(matches!(found[0].kind, FindingKind::Completeness { share: None, missing: true, .. }));
        let FindingKind::Completeness { share: Some(share), missing: false, .. } = found[1].kind else {
            panic!("{:?}", found[1])
        };
        assert!((share.value - 0.79).abs() < 1e-12 && (share.expanded.expect("known") - 0.0158).abs() < 1e-9);
        // What lies within the interval may be incomplete.
        let nearly = incomplete_components(&[rule("housing", Some(1000.0), Some(0.78))], &components);
        assert_eq!(nearly.len(), 1);
    }
}
