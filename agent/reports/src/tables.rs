//! Tables for spreadsheets: findings, components and measurements, one a line (RFC 4180: commas, quotes where needed, CRLF, UTF-8, a head).
//!
//! Lengths in millimetres, areas in square millimetres, with their expanded uncertainty (k = 2) in a column of its own. A field
//! that is empty is not known. Text that a spreadsheet would take for a formula has an apostrophe before it.

use crate::described::outcome_name;
use crate::{ReportError, findings};
use csv::{Terminator, Writer, WriterBuilder};
use semascan_model::LengthUnit;
use semascan_model::finding::{Finding, FindingKind, Quantity, RegionFigures};
use semascan_model::measurement::{FitRecord, KeptMeasurement};
use semascan_model::record::{ClassSummary, InspectionRecord};
use semascan_model::verdict::Decision;

/// Square millimetres, millimetres.
const AREA: f64 = 1e6;
const LENGTH: f64 = 1e3;

/// A column: its name and the field of a row.
type Column<'a, Row> = (&'a str, &'a dyn Fn(&Row) -> String);

/// `findings.csv`.
///
/// # Errors
/// [`ReportError::Nothing`] where the record holds no findings because nobody looked: a table without lines would say that there
/// are none.
pub fn findings_csv(record: &InspectionRecord) -> Result<Vec<u8>, ReportError> {
    let nothing = |reason: String| ReportError::Nothing { format: "findings.csv", reason };
    match &record.findings {
        None => return Err(nothing("the record holds no findings, which is no sign that there are none".into())),
        Some(found) if found.list.is_empty() => {
            if let Some(why) = &found.not_looked {
                return Err(nothing(format!("nobody looked for defects: {why}")));
            }
        }
        Some(_) => {}
    }
    type Row<'a> = (usize, &'a Finding);
    let region =
        |row: &Row<'_>, of: &dyn Fn(&RegionFigures) -> String| row.1.region.as_ref().map(of).unwrap_or_default();
    let columns: &[Column<'_, Row<'_>>] = &[
        ("inspection", &|_| record.id.to_string()),
        ("part", &|_| text(&record.part)),
        ("number", &|row| (row.0 + 1).to_string()),
        ("finding", &|row| row.1.id.to_string()),
        ("kind", &|row| row.1.kind.name().to_owned()),
        ("component", &|row| text(&row.1.component.name)),
        ("defect", &|row| row.1.kind.defect().map(|defect| text(&defect.name)).unwrap_or_default()),
        ("instances", &|row| row.1.instances.iter().map(u16::to_string).collect::<Vec<_>>().join(" ")),
        ("area_mm2", &|row| region(row, &|r| value(Some(r.area), AREA))),
        ("area_expanded_mm2", &|row| region(row, &|r| expanded(Some(r.area), AREA))),
        ("length_mm", &|row| region(row, &|r| value(Some(r.length), LENGTH))),
        ("length_expanded_mm", &|row| region(row, &|r| expanded(Some(r.length), LENGTH))),
        ("width_mm", &|row| region(row, &|r| value(Some(r.width), LENGTH))),
        ("width_expanded_mm", &|row| region(row, &|r| expanded(Some(r.width), LENGTH))),
        ("perimeter_mm", &|row| region(row, &|r| number(r.perimeter * LENGTH))),
        ("depth_mm", &|row| region(row, &|r| value(r.depth.fitted, LENGTH))),
        ("depth_expanded_mm", &|row| region(row, &|r| expanded(r.depth.fitted, LENGTH))),
        ("depth_to_reference_mm", &|row| region(row, &|r| value(r.depth.reference, LENGTH))),
        ("depth_to_reference_expanded_mm", &|row| region(row, &|r| expanded(r.depth.reference, LENGTH))),
        ("deviation_mm", &|row| value(deviation(row.1), LENGTH)),
        ("deviation_expanded_mm", &|row| expanded(deviation(row.1), LENGTH)),
        ("seen_share", &|row| value(seen_share(row.1), 1.0)),
        ("confidence", &|row| region(row, &|r| number(r.confidence.mean))),
        ("confidence_least", &|row| region(row, &|r| number(r.confidence.least))),
        ("sigma", &|row| region(row, &|r| number(r.sigma.all.mean))),
        ("sigma_greatest", &|row| region(row, &|r| number(r.sigma.all.greatest))),
        ("x_mm", &|row| region(row, &|r| number(r.position[0] * LENGTH))),
        ("y_mm", &|row| region(row, &|r| number(r.position[1] * LENGTH))),
        ("z_mm", &|row| region(row, &|r| number(r.position[2] * LENGTH))),
        ("views", &|row| region(row, &|r| r.views.len().to_string())),
        ("best_view", &|row| region(row, &|r| r.views.first().map(|v| v.view.to_string()).unwrap_or_default())),
        ("decision", &|row| decision(record, row.1)),
    ];
    write(columns, findings(record).iter().enumerate())
}

/// `components.csv`.
///
/// # Errors
/// [`ReportError`] if it cannot be written.
pub fn components_csv(record: &InspectionRecord) -> Result<Vec<u8>, ReportError> {
    type Row<'a> = &'a ClassSummary;
    let own = |row: &Row<'_>| {
        record.findings.as_ref().and_then(|f| f.components.iter().find(|c| c.component.class == row.class))
    };
    let area = |row: &Row<'_>| own(row).map(|c| c.area).or(row.area.map(Quantity::without_uncertainty));
    let of_own = |row: &Row<'_>, of: &dyn Fn(&semascan_model::finding::ComponentFigures) -> Option<f64>| {
        own(row).and_then(of).map(number).unwrap_or_default()
    };
    let columns: &[Column<'_, Row<'_>>] = &[
        ("inspection", &|_| record.id.to_string()),
        ("part", &|_| text(&record.part)),
        ("component", &|row| text(&row.name)),
        ("class", &|row| row.class.to_string()),
        ("points", &|row| row.points.to_string()),
        ("area_mm2", &|row| value(area(row), AREA)),
        ("area_expanded_mm2", &|row| expanded(area(row), AREA)),
        ("unjudged_mm2", &|row| of_own(row, &|c| Some(c.unjudged * AREA))),
        ("confidence", &|row| of_own(row, &|c| c.confidence.map(|s| s.mean))),
        ("confidence_least", &|row| of_own(row, &|c| c.confidence.map(|s| s.least))),
        ("sigma", &|row| of_own(row, &|c| c.sigma.map(|s| s.mean))),
        ("sigma_greatest", &|row| of_own(row, &|c| c.sigma.map(|s| s.greatest))),
        ("instances", &|row| {
            own(row).map(|c| c.instances.iter().map(u16::to_string).collect::<Vec<_>>().join(" ")).unwrap_or_default()
        }),
        ("findings", &|row| {
            let known = record.findings.as_ref().is_some_and(|f| f.not_looked.is_none());
            let of = || findings(record).iter().filter(|f| f.component.class == row.class).count();
            if known { of().to_string() } else { String::new() }
        }),
        ("outcome", &|_| outcome_name(&record.outcome).to_owned()),
    ];
    write(columns, record.components.iter())
}

/// `measurements.csv`: what people measured and keep. Angles in degrees.
///
/// # Errors
/// [`ReportError`] if it cannot be written.
pub fn measurements_csv(record: &InspectionRecord, kept: &[KeptMeasurement]) -> Result<Vec<u8>, ReportError> {
    type Row<'a> = (usize, &'a KeptMeasurement);
    let factor = |row: &Row<'_>| 1.0 / row.1.measurement.kind.dimension().one(LengthUnit::Millimetres);
    let axis = |row: &Row<'_>, k: usize| value(row.1.measurement.along_axes.map(|axes| axes[k]), LENGTH);
    // The form of a measurement of several features is in the rows of the elements that it was taken from.
    let form = |row: &Row<'_>| match row.1.measurement.features.as_slice() {
        [one] => Some(*one),
        _ => None,
    };
    let fit = |row: &Row<'_>, of: &dyn Fn(FitRecord) -> String| {
        form(row).and_then(|feature| feature.fit).map(of).unwrap_or_default()
    };
    let direction =
        |row: &Row<'_>, k: usize| form(row).and_then(|one| one.direction).map(|d| number(d[k])).unwrap_or_default();
    let position = |row: &Row<'_>, feature: usize, k: usize| {
        let features = &row.1.measurement.features;
        features.get(feature).map(|one| number(one.position[k] * LENGTH)).unwrap_or_default()
    };
    let columns: &[Column<'_, Row<'_>>] = &[
        ("inspection", &|_| record.id.to_string()),
        ("part", &|_| text(&record.part)),
        ("number", &|row| (row.0 + 1).to_string()),
        ("review", &|row| row.1.review.to_string()),
        ("kind", &|row| row.1.measurement.kind.key().to_owned()),
        ("value", &|row| value(row.1.measurement.figure, factor(row))),
        ("expanded", &|row| expanded(row.1.measurement.figure, factor(row))),
        ("unit", &|row| {
            let unit = row.1.measurement.kind.dimension().name(LengthUnit::Millimetres);
            row.1.measurement.figure.map(|_| unit).unwrap_or_default()
        }),
        ("along_x_mm", &|row| axis(row, 0)),
        ("along_y_mm", &|row| axis(row, 1)),
        ("along_z_mm", &|row| axis(row, 2)),
        ("taken_from", &|row| {
            row.1.measurement.features.iter().map(|one| one.kind.name()).collect::<Vec<_>>().join(" ")
        }),
        ("x1_mm", &|row| position(row, 0, 0)),
        ("y1_mm", &|row| position(row, 0, 1)),
        ("z1_mm", &|row| position(row, 0, 2)),
        ("x2_mm", &|row| position(row, 1, 0)),
        ("y2_mm", &|row| position(row, 1, 1)),
        ("z2_mm", &|row| position(row, 1, 2)),
        ("x3_mm", &|row| position(row, 2, 0)),
        ("y3_mm", &|row| position(row, 2, 1)),
        ("z3_mm", &|row| position(row, 2, 2)),
        ("direction_x", &|row| direction(row, 0)),
        ("direction_y", &|row| direction(row, 1)),
        ("direction_z", &|row| direction(row, 2)),
        ("residual_rms_mm", &|row| fit(row, &|fit| number(fit.rms * LENGTH))),
        ("residual_largest_mm", &|row| fit(row, &|fit| number(fit.largest * LENGTH))),
        ("points_used", &|row| fit(row, &|fit| fit.used.to_string())),
        ("points_left_out", &|row| fit(row, &|fit| fit.left_out.to_string())),
        ("of_earlier_model", &|row| if row.1.is_of_earlier_model { "yes" } else { "no" }.to_owned()),
        ("person", &|row| text(&row.1.person)),
        ("at", &|row| row.1.at.to_string()),
        ("note", &|row| text(&row.1.note)),
    ];
    write(columns, kept.iter().enumerate())
}

fn write<Row>(columns: &[Column<'_, Row>], rows: impl Iterator<Item = Row>) -> Result<Vec<u8>, ReportError> {
    let mut writer: Writer<Vec<u8>> = WriterBuilder::new().terminator(Terminator::CRLF).from_writer(Vec::new());
    writer.write_record(columns.iter().map(|(name, _)| *name))?;
    for row in rows {
        writer.write_record(columns.iter().map(|(_, field)| field(&row)))?;
    }
    writer.into_inner().map_err(|error| ReportError::Csv(error.into_error().into()))
}

fn deviation(finding: &Finding) -> Option<Quantity> {
    match &finding.kind {
        FindingKind::Deviation { greatest, .. } => Some(*greatest),
        _ => None,
    }
}

fn seen_share(finding: &Finding) -> Option<Quantity> {
    match &finding.kind {
        FindingKind::Completeness { share, missing, .. } => {
            share.or(missing.then(|| Quantity::without_uncertainty(0.0)))
        }
        _ => None,
    }
}

/// What follows from a finding; empty where it was not judged.
fn decision(record: &InspectionRecord, finding: &Finding) -> String {
    let lines = record.verdict.iter().flat_map(|verdict| &verdict.lines);
    let of = lines.filter(|line| line.findings.contains(&finding.id)).map(|line| line.decision);
    of.reduce(Decision::with).map(|decision| decision.name().to_owned()).unwrap_or_default()
}

fn value(quantity: Option<Quantity>, factor: f64) -> String {
    quantity.map(|q| number(q.value * factor)).unwrap_or_default()
}

fn expanded(quantity: Option<Quantity>, factor: f64) -> String {
    quantity.and_then(|q| q.expanded).map(|u| number(u * factor)).unwrap_or_default()
}

/// Up to six digits behind the point; empty where it is no number.
fn number(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let digits = format!("{value:.6}");
    let short = digits.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// Text from outside, which no spreadsheet takes for a formula.
fn text(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{cylinder, distance, record};

    /// The table read back, by the names of its head.
    fn read(bytes: &[u8]) -> Vec<std::collections::BTreeMap<String, String>> {
        let mut reader = csv::Reader::from_reader(bytes);
        let head = reader.headers().expect("a head").clone();
        let rows = reader.records().map(|row| {
            let row = row.expect("as wide as the head");
            head.iter().map(str::to_owned).zip(row.iter().map(str::to_owned)).collect()
        });
        rows.collect()
    }

    #[test]
    fn findings_come_back_with_their_figures_in_millimetres() {
        let mut record = record();
        record.part = "a \"large\", old\r\nmotor".into();
        let bytes = findings_csv(&record).expect("a table");
        assert!(bytes.windows(2).any(|two| two == b"\r\n"));
        let rows = read(&bytes);
        assert_eq!(rows.len(), 2);
        let worn = &rows[1];
        assert_eq!(worn["part"], record.part);
        assert_eq!((worn["area_mm2"].as_str(), worn["area_expanded_mm2"].as_str()), ("400", "20"));
        assert_eq!((worn["length_mm"].as_str(), worn["length_expanded_mm"].as_str()), ("28", "1"));
        assert_eq!((worn["width_mm"].as_str(), worn["width_expanded_mm"].as_str()), ("20", ""));
        assert_eq!(
            (worn["depth_mm"].as_str(), worn["decision"].as_str(), worn["best_view"].as_str()),
            ("", "reject", "0")
        );
        assert_eq!(
            (rows[0]["kind"].as_str(), rows[0]["area_mm2"].as_str(), rows[0]["seen_share"].as_str()),
            ("completeness", "", "0")
        );
    }

    #[test]
    fn measurements_are_in_millimetres_and_degrees() {
        let rows = read(&measurements_csv(&record(), &[distance(), cylinder()]).expect("a table"));
        let field = |row: usize, names: [&str; 4]| names.map(|name| rows[row][name].clone());
        assert_eq!(field(0, ["kind", "value", "expanded", "unit"]), ["distance", "50", "1.1", "mm"]);
        assert_eq!(field(0, ["along_y_mm", "x2_mm", "residual_rms_mm", "x3_mm"]), ["-40", "30", "", ""]);
        assert_eq!(field(1, ["kind", "value", "points_used", "direction_z"]), ["cylinder", "12", "812", "1"]);
        assert_eq!(
            field(1, ["note", "of_earlier_model", "along_x_mm", "person"]),
            ["'=bore", "yes", "", "A. Reviewer"]
        );
    }

    #[test]
    fn components_keep_what_is_not_known_empty() {
        let mut record = record();
        record.components[2].name = "=cmd|' /C calc'!A0".into();
        let rows = read(&components_csv(&record).expect("a table"));
        assert_eq!(rows.len(), 3);
        assert!(rows[2]["component"].starts_with('\''), "{}", rows[2]["component"]);
        assert_eq!((rows[2]["area_mm2"].as_str(), rows[2]["area_expanded_mm2"].as_str()), ("10000", "200"));
        assert_eq!((rows[2]["instances"].as_str(), rows[2]["findings"].as_str()), ("1 2", "1"));
        assert_eq!(rows[0]["area_mm2"], "", "no area was measured");
        record.findings.as_mut().expect("found").not_looked = Some("no labels".into());
        assert_eq!(read(&components_csv(&record).expect("a table"))[2]["findings"], "");
    }

    #[test]
    fn nobody_looked_is_no_empty_table() {
        let mut record = record();
        let found = record.findings.as_mut().expect("found");
        found.list.clear();
        assert_eq!(read(&findings_csv(&record).expect("looked for, and nothing found")).len(), 0);
        record.findings.as_mut().expect("found").not_looked = Some("no labels were used".into());
        assert!(findings_csv(&record).expect_err("not known").to_string().contains("no labels were used"));
        record.findings = None;
        assert!(findings_csv(&record).is_err());
    }
}
