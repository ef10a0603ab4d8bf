//! Findings and decisions in words and figures.

use crate::words::{decimal, t};
use semascan_model::finding::{Finding, FindingKind, Quantity};
use semascan_model::verdict::Decision;

/// `corrosion on housing`.
pub fn finding(finding: &Finding) -> String {
    let kind = match &finding.kind {
        FindingKind::Defect { defect } => defect.name.as_str(),
        FindingKind::Completeness { missing: true, .. } => t!("review.not_seen"),
        FindingKind::Completeness { .. } => t!("review.not_wholly_seen"),
        FindingKind::Deviation { .. } => t!("review.off_reference"),
        FindingKind::Drawn { defect: Some(defect), .. } => defect.name.as_str(),
        FindingKind::Drawn { defect: None, .. } => t!("review.remark.within"),
    };
    t!("review.finding", kind, component = finding.component.name)
}

/// The area of a finding, where it has one.
pub fn area(finding: &Finding) -> Option<String> {
    finding.area().map(|area| format!("{} mm²", figure(area, 1e6)))
}

/// Name, figure and unit of what was measured of a finding.
pub fn figures(finding: &Finding) -> Vec<(&'static str, String)> {
    let Some(region) = &finding.region else { return Vec::new() };
    let depth = region.depth.reference.or(region.depth.fitted);
    let mut list = vec![
        (t!("common.area"), format!("{} mm²", figure(region.area, 1e6))),
        (t!("common.length"), format!("{} mm", figure(region.length, 1e3))),
        (t!("correct.width"), format!("{} mm", figure(region.width, 1e3))),
    ];
    list.push(match (depth, &region.depth.unknown) {
        (Some(depth), _) => (t!("review.depth"), format!("{} mm", figure(depth, 1e3))),
        (None, Some(why)) => (t!("review.depth"), t!("review.depth_unknown", why)),
        (None, None) => (t!("review.depth"), t!("common.not_known").into()),
    });
    list.push((t!("common.confidence"), decimal(region.confidence.mean, 2)));
    list
}

/// `12.3 ± 0.4`: the expanded uncertainty (k = 2) with two digits, the value to the same place (GUM, 7.2.6). What is uncertain by
/// an unknown amount stands alone.
pub fn figure(quantity: Quantity, factor: f64) -> String {
    let (value, expanded) = (quantity.value * factor, quantity.expanded.map(|expanded| expanded * factor));
    let worth = expanded.filter(|u| u.is_finite() && *u > 0.0).unwrap_or(value.abs() / 10.0);
    let magnitude = if worth > 0.0 { worth.log10().floor() } else { 0.0 };
    let decimals = (1.0 - magnitude).clamp(0.0, 4.0) as usize;
    match expanded {
        Some(expanded) if expanded > 0.0 => format!("{} ± {}", decimal(value, decimals), decimal(expanded, decimals)),
        _ => decimal(value, decimals),
    }
}

/// What a decision is called.
pub fn decision(decision: Decision) -> &'static str {
    match decision {
        Decision::Accept => t!("decision.accept"),
        Decision::Rework => t!("decision.rework"),
        Decision::Person => t!("decision.person"),
        Decision::Reject => t!("decision.reject"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_the_digits_that_their_uncertainty_is_worth() {
        let of = |value, expanded| figure(Quantity { value, expanded }, 1e3);
        assert_eq!(of(0.028_123, Some(0.001_04)), "28.1 ± 1.0");
        assert_eq!(of(0.5616, Some(0.0596)), "562 ± 60");
        assert_eq!((of(0.002, None), of(0.0, None), of(3e-3, Some(0.0))), ("2.00".into(), "0.0".into(), "3.00".into()));
        assert_eq!(of(1.0, Some(f64::NAN)), "1000");
    }
}
