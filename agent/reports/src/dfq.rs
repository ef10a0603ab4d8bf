//! The Q-DAS ASCII transfer format (AQDEF, `.dfq`), which programs for statistical process control read: one part, its
//! characteristics, one measured value of each.
//!
//! K-fields that are used: K0100 number of characteristics; K1001 part number, K1002 its name, K1900 a remark; of each
//! characteristic K2001 number, K2002 name, K2004 kind (0: variable), K2022 decimals, K2110 and K2111 lower and upper limit,
//! K2142 unit, K2900 a remark. Values stand on one line, divided by SI (0x0F); the parts of each by DC4 (0x14): value, attribute
//! (0: valid), date and time, event, batch, of which the last is the inspection. The text is UTF-8, with a byte-order mark where it is not ASCII.
//!
//! The characteristics of the part come first, so that each has the same number in the files of all parts of its kind; what people
//! measured follows. The format has no field for the uncertainty of a value: it stands in the remark of the characteristic.

use crate::ReportError;
use crate::characteristics::{Characteristic, Limit, of_measurements, of_part};
use semascan_model::measurement::KeptMeasurement;
use semascan_model::record::{InspectionRecord, Outcome};
use std::fmt::Write;

const VALUE_END: char = '\u{f}';
const FIELD_END: char = '\u{14}';

/// The characteristics of the part, and of what people measured and keep, as a DFQ file.
///
/// # Errors
/// [`ReportError::Nothing`] if the inspection has no result, or no characteristic is known.
pub fn dfq(record: &InspectionRecord, kept: &[KeptMeasurement]) -> Result<Vec<u8>, ReportError> {
    let nothing = |reason: &str| ReportError::Nothing { format: "DFQ", reason: reason.into() };
    if matches!(record.outcome, Outcome::Running | Outcome::Failed { .. }) {
        return Err(nothing("the inspection has no result"));
    }
    let characteristics: Vec<Characteristic> = of_part(record).into_iter().chain(of_measurements(kept)).collect();
    if characteristics.is_empty() {
        return Err(nothing("the record holds no figures of components and defects, and nothing was measured"));
    }
    let text = written(record, &characteristics);
    let mark: &[u8] = if text.is_ascii() { b"" } else { b"\xef\xbb\xbf" };
    Ok([mark, text.as_bytes()].concat())
}

fn written(record: &InspectionRecord, characteristics: &[Characteristic]) -> String {
    let mut out = String::new();
    let mut field = |name: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = write!(out, "{name} {value}\r\n");
    };
    field("K0100", &characteristics.len().to_string());
    field("K1001/1", &one_line(&record.part));
    field("K1002/1", &one_line(&record.part));
    field(
        "K1900/1",
        &one_line(&format!("{} {}: inspection {}", record.software.name, record.software.version, record.id)),
    );
    for (number, characteristic) in (1..).zip(characteristics) {
        let Characteristic { name, measure, value, limit, taken, .. } = characteristic;
        let mut own = |code: &str, value: &str| field(&format!("{code}/{number}"), value);
        own("K2001", &number.to_string());
        own("K2002", &one_line(name));
        own("K2004", "0");
        own("K2022", &decimals(characteristic).to_string());
        match limit {
            Some(Limit::Most(most)) => own("K2111", &number_of(most * measure.factor())),
            Some(Limit::Least(least)) => own("K2110", &number_of(least * measure.factor())),
            None => {}
        }
        own("K2142", measure.unit());
        let uncertainty = match value.expanded {
            Some(expanded) => format!("U = {} {} (k = 2)", number_of(expanded * measure.factor()), measure.unit()),
            None => "uncertainty not known".into(),
        };
        let by = taken.as_ref().map_or_else(String::new, |taken| {
            let model = if taken.is_of_earlier_model { ", on an earlier model" } else { "" };
            format!("; measured by {}{model}", taken.person)
        });
        own("K2900", &one_line(&format!("{uncertainty}{by}")));
    }
    let values = characteristics.iter().map(|c| {
        let at = c.taken.as_ref().map_or(record.ended.unwrap_or(record.began), |taken| taken.at);
        let at = at.strftime("%d.%m.%Y/%H:%M:%S");
        let value = number_of(c.value.value * c.measure.factor());
        format!("{value}{FIELD_END}0{FIELD_END}{at}{FIELD_END}{FIELD_END}#{}", record.id)
    });
    out.push_str(&values.collect::<Vec<_>>().join(&VALUE_END.to_string()));
    out.push_str("\r\n");
    out
}

/// Decimals that are worth reading: those of the uncertainty's second digit.
fn decimals(characteristic: &Characteristic) -> usize {
    let shown = crate::figure::in_unit(characteristic.value, characteristic.measure.factor());
    let value = shown.split(' ').next().unwrap_or_default();
    value.split_once('.').map_or(0, |(_, digits)| digits.len())
}

/// A number with a point and up to six decimals.
fn number_of(value: f64) -> String {
    let digits = format!("{value:.6}");
    let short = digits.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// Text that ends no field and no line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{cylinder, distance, record};

    /// The fields of a file, and its values: value, attribute, time, event, batch.
    fn read(bytes: &[u8]) -> (std::collections::BTreeMap<String, String>, Vec<Vec<String>>) {
        let text = std::str::from_utf8(bytes).expect("UTF-8").trim_start_matches('\u{feff}').to_owned();
        let (coded, values): (Vec<&str>, Vec<&str>) =
            text.split("\r\n").filter(|l| !l.is_empty()).partition(|l| l.starts_with('K'));
        let fields = coded.iter().map(|line| line.split_once(' ').expect("a field")).map(|(k, v)| (k.into(), v.into()));
        assert_eq!(values.len(), 1);
        let values = values[0].split(VALUE_END).map(|value| value.split(FIELD_END).map(str::to_owned).collect());
        (fields.collect(), values.collect())
    }

    #[test]
    fn every_characteristic_has_its_name_unit_limit_and_value() {
        let (fields, values) = read(&dfq(&record(), &[]).expect("figures"));
        let count: usize = fields["K0100"].parse().expect("a number");
        assert_eq!(values.len(), count);
        let number = fields.iter().find(|(_, name)| *name == "wear on gear: largest area").expect("there").0;
        let number = number.strip_prefix("K2002/").expect("a name");
        assert_eq!(fields[&format!("K2111/{number}")], "300");
        assert_eq!(fields[&format!("K2142/{number}")], "mm2");
        assert_eq!(fields[&format!("K2900/{number}")], "U = 20 mm2 (k = 2)");
        let value = &values[number.parse::<usize>().expect("a number") - 1];
        assert_eq!(value[..2], ["400", "0"]);
        assert_eq!(value[2], "21.09.2026/14:13:24");
        assert!(value[4].starts_with('#'));
    }

    #[test]
    fn text_from_outside_ends_no_line_and_no_field() {
        let mut record = record();
        record.part = "motor\r\nK0100 99\u{f}\u{14} Größe 7".into();
        let bytes = dfq(&record, &[]).expect("figures");
        assert!(bytes.starts_with(b"\xef\xbb\xbf"));
        let (fields, _) = read(&bytes);
        assert_ne!(fields["K0100"], "99");
        assert_eq!(fields["K1001/1"], "motor  K0100 99   Größe 7");
    }

    #[test]
    fn what_is_not_known_is_refused() {
        let mut record = record();
        record.outcome = Outcome::Running;
        assert!(dfq(&record, &[]).expect_err("no result").to_string().contains("no result"));
        record.outcome = Outcome::Finished;
        record.findings = None;
        assert!(dfq(&record, &[]).is_err());
    }

    #[test]
    fn what_people_measured_follows_with_its_own_time() {
        let alone: usize = read(&dfq(&record(), &[]).expect("figures")).0["K0100"].parse().expect("a number");
        let (fields, values) = read(&dfq(&record(), &[distance(), cylinder()]).expect("figures"));
        let number = alone + 2;
        assert_eq!((fields["K0100"].as_str(), values.len()), (number.to_string().as_str(), number));
        assert_eq!(fields[&format!("K2002/{number}")], "measurement 2, cylinder: radius (=bore)");
        assert_eq!(fields[&format!("K2142/{number}")], "mm");
        assert_eq!(
            fields[&format!("K2900/{number}")],
            "U = 0.02 mm (k = 2); measured by A. Reviewer, on an earlier model"
        );
        assert_eq!(values[number - 1][..3], ["12", "0", "01.01.1970/00:00:00"]);
        let mut bare = record();
        bare.findings = None;
        assert_eq!(read(&dfq(&bare, &[distance()]).expect("a figure")).1.len(), 1);
    }
}
