//! Findings and verdicts for people.

use semascan_model::finding::{Finding, FindingKind, FindingsRecord, Quantity};
use semascan_model::verdict::{Conformity, Decision, Verdict};
use std::io::{self, Write};

/// Findings that are listed; of the rest the number is said.
const LISTED: usize = 20;

/// Prints what was found, the largest first.
pub(super) fn print_findings(out: &mut impl Write, record: &FindingsRecord) -> io::Result<()> {
    if let Some(why) = &record.not_looked {
        return writeln!(out, "findings: not known: {why}");
    }
    let mut list: Vec<&Finding> = record.list.iter().collect();
    let area = |f: &Finding| f.area().map_or(f64::INFINITY, |a| a.value);
    list.sort_by(|a, b| area(b).total_cmp(&area(a)));
    writeln!(out, "{:<42} {:>18} {:>16} {:>14} {:>6}", "finding", "area mm2", "length mm", "width mm", "views")?;
    for finding in list.iter().take(LISTED) {
        let what = match &finding.kind {
            FindingKind::Completeness { missing: true, .. } => "not seen".to_owned(),
            FindingKind::Completeness { .. } => "not wholly seen".to_owned(),
            FindingKind::Deviation { .. } => "off the reference".to_owned(),
            kind => kind.defect().map_or_else(|| kind.name().to_owned(), |d| d.name.clone()),
        };
        let name = format!("{} on {}", what, finding.component.name);
        match &finding.region {
            Some(r) => writeln!(
                out,
                "{name:<42} {:>18} {:>16} {:>14} {:>6}",
                shown(r.area, 1e-6, 1),
                shown(r.length, 1e-3, 1),
                shown(r.width, 1e-3, 1),
                r.views.len()
            )?,
            None => writeln!(out, "{name:<42} {:>18}", "-")?,
        }
    }
    if list.len() > LISTED {
        writeln!(out, "  and {} more in inspection.json", list.len() - LISTED)?;
    }
    let (regions, small) = record.left_out.iter().fold((0, 0.0), |(n, a), l| (n + l.regions, a + l.area));
    if regions > 0 {
        let least = record.least_area * 1e6;
        writeln!(out, "  {regions} regions below {least:.1} mm2 are no findings; {:.1} mm2 together", small * 1e6)?;
    }
    Ok(())
}

/// Prints a verdict: every line that does not simply hold, and how many do.
pub(super) fn print_verdict(out: &mut impl Write, verdict: &Verdict) -> io::Result<()> {
    let criteria = &verdict.criteria;
    writeln!(out, "verdict by {:?}, revision {}: {}", criteria.name, criteria.revision, verdict.decision().name())?;
    let mut holding = 0;
    for line in &verdict.lines {
        if line.decision == Decision::Accept && line.conformity == Conformity::Holds {
            holding += 1;
            continue;
        }
        writeln!(out, "  {:<7} {}", line.decision.name(), line.reason)?;
    }
    writeln!(out, "  {holding} of {} lines hold", verdict.lines.len())?;
    for decision in &verdict.overrides {
        writeln!(out, "  {} by {} at {}: {}", decision.decision.name(), decision.person, decision.at, decision.reason)?;
    }
    Ok(())
}

fn shown(quantity: Quantity, unit: f64, digits: usize) -> String {
    match quantity.expanded {
        Some(u) => format!("{:.digits$} +- {:.digits$}", quantity.value / unit, u / unit),
        None => format!("{:.digits$}", quantity.value / unit),
    }
}
