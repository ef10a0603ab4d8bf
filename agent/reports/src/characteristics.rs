//! What an inspection measured as characteristics of quality systems: a name, a unit, a value, and the limit of the criteria.
//!
//! Those of the part are the same for every inspection of its kind, whatever was found: of each component the area that was
//! seen, of each defect that was looked for on a component that was seen the number of findings, their area together, and the
//! largest area, length and depth. So they can be followed over many parts. Those of findings, and of what people measured and keep, are
//! of this part alone.
//!
//! A figure that is not known makes no characteristic. Where nothing was seen of a component, nothing is known of its defects.

use crate::described::kind;
use crate::findings;
use jiff::Timestamp;
use semascan_model::finding::{Finding, FindingId, FindingKind, NamedClass, Quantity};
use semascan_model::measurement::{Dimension, KeptMeasurement};
use semascan_model::record::InspectionRecord;
use semascan_model::review::ReviewId;
use semascan_model::verdict::{Conformity, Decision, JudgedFigure, VerdictLine};

/// A unit that quality systems know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Measure {
    Area,
    Length,
    Depth,
    Radius,
    Angle,
    Count,
    Percent,
}

impl Measure {
    /// What a figure in SI units is multiplied by.
    pub(crate) fn factor(self) -> f64 {
        match self {
            Self::Area => 1e6,
            Self::Length | Self::Depth | Self::Radius => 1e3,
            Self::Angle => 1.0 / 1_f64.to_radians(),
            Self::Count => 1.0,
            Self::Percent => 1e2,
        }
    }

    /// In ASCII.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Area => "mm2",
            Self::Length | Self::Depth | Self::Radius => "mm",
            Self::Angle => "deg",
            Self::Count => "1",
            Self::Percent => "%",
        }
    }
}

/// Which side of a limit is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Limit {
    /// At most, in SI units.
    Most(f64),
    /// At least, in SI units.
    Least(f64),
}

/// One characteristic.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Characteristic {
    /// `corrosion on housing: area in all`.
    pub(crate) name: String,
    pub(crate) measure: Measure,
    /// In SI units.
    pub(crate) value: Quantity,
    /// The limit of the criteria; of several the strictest.
    pub(crate) limit: Option<Limit>,
    /// How the value stands to it, and what follows; absent without a limit.
    pub(crate) judged: Option<(Conformity, Decision)>,
    /// The finding, where it is of one.
    pub(crate) finding: Option<FindingId>,
    pub(crate) component: Option<String>,
    pub(crate) defect: Option<String>,
    /// How it was measured, where a person did.
    pub(crate) taken: Option<Taken>,
}

/// How a person measured.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Taken {
    /// The review that the measurement came with, which names it.
    pub(crate) review: ReviewId,
    pub(crate) person: String,
    pub(crate) at: Timestamp,
    /// Whether the inspection has another model by now.
    pub(crate) is_of_earlier_model: bool,
}

/// Those of the part, in the order of components and defects.
pub(crate) fn of_part(record: &InspectionRecord) -> Vec<Characteristic> {
    let Some(found) = &record.findings else { return Vec::new() };
    let mut list = Vec::new();
    for figures in &found.components {
        let component = &figures.component;
        list.push(Characteristic {
            name: format!("{}: seen area", component.name),
            component: Some(component.name.clone()),
            ..plain(Measure::Area, figures.area)
        });
        if let Some(line) = line_of(record, JudgedFigure::Completeness, component, None, None)
            && let Some(value) = line.value
        {
            list.push(Characteristic {
                name: format!("{}: completeness", component.name),
                component: Some(component.name.clone()),
                limit: line.limit.map(Limit::Least),
                judged: line.limit.map(|_| (line.conformity, line.decision)),
                ..plain(Measure::Percent, value)
            });
        }
        if found.not_looked.is_some() || figures.area.value <= 0.0 {
            continue;
        }
        for defect in &found.looked_for {
            list.extend(of_defect(record, component, defect));
        }
    }
    list
}

fn of_defect(record: &InspectionRecord, component: &NamedClass, defect: &NamedClass) -> Vec<Characteristic> {
    let regions: Vec<_> = findings(record)
        .iter()
        .filter(|f| matches!(&f.kind, FindingKind::Defect { defect: own } if own.class == defect.class))
        .filter(|f| f.component.class == component.class)
        .filter_map(|f| f.region.as_ref())
        .collect();
    let largest = |values: Vec<Quantity>| {
        values.into_iter().max_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or(Quantity::without_uncertainty(0.0))
    };
    // Whether a limit is asked for by count, area ... is in the verdict's lines of this component and defect.
    let limited = |figure: JudgedFigure| strictest(record, figure, component, defect);
    let of = |what: &str, measure, value: Quantity, figure: Option<JudgedFigure>| {
        let line = figure.and_then(limited);
        Characteristic {
            name: format!("{} on {}: {what}", defect.name, component.name),
            component: Some(component.name.clone()),
            defect: Some(defect.name.clone()),
            limit: line.and_then(|line| line.limit).map(Limit::Most),
            judged: line.map(|line| (line.conformity, line.decision)),
            ..plain(measure, value)
        }
    };
    let count = Quantity { value: regions.len() as f64, expanded: Some(0.0) };
    // The errors of regions beside each other are alike: their uncertainties add up.
    let expanded = regions.iter().try_fold(0.0, |sum, region| Some(sum + region.area.expanded?));
    let area = Quantity { value: regions.iter().map(|region| region.area.value).sum(), expanded };
    let mut list = vec![
        of("number of findings", Measure::Count, count, Some(JudgedFigure::Count)),
        of("area in all", Measure::Area, area, None),
        of("largest area", Measure::Area, largest(regions.iter().map(|r| r.area).collect()), Some(JudgedFigure::Area)),
        of(
            "largest length",
            Measure::Length,
            largest(regions.iter().map(|r| r.length).collect()),
            Some(JudgedFigure::Length),
        ),
    ];
    let depths: Vec<Option<Quantity>> = regions.iter().map(|r| r.depth.reference.or(r.depth.fitted)).collect();
    // The largest depth is known where every depth is.
    if let Some(depths) = depths.into_iter().collect::<Option<Vec<Quantity>>>() {
        list.push(of("largest depth", Measure::Depth, largest(depths), Some(JudgedFigure::Depth)));
    }
    if let Some(line) = limited(JudgedFigure::Share)
        && let Some(value) = line.value
    {
        list.push(of("share of the surface", Measure::Percent, value, Some(JudgedFigure::Share)));
    }
    list
}

/// Those of every finding that has a place, in the order of the findings.
pub(crate) fn of_findings(record: &InspectionRecord) -> Vec<Characteristic> {
    let mut list = Vec::new();
    for (i, finding) in findings(record).iter().enumerate() {
        let Some(region) = &finding.region else { continue };
        let depth = region.depth.reference.or(region.depth.fitted);
        let deviation = match &finding.kind {
            FindingKind::Deviation { greatest, .. } => Some(*greatest),
            _ => None,
        };
        let figures = [
            ("area", Measure::Area, Some(region.area), JudgedFigure::Area),
            ("length", Measure::Length, Some(region.length), JudgedFigure::Length),
            ("depth", Measure::Depth, depth, JudgedFigure::Depth),
            ("deviation", Measure::Length, deviation, JudgedFigure::Deviation),
        ];
        for (what, measure, value, figure) in figures {
            let Some(value) = value else { continue };
            let line = line_of_finding(record, figure, finding);
            list.push(Characteristic {
                name: format!("finding {}, {} on {}: {what}", i + 1, kind(&finding.kind), finding.component.name),
                component: Some(finding.component.name.clone()),
                defect: finding.kind.defect().map(|defect| defect.name.clone()),
                finding: Some(finding.id),
                limit: line.and_then(|line| line.limit).map(Limit::Most),
                judged: line.map(|line| (line.conformity, line.decision)),
                ..plain(measure, value)
            });
        }
    }
    list
}

/// Those that people measured and keep, in their order; the form of a plane has no figure, and makes none.
pub(crate) fn of_measurements(kept: &[KeptMeasurement]) -> Vec<Characteristic> {
    let mut list = Vec::new();
    for (number, one) in (1..).zip(kept) {
        let kind = one.measurement.kind;
        let Some(figure) = one.measurement.figure else { continue };
        let measure = match kind.dimension() {
            Dimension::Length if kind.is_radius() => Measure::Radius,
            Dimension::Length => Measure::Length,
            Dimension::Area => Measure::Area,
            Dimension::Angle => Measure::Angle,
        };
        let what = if kind.is_radius() { ": radius" } else { "" };
        let note = if one.note.is_empty() { String::new() } else { format!(" ({})", one.note) };
        list.push(Characteristic {
            name: format!("measurement {number}, {}{what}{note}", kind.label().to_lowercase()),
            taken: Some(Taken {
                review: one.review,
                person: one.person.clone(),
                at: one.at,
                is_of_earlier_model: one.is_of_earlier_model,
            }),
            ..plain(measure, figure)
        });
    }
    list
}

fn plain(measure: Measure, value: Quantity) -> Characteristic {
    Characteristic {
        name: String::new(),
        measure,
        value,
        limit: None,
        judged: None,
        finding: None,
        component: None,
        defect: None,
        taken: None,
    }
}

fn lines(record: &InspectionRecord) -> impl Iterator<Item = &VerdictLine> {
    record.verdict.iter().flat_map(|verdict| &verdict.lines)
}

fn line_of<'a>(
    record: &'a InspectionRecord,
    figure: JudgedFigure,
    component: &NamedClass,
    defect: Option<&NamedClass>,
    least: Option<f64>,
) -> Option<&'a VerdictLine> {
    lines(record).find(|line| {
        line.figure == figure
            && line.component.as_ref().is_some_and(|own| own.class == component.class)
            && (defect.is_none() || line.defect.as_ref().map(|own| own.class) == defect.map(|d| d.class))
            && (least.is_none() || line.limit == least)
    })
}

/// The line with the strictest limit of a figure; of findings with the same limit the one that stands worst to it.
fn strictest<'a>(
    record: &'a InspectionRecord,
    figure: JudgedFigure,
    component: &NamedClass,
    defect: &NamedClass,
) -> Option<&'a VerdictLine> {
    let worst = |line: &VerdictLine| match line.conformity {
        Conformity::Broken => 0,
        Conformity::Undecided => 1,
        Conformity::Holds => 2,
    };
    lines(record)
        .filter(|line| line.figure == figure && line.limit.is_some())
        .filter(|line| line.component.as_ref().is_some_and(|own| own.class == component.class))
        .filter(|line| line.defect.as_ref().is_some_and(|own| own.class == defect.class))
        .min_by(|a, b| {
            let limit = |line: &VerdictLine| line.limit.unwrap_or(f64::INFINITY);
            limit(a).total_cmp(&limit(b)).then(worst(a).cmp(&worst(b)))
        })
}

fn line_of_finding<'a>(
    record: &'a InspectionRecord,
    figure: JudgedFigure,
    finding: &Finding,
) -> Option<&'a VerdictLine> {
    lines(record)
        .filter(|line| line.figure == figure && line.limit.is_some() && line.findings == [finding.id])
        .min_by(|a, b| a.limit.unwrap_or(f64::INFINITY).total_cmp(&b.limit.unwrap_or(f64::INFINITY)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{angle, cylinder, distance, plane, record};

    #[test]
    fn the_part_has_the_same_characteristics_whatever_was_found() {
        let whole = record();
        let mut clean = whole.clone();
        clean.findings.as_mut().expect("found").list.clear();
        clean.verdict = None;
        let names = |record: &InspectionRecord| of_part(record).into_iter().map(|c| c.name).collect::<Vec<_>>();
        let without_depth = |mut names: Vec<String>| {
            names.retain(|name| !name.ends_with("largest depth"));
            names
        };
        assert_eq!(without_depth(names(&whole)), without_depth(names(&clean)));
        assert!(
            !names(&whole).iter().any(|n| n == "wear on gear: largest depth"),
            "the depth of the finding is not known"
        );
        assert!(names(&clean).iter().any(|n| n == "wear on gear: largest depth"), "there is nothing, and so it is 0");
        assert!(!names(&whole).iter().any(|n| n.contains("on housing")), "nothing was seen of the housing");
        clean.findings.as_mut().expect("found").not_looked = Some("no labels".into());
        assert_eq!(names(&clean), ["housing: seen area", "gear: seen area"]);
    }

    #[test]
    fn limits_and_judgements_come_from_the_verdict() {
        let record = record();
        let list = of_part(&record);
        let named = |name: &str| list.iter().find(|c| c.name == name).expect("there");
        let area = named("wear on gear: largest area");
        assert_eq!((area.value.value, area.limit), (4.0e-4, Some(Limit::Most(3.0e-4))));
        assert_eq!(area.judged, Some((Conformity::Broken, Decision::Reject)));
        let count = named("wear on gear: number of findings");
        assert_eq!((count.value.value, count.limit), (1.0, Some(Limit::Most(5.0))));
        assert_eq!(named("crack on gear: largest area").limit, None);
        let of_findings = of_findings(&record);
        let names: Vec<&str> = of_findings.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["finding 2, wear on gear: area", "finding 2, wear on gear: length"]);
        assert_eq!(of_findings[0].judged, Some((Conformity::Broken, Decision::Reject)));
    }

    #[test]
    fn what_people_measured_has_its_unit_and_says_who_and_of_which_model() {
        let list = of_measurements(&[distance(), plane(), cylinder(), angle()]);
        let shown =
            |c: &Characteristic| (c.name.clone(), c.measure.unit(), (c.value.value * c.measure.factor()).round());
        assert_eq!(
            list.iter().map(shown).collect::<Vec<_>>(),
            [
                ("measurement 1, distance (over the rim)".to_owned(), "mm", 50.0),
                ("measurement 3, cylinder: radius (=bore)".to_owned(), "mm", 12.0),
                ("measurement 4, angle".to_owned(), "deg", 90.0),
            ]
        );
        let earlier: Vec<bool> = list.iter().flat_map(|c| &c.taken).map(|taken| taken.is_of_earlier_model).collect();
        assert_eq!(earlier, [false, true, true]);
    }
}
