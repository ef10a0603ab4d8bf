//! QIF 3.0 (Quality Information Framework, ISO 23952): the results of an inspection as a document that measurement and quality
//! systems exchange. Its schemas are those of the Digital Metrology Standards Consortium.
//!
//! | figure | characteristic |
//! |---|---|
//! | length, depth, deviation | `Length`, `Depth`, with a tolerance where the criteria have a limit, else `NonTolerance` MEASURED |
//! | what people measured and keep | `Length`, `Radius`, `Angle` without a tolerance, or an area as below |
//! | area, share, number | `UserDefinedUnit`, whose nominal must have a bound: without a limit that is 0 from below, and its status is NOT_ANALYZED |
//!
//! Each measured value has its combined standard uncertainty. A limit within the interval of its figure is INDETERMINATE. Lengths
//! are millimetres, angles degrees.

use crate::ReportError;
use crate::characteristics::{Characteristic, Limit, Measure, of_findings, of_measurements, of_part};
use jiff::Timestamp;
use quick_xml::events::{BytesDecl, BytesText, Event};
use quick_xml::writer::Writer;
use semascan_model::finding::Quantity;
use semascan_model::measurement::KeptMeasurement;
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::verdict::{Conformity, Decision};
use std::io;

/// Identifiers of a document are numbers; these are taken, those of characteristics follow.
const STANDARD: u32 = 1;
const PART: u32 = 2;
const RESULTS: u32 = 3;
const ACTUAL: u32 = 4;
const FIRST: u32 = 5;
/// Identifiers of a characteristic: definition, nominal, item, measurement.
const EACH: u32 = 4;

/// Units that QIF does not have.
const UNITS: [(&str, &str); 3] = [("area", "mm2"), ("share", "%"), ("number", "1")];

/// The results, with what people measured and keep, as a QIF document.
///
/// # Errors
/// [`ReportError::Nothing`] if the inspection has no result, or no characteristic is known.
pub fn qif(record: &InspectionRecord, kept: &[KeptMeasurement]) -> Result<Vec<u8>, ReportError> {
    let nothing = |reason: &str| ReportError::Nothing { format: "QIF", reason: reason.into() };
    if matches!(record.outcome, Outcome::Running | Outcome::Failed { .. }) {
        return Err(nothing("the inspection has no result"));
    }
    let of_record = of_part(record).into_iter().chain(of_findings(record));
    let characteristics: Vec<Characteristic> = of_record.chain(of_measurements(kept)).collect();
    if characteristics.is_empty() {
        return Err(nothing("the record holds no figures of components and defects, and nothing was measured"));
    }
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    document(&mut writer, record, &characteristics)?;
    let mut bytes = writer.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

type Xml = Writer<Vec<u8>>;

fn document(xml: &mut Xml, record: &InspectionRecord, list: &[Characteristic]) -> io::Result<()> {
    let most = (FIRST + EACH * list.len() as u32).to_string();
    xml.create_element("QIFDocument")
        .with_attribute(("xmlns", "http://qifstandards.org/xsd/qif3"))
        .with_attribute(("versionQIF", "3.0.0"))
        .with_attribute(("idMax", most.as_str()))
        .write_inner_content(|xml| {
            // A document is one writing of the set; the inspection itself is named in the results.
            let generation = record.files.as_ref().map(|files| files.generation.clone());
            text(xml, "QPId", &generation.unwrap_or_else(|| record.id.to_string()))?;
            within(xml, "Version", |xml| text(xml, "TimeCreated", &time(end(record))))?;
            within(xml, "Header", |xml| {
                within(xml, "Application", |xml| {
                    text(xml, "Name", &format!("{} {}", record.software.name, record.software.version))
                })?;
                text(xml, "Description", &format!("Inspection {} of {}", record.id, record.part))
            })?;
            standard(xml)?;
            units(xml)?;
            product(xml, record)?;
            definitions(xml, list)?;
            results(xml, record, list)
        })?;
    Ok(())
}

/// The standard that characteristics are decided after.
fn standard(xml: &mut Xml) -> io::Result<()> {
    counted(xml, "StandardsDefinitions", 1, |xml| {
        identified(xml, "Standard", STANDARD, |xml| {
            within(xml, "Organization", |xml| text(xml, "StandardsOrganizationEnum", "ISO"))?;
            text(xml, "Designator", "14253-1")?;
            text(xml, "Title", "Decision rules for verifying conformity or nonconformity with specifications")
        })
    })
}

fn units(xml: &mut Xml) -> io::Result<()> {
    within(xml, "FileUnits", |xml| {
        within(xml, "PrimaryUnits", |xml| {
            within(xml, "AngularUnit", |xml| {
                text(xml, "SIUnitName", "radian")?;
                text(xml, "UnitName", Measure::Angle.unit())?;
                within(xml, "UnitConversion", |xml| text(xml, "Factor", "0.0174532925199433"))
            })?;
            within(xml, "LinearUnit", |xml| {
                text(xml, "SIUnitName", "meter")?;
                text(xml, "UnitName", "mm")?;
                within(xml, "UnitConversion", |xml| text(xml, "Factor", "0.001"))
            })
        })?;
        counted(xml, "UserDefinedUnits", UNITS.len(), |xml| {
            for (measured, name) in UNITS {
                within(xml, "UserDefinedUnit", |xml| {
                    text(xml, "WhatIsMeasured", measured)?;
                    text(xml, "UnitName", name)
                })?;
            }
            Ok(())
        })
    })
}

fn product(xml: &mut Xml, record: &InspectionRecord) -> io::Result<()> {
    within(xml, "Product", |xml| {
        counted(xml, "PartSet", 1, |xml| {
            let (id, label) = (PART.to_string(), clean(&record.part));
            xml.create_element("Part")
                .with_attribute(("id", id.as_str()))
                .with_attribute(("label", label.as_str()))
                .write_empty()?;
            Ok(())
        })
    })
}

fn definitions(xml: &mut Xml, list: &[Characteristic]) -> io::Result<()> {
    within(xml, "Characteristics", |xml| {
        text(xml, "FormalStandardId", &STANDARD.to_string())?;
        counted(xml, "CharacteristicDefinitions", list.len(), |xml| {
            each(list, |id, one| identified(xml, &element(one, "Definition"), id, |xml| definition(xml, one)))
        })?;
        counted(xml, "CharacteristicNominals", list.len(), |xml| {
            each(list, |id, one| {
                identified(xml, &element(one, "Nominal"), id + 1, |xml| {
                    text(xml, "CharacteristicDefinitionId", &id.to_string())?;
                    text(xml, "Name", &one.name)?;
                    if is_dimension(one) { Ok(()) } else { bounds(xml, one) }
                })
            })
        })?;
        counted(xml, "CharacteristicItems", list.len(), |xml| {
            each(list, |id, one| {
                identified(xml, &element(one, "Item"), id + 2, |xml| {
                    attributes(xml, one)?;
                    text(xml, "Name", &one.name)?;
                    text(xml, "CharacteristicNominalId", &(id + 1).to_string())
                })
            })
        })
    })
}

/// The limit of a dimension.
fn definition(xml: &mut Xml, one: &Characteristic) -> io::Result<()> {
    if !is_dimension(one) {
        return Ok(());
    }
    match one.limit {
        None => text(xml, "NonTolerance", "MEASURED"),
        Some(limit) => within(xml, "Tolerance", |xml| {
            let (name, value) = match limit {
                Limit::Most(most) => ("MaxValue", most),
                Limit::Least(least) => ("MinValue", least),
            };
            text(xml, name, &decimal(value * one.measure.factor()))?;
            text(xml, "DefinedAsLimit", "true")
        }),
    }
}

/// What is aimed at, and the bound of a figure in a unit of its own.
fn bounds(xml: &mut Xml, one: &Characteristic) -> io::Result<()> {
    let value = |xml: &mut Xml, name: &str, value: f64| -> io::Result<()> {
        let attribute = ("unitName", one.measure.unit());
        let text = decimal(value * one.measure.factor());
        xml.create_element(name).with_attribute(attribute).write_text_content(BytesText::new(&text))?;
        Ok(())
    };
    match one.limit {
        Some(Limit::Most(most)) => {
            value(xml, "TargetValue", 0.0)?;
            value(xml, "MaxValue", most)?;
        }
        Some(Limit::Least(least)) => {
            value(xml, "TargetValue", 1.0)?;
            value(xml, "MinValue", least)?;
        }
        None => {
            // Nothing is aimed at; the schema asks for a target and a bound.
            value(xml, "TargetValue", 0.0)?;
            value(xml, "MinValue", 0.0)?;
        }
    }
    text(xml, "DefinedAsLimit", "true")
}

/// Where the characteristic belongs, or who measured it.
fn attributes(xml: &mut Xml, one: &Characteristic) -> io::Result<()> {
    let taken = one.taken.as_ref();
    let list = [
        ("measurement", taken.map(|taken| taken.review.to_string())),
        ("person", taken.map(|taken| taken.person.clone())),
        ("model", taken.filter(|taken| taken.is_of_earlier_model).map(|_| "earlier".to_owned())),
        ("finding", one.finding.map(|id| id.to_string())),
        ("component", one.component.clone()),
        ("defect", one.defect.clone()),
    ];
    let known: Vec<(&str, String)> = list.into_iter().filter_map(|(name, value)| Some((name, value?))).collect();
    if known.is_empty() {
        return Ok(());
    }
    counted(xml, "Attributes", known.len(), |xml| {
        for (name, value) in &known {
            let value = clean(value);
            xml.create_element("AttributeStr")
                .with_attribute(("name", *name))
                .with_attribute(("value", value.as_str()))
                .write_empty()?;
        }
        Ok(())
    })
}

fn results(xml: &mut Xml, record: &InspectionRecord, list: &[Characteristic]) -> io::Result<()> {
    within(xml, "Results", |xml| {
        counted(xml, "MeasurementResultsSet", 1, |xml| {
            identified(xml, "MeasurementResults", RESULTS, |xml| {
                text(xml, "ThisResultsInstanceQPId", &record.id.to_string())?;
                within(xml, "MeasuredCharacteristics", |xml| {
                    counted(xml, "CharacteristicMeasurements", list.len(), |xml| {
                        each(list, |id, one| {
                            identified(xml, &element(one, "Measurement"), id + 3, |xml| {
                                measurement(xml, record, one, id)
                            })
                        })
                    })
                })?;
                status(xml, "InspectionStatus", record)?;
                counted(xml, "ActualComponentIds", 1, |xml| text(xml, "Id", &ACTUAL.to_string()))
            })
        })?;
        counted(xml, "ActualComponentSets", 1, |xml| {
            counted(xml, "ActualComponentSet", 1, |xml| {
                identified(xml, "ActualComponent", ACTUAL, |xml| {
                    text(xml, "SerialNumber", &record.part)?;
                    status(xml, "Status", record)
                })
            })
        })
    })
}

fn measurement(xml: &mut Xml, record: &InspectionRecord, one: &Characteristic, id: u32) -> io::Result<()> {
    let judged = match one.judged {
        None => "NOT_ANALYZED",
        Some((Conformity::Holds, _)) => "PASS",
        Some((Conformity::Undecided, _)) => "INDETERMINATE",
        Some((Conformity::Broken, Decision::Rework)) => "REWORK",
        Some((Conformity::Broken, _)) => "FAIL",
    };
    within(xml, "Status", |xml| text(xml, "CharacteristicStatusEnum", judged))?;
    text(xml, "CharacteristicItemId", &(id + 2).to_string())?;
    text(xml, "TimeStamp", &time(one.taken.as_ref().map_or(end(record), |taken| taken.at)))?;
    text(xml, "ActualComponentId", &ACTUAL.to_string())?;
    let value = decimal(one.value.value * one.measure.factor());
    let uncertainty =
        one.value.expanded.map(|expanded| decimal(expanded / Quantity::COVERAGE_FACTOR * one.measure.factor()));
    let mut element = xml.create_element("Value");
    if let Some(uncertainty) = &uncertainty {
        element = element.with_attribute(("combinedUncertainty", uncertainty.as_str()));
    }
    if !is_dimension(one) {
        element = element.with_attribute(("unitName", one.measure.unit()));
    }
    element.write_text_content(BytesText::new(&value))?;
    Ok(())
}

/// What becomes of the part.
fn status(xml: &mut Xml, name: &str, record: &InspectionRecord) -> io::Result<()> {
    let status = match record.verdict.as_ref().map(|verdict| verdict.decision()) {
        None => "NOT_CALCULATED",
        Some(Decision::Accept) => "PASS",
        Some(Decision::Rework) => "REWORK",
        Some(Decision::Reject) => "FAIL",
        // That a person decides is no status of its own there.
        Some(Decision::Person) => "UNKNOWN",
    };
    within(xml, name, |xml| text(xml, "InspectionStatusEnum", status))
}

fn is_dimension(one: &Characteristic) -> bool {
    matches!(one.measure, Measure::Length | Measure::Depth | Measure::Radius | Measure::Angle)
}

fn element(one: &Characteristic, aspect: &str) -> String {
    let kind = match one.measure {
        Measure::Length => "Length",
        Measure::Depth => "Depth",
        Measure::Radius => "Radius",
        Measure::Angle => "Angle",
        Measure::Area | Measure::Count | Measure::Percent => "UserDefinedUnit",
    };
    format!("{kind}Characteristic{aspect}")
}

/// Calls `write` with the first identifier of each characteristic.
fn each(list: &[Characteristic], mut write: impl FnMut(u32, &Characteristic) -> io::Result<()>) -> io::Result<()> {
    (0..).zip(list).try_for_each(|(number, one)| write(FIRST + EACH * number, one))
}

fn within(xml: &mut Xml, name: &str, content: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
    xml.create_element(name).write_inner_content(content)?;
    Ok(())
}

fn counted(xml: &mut Xml, name: &str, n: usize, content: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
    let n = n.to_string();
    xml.create_element(name).with_attribute(("n", n.as_str())).write_inner_content(content)?;
    Ok(())
}

fn identified(xml: &mut Xml, name: &str, id: u32, content: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
    let id = id.to_string();
    xml.create_element(name).with_attribute(("id", id.as_str())).write_inner_content(content)?;
    Ok(())
}

fn text(xml: &mut Xml, name: &str, text: &str) -> io::Result<()> {
    xml.create_element(name).write_text_content(BytesText::new(&clean(text)))?;
    Ok(())
}

/// Text without the characters that XML 1.0 does not know.
fn clean(text: &str) -> String {
    let known =
        |c: &char| matches!(c, '\t' | '\n' | '\r' | '\u{20}'..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
    text.chars().filter(known).collect()
}

/// `xs:decimal`: no exponent.
fn decimal(value: f64) -> String {
    let digits = format!("{value:.6}");
    let short = digits.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

fn end(record: &InspectionRecord) -> Timestamp {
    record.ended.unwrap_or(record.began)
}

fn time(at: Timestamp) -> String {
    at.strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{angle, cylinder, distance, record};
    use quick_xml::Reader;
    use std::collections::BTreeMap;

    /// Text of the elements of a document by their path, in order.
    fn read(bytes: &[u8]) -> BTreeMap<String, Vec<String>> {
        let mut reader = Reader::from_reader(bytes);
        let (mut path, mut found) = (Vec::new(), BTreeMap::<String, Vec<String>>::new());
        loop {
            // References stand between the pieces of a text.
            let piece = match reader.read_event().expect("well-formed") {
                Event::Start(start) => {
                    path.push(start.name().as_ref().to_owned());
                    found.entry(path.join("/")).or_default().push(String::new());
                    continue;
                }
                Event::End(_) => {
                    path.pop();
                    continue;
                }
                Event::Text(text) => text.to_string(),
                Event::GeneralRef(name) => match &*name {
                    "lt" => "<".into(),
                    "gt" => ">".into(),
                    "amp" => "&".into(),
                    "quot" => "\"".into(),
                    other => panic!("{other}"),
                },
                Event::Eof => return found,
                _ => continue,
            };
            if let Some(text) = found.get_mut(&path.join("/")).and_then(|list| list.last_mut()) {
                text.push_str(&piece);
            }
        }
    }

    const MEASURED: &str = "QIFDocument/Results/MeasurementResultsSet/MeasurementResults/MeasuredCharacteristics/CharacteristicMeasurements";

    #[test]
    fn values_limits_and_statuses_are_those_of_the_record() {
        let document = read(&qif(&record(), &[]).expect("figures"));
        let statuses =
            &document[&format!("{MEASURED}/UserDefinedUnitCharacteristicMeasurement/Status/CharacteristicStatusEnum")];
        assert!(statuses.contains(&"FAIL".to_owned()) && statuses.contains(&"PASS".to_owned()));
        assert!(statuses.contains(&"NOT_ANALYZED".to_owned()));
        let lengths = &document[&format!("{MEASURED}/LengthCharacteristicMeasurement/Value")];
        assert!(lengths.contains(&"28".to_owned()), "{lengths:?}");
        let status =
            "QIFDocument/Results/MeasurementResultsSet/MeasurementResults/InspectionStatus/InspectionStatusEnum";
        assert_eq!(document[status], ["FAIL"]);
        assert_eq!(document["QIFDocument/QPId"], ["0199aaaa-0000-7000-8000-000000000001"]);
        let text = String::from_utf8(qif(&record(), &[]).expect("figures")).expect("UTF-8");
        // Expanded 20 mm2 is a standard uncertainty of 10.
        assert!(text.contains(r#"<Value combinedUncertainty="10" unitName="mm2">400</Value>"#));
    }

    #[test]
    fn what_people_measured_is_a_dimension_without_a_tolerance() {
        let bytes = qif(&record(), &[distance(), cylinder(), angle()]).expect("figures");
        let document = read(&bytes);
        let of =
            |kind: &str, what: &str| document[&format!("{MEASURED}/{kind}CharacteristicMeasurement/{what}")].clone();
        assert_eq!((of("Radius", "Value"), of("Angle", "Value")), (vec!["12".into()], vec!["90".into()]));
        assert_eq!(of("Radius", "TimeStamp"), ["1970-01-01T00:00:00Z"]);
        assert!(of("Length", "Value").contains(&"50".to_owned()));
        let text = String::from_utf8(bytes).expect("UTF-8");
        assert!(text.contains(r#"<Value combinedUncertainty="0.01">12</Value>"#), "{text}");
        assert!(
            text.contains(r#"name="person" value="A. Reviewer""#) && text.contains(r#"name="model" value="earlier""#)
        );
    }

    #[test]
    fn text_from_outside_is_no_markup() {
        let mut record = record();
        record.part = "<Part id=\"9\"/> & \u{1} \"".into();
        record.findings.as_mut().expect("found").components[1].component.name = "</Name><Name>".into();
        let bytes = qif(&record, &[]).expect("figures");
        let document = read(&bytes);
        let serial =
            &document["QIFDocument/Results/ActualComponentSets/ActualComponentSet/ActualComponent/SerialNumber"];
        assert_eq!(serial, &["<Part id=\"9\"/> &  \""]);
        assert!(!bytes.contains(&1) && !String::from_utf8_lossy(&bytes).contains("<Part id=\"9\""));
        record.outcome = Outcome::Running;
        assert!(qif(&record, &[]).is_err());
    }
}
