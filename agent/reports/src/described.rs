//! Findings, lines of verdicts, registrations and outcomes in words and in their units.

use crate::figure::{Unit, alone, in_unit, with_uncertainty};
use semascan_model::finding::{Finding, FindingKind};
use semascan_model::measurement::{Dimension, FeatureKind, MeasurementRecord};
use semascan_model::record::{LabelSource, Outcome, RegistrationRecord};
use semascan_model::review::ReviewAction;
use semascan_model::verdict::{Conformity, Decision, JudgedFigure, VerdictLine};

/// What a finding is, without its component: `corrosion`, `not seen`.
pub(crate) fn kind(kind: &FindingKind) -> String {
    match kind {
        FindingKind::Defect { defect } => defect.name.clone(),
        FindingKind::Completeness { missing: true, .. } => "not seen".into(),
        FindingKind::Completeness { .. } => "not wholly seen".into(),
        FindingKind::Deviation { .. } => "off the reference".into(),
        FindingKind::Drawn { defect: Some(defect), .. } => format!("{} (drawn by a person)", defect.name),
        FindingKind::Drawn { defect: None, .. } => "remark of a person".into(),
    }
}

/// `corrosion on housing`.
pub(crate) fn finding(finding: &Finding) -> String {
    format!("{} on {}", kind(&finding.kind), finding.component.name)
}

/// What a decision is called.
pub(crate) fn decision(decision: Decision) -> &'static str {
    match decision {
        Decision::Accept => "accept",
        Decision::Rework => "rework",
        Decision::Person => "a person decides",
        Decision::Reject => "reject",
    }
}

/// What a person did, where that is no decision.
pub(crate) fn action(action: &ReviewAction) -> String {
    let on = |component: &Option<String>| component.as_ref().map(|name| format!(" on {name}")).unwrap_or_default();
    match action {
        ReviewAction::Accept => "accept".into(),
        ReviewAction::Reject => "reject".into(),
        ReviewAction::Rework => "rework".into(),
        ReviewAction::Comment => "remark".into(),
        ReviewAction::Reclassify { defect: None, .. } => "found in error".into(),
        ReviewAction::Reclassify { component, defect: Some(defect) } => format!("is {defect}{}", on(component)),
        ReviewAction::Relabel { component, defect, .. } => {
            let labels: Vec<&str> = [component, defect].into_iter().flatten().map(String::as_str).collect();
            format!("a patch of surface is {}", labels.join(", "))
        }
        ReviewAction::NewFinding { component, defect, .. } => {
            format!("drew {} on {component}", defect.as_deref().unwrap_or("a remark"))
        }
        ReviewAction::Measure { measurement } => match measured_figure(measurement) {
            Some(figure) => format!("measured: {}, {figure}", measurement.kind.label().to_lowercase()),
            None => format!("measured: {}", measurement.kind.label().to_lowercase()),
        },
        ReviewAction::Withdraw { .. } => "withdrew a measurement".into(),
    }
}

/// The figure of a measurement with its uncertainty and unit; `None` where it has none.
pub(crate) fn measured_figure(measurement: &MeasurementRecord) -> Option<String> {
    let figure = measurement.figure?;
    let radius = if measurement.kind.is_radius() { "R " } else { "" };
    Some(match measurement.kind.dimension() {
        Dimension::Length => format!("{radius}{} mm", with_uncertainty(figure, Unit::Millimetre)),
        Dimension::Area => format!("{} mm²", with_uncertainty(figure, Unit::SquareMillimetre)),
        // A degree sign stands behind a number or a bracket without a space.
        Dimension::Angle => format!("({})°", in_unit(figure, 1_f64.to_degrees())),
    })
}

/// What a measurement was taken from: `cylinder of 812 points (residual 0.05 mm)`, `2 points`.
pub(crate) fn measured_on(measurement: &MeasurementRecord) -> String {
    let points = measurement.features.iter().filter(|feature| feature.kind == FeatureKind::Point).count();
    let elements = measurement.features.iter().filter_map(|feature| {
        let fit = feature.fit?;
        let residual = alone(fit.rms, Unit::Millimetre);
        Some(format!("{} of {} points (residual {residual} mm)", feature.kind.name(), fit.used))
    });
    let points = match points {
        0 => None,
        1 => Some("1 point".to_owned()),
        count => Some(format!("{count} points")),
    };
    points.into_iter().chain(elements).collect::<Vec<_>>().join(", ")
}

/// How a figure stands to its limit.
pub(crate) fn conformity(conformity: Conformity) -> &'static str {
    match conformity {
        Conformity::Holds => "kept",
        Conformity::Broken => "not kept",
        Conformity::Undecided => "undecided",
    }
}

/// What was compared with a limit, and its unit.
pub(crate) fn judged(figure: JudgedFigure) -> (&'static str, Unit) {
    match figure {
        JudgedFigure::Area => ("area", Unit::SquareMillimetre),
        JudgedFigure::Share => ("share of the surface", Unit::Percent),
        JudgedFigure::Length => ("length", Unit::Millimetre),
        JudgedFigure::Depth => ("depth", Unit::Millimetre),
        JudgedFigure::Count => ("number", Unit::One),
        JudgedFigure::Completeness => ("completeness", Unit::Percent),
        JudgedFigure::Confidence => ("confidence", Unit::One),
        JudgedFigure::Deviation => ("deviation", Unit::Millimetre),
        JudgedFigure::Unjudged => ("surface that nobody judged", Unit::Percent),
        JudgedFigure::Inspection => ("the inspection", Unit::One),
        JudgedFigure::Coverage => ("area without a limit", Unit::SquareMillimetre),
    }
}

/// Value and limit of a line with their unit; `None` where there is none.
pub(crate) fn value_and_limit(line: &VerdictLine) -> (Option<String>, Option<String>) {
    let (_, unit) = judged(line.figure);
    let with_unit = |text: String| if unit.symbol().is_empty() { text } else { format!("{text} {}", unit.symbol()) };
    let value = line.value.map(|value| with_unit(with_uncertainty(value, unit)));
    let limit = line.limit.map(|limit| {
        let shown = limit * unit.factor();
        // Limits are as people wrote them.
        let text = if (shown - shown.round()).abs() < 1e-9 { format!("{shown:.0}") } else { alone(limit, unit) };
        with_unit(text)
    });
    (value, limit)
}

/// How the pose of a view was found.
pub(crate) fn registration(registration: Option<&RegistrationRecord>) -> String {
    match registration {
        None => "not known".into(),
        Some(RegistrationRecord::Kinematic) => "robot and table readings".into(),
        Some(RegistrationRecord::Icp { .. }) => "aligned with the model".into(),
        Some(RegistrationRecord::KeptPrior { reason }) => format!("prior kept: {reason}"),
        Some(RegistrationRecord::CameraIsFrame) => "first view: its camera is the frame".into(),
        Some(RegistrationRecord::Relocalized { .. }) => "found in the model".into(),
    }
}

/// Where the labels came from.
pub(crate) fn labels(labels: LabelSource) -> &'static str {
    match labels {
        LabelSource::Source => "recorded with the views, or simulated",
        LabelSource::Network => "trained networks",
        LabelSource::None => "none were used",
    }
}

/// How an inspection ended.
pub(crate) fn outcome(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Running => "running, or cut off: there is no result".into(),
        Outcome::Finished => "finished".into(),
        Outcome::Stopped => "stopped early: the model is that of the views until then".into(),
        Outcome::Failed { reason } => format!("failed: {reason}"),
    }
}

/// Enumerations as they stand in the record, for tables that machines read.
pub(crate) fn outcome_name(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Running => "running",
        Outcome::Finished => "finished",
        Outcome::Stopped => "stopped",
        Outcome::Failed { .. } => "failed",
    }
}
