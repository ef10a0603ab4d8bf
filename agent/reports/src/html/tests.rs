//! The report of a small record.

use super::*;
use crate::fixtures::{cylinder, distance, record, taxonomy, worn_plate};
use crate::{Audit, Photographs, Pictures, Reviewed, findings, pictured, take_photographs};
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::review::ReviewedState;
use semascan_model::verdict::{Decision, Override};

/// The report of `record` with drawn pictures and without photographs.
fn written(record: &InspectionRecord) -> String {
    let (mesh, taxonomy) = (worn_plate(), taxonomy());
    let pictures = Pictures::draw(&mesh, &taxonomy, 1e-3, findings(record), &pictured(record));
    let photographs: Photographs = take_photographs(record, |view| Err(format!("view {view} is not kept")));
    html(&Report { record, taxonomy: &taxonomy, pictures: &pictures, photographs: &photographs, reviewed: None })
}

/// The text of a page as people read it: elements and what they hold besides text taken out.
fn text(page: &str) -> String {
    let body = page.split_once("<body>").expect("a body").1;
    let mut text = String::new();
    for piece in body.split('<').skip(1) {
        text.push(' ');
        text.push_str(piece.split_once('>').expect("closed").1);
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn what_was_found_and_decided_is_said_with_its_uncertainty() {
    let record = record();
    let page = written(&record);
    let text = text(&page);
    for said in [
        "starter motor 7",
        "reject by the criteria",
        "area 400 +- 20 mm2 is more than 300 mm2",
        "400 ± 20 mm²",
        "28.0 ± 1.0 mm",
        "not known: no sound surface around it",
        "not seen on housing",
        "View 1: depth/1.png: is cut.",
        "40 of 1000 pixels with depth left out (40 outside the box)",
        "3 regions below 8.00 mm², 5.00 mm² together, are no findings",
        "Photographs: view 0: view 0 is not kept",
        "0199aaaa-0000-7000-8000-000000000001",
        "seed 7",
        "1, 2",
    ] {
        assert!(text.contains(said), "{said:?} in {text}");
    }
    assert!(page.contains("<meta name=\"generation\" content=\"0199aaaa-0000-7000-8000-000000000001\">"));
    assert!(page[..4096].contains("semascan"), "its first bytes say what wrote it");
    // Seven fixed views and one finding, nothing that a browser would have to fetch.
    assert_eq!(page.matches("src=\"data:image/jpeg;base64,").count(), 8);
    assert_eq!(page.matches("src=").count(), 8);
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("url("));
}

#[test]
fn text_from_outside_stays_text() {
    const EVIL: &str = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>&amp;";
    let mut record = record();
    let name = || EVIL.to_owned();
    record.part = name();
    record.source = name();
    record.settings[0].name = name();
    record.settings[0].value = name();
    record.software.name = name();
    record.views[1].reason = Some(name());
    record.components[1].name = name();
    record.outcome = Outcome::Failed { reason: name() };
    record.files.as_mut().expect("kept").names.push(name());
    let found = record.findings.as_mut().expect("found");
    found.conventions[0].text = name();
    found.components[1].component.name = name();
    found.list[0].component.name = name();
    found.list[1].region.as_mut().expect("a region").depth.unknown = Some(name());
    let verdict = record.verdict.as_mut().expect("judged");
    verdict.criteria.name = name();
    verdict.lines[0].reason = name();
    let at = verdict.at;
    verdict.overrides.push(Override { decision: Decision::Accept, person: name(), at, reason: name() });
    let mut taxonomy = taxonomy();
    taxonomy.components[2].name = name();
    taxonomy.defects[1].name = name();
    let photographs = Photographs { missing: Some(name()), ..Photographs::default() };
    let pictures = Pictures::draw(&worn_plate(), &taxonomy, 1e-3, findings(&record), &pictured(&record));
    let page = html(&Report {
        record: &record,
        taxonomy: &taxonomy,
        pictures: &pictures,
        photographs: &photographs,
        reviewed: None,
    });
    assert!(!page.contains("<script") && !page.contains("<img src=x"), "outside text became markup");
    assert!(page.matches("&lt;script&gt;").count() > 15, "{}", page.matches("&lt;script&gt;").count());
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn what_is_not_known_is_not_made_up() {
    let mut record = record();
    record.findings = None;
    record.verdict = None;
    record.outcome = Outcome::Stopped;
    let said = text(&written(&record));
    assert!(said.contains("not judged") && said.contains("no sign that there are none"), "{said}");
    assert!(said.contains("stopped early"));
    let mut record = crate::fixtures::record();
    let found = record.findings.as_mut().expect("found");
    found.list.clear();
    assert!(text(&written(&record)).contains("None. Looked for: wear, crack; regions below 8.00 mm²"));
    record.findings.as_mut().expect("found").not_looked = Some("no network looks for defects".into());
    let said = text(&written(&record));
    assert!(said.contains("Nobody looked for defects: no network looks for defects."), "{said}");
    // Without a mesh there are no pictures, and the report says so.
    let (record, taxonomy) = (crate::fixtures::record(), taxonomy());
    let (pictures, photographs) = (Pictures::default(), Photographs::default());
    let page = html(&Report {
        record: &record,
        taxonomy: &taxonomy,
        pictures: &pictures,
        photographs: &photographs,
        reviewed: None,
    });
    assert!(!page.contains("<img") && page.contains("it has no surface"));
}

#[test]
fn the_last_person_counts() {
    let mut record = record();
    let verdict = record.verdict.as_mut().expect("judged");
    let at = verdict.at;
    verdict.overrides.push(Override {
        decision: Decision::Rework,
        person: "A. Reviewer".into(),
        at,
        reason: "can be ground".into(),
    });
    let said = text(&written(&record));
    assert!(said.contains("rework by A. Reviewer") && said.contains("the criteria alone: reject"), "{said}");
    assert!(said.contains("can be ground"));
}

#[test]
fn what_people_measured_stands_with_its_uncertainty() {
    let (record, taxonomy) = (record(), taxonomy());
    let measurements = vec![distance(), cylinder()];
    let state = ReviewedState {
        sequence: 2,
        subjects: Vec::new(),
        findings: None,
        drawn: Vec::new(),
        measurements,
        found_in_error: Vec::new(),
        verdict: None,
        is_verdict_outdated: false,
        decision: None,
        conflicts: 0,
    };
    let reviewed = Reviewed { entries: Vec::new(), state, audit: Audit::Good { entries: 0, head: String::new() } };
    let (pictures, photographs) = (Pictures::default(), Photographs::default());
    let said = text(&html(&Report {
        record: &record,
        taxonomy: &taxonomy,
        pictures: &pictures,
        photographs: &photographs,
        reviewed: Some(&reviewed),
    }));
    assert!(said.contains("Distance") && said.contains("50.0 ± 1.1 mm") && said.contains("2 points"), "{said}");
    assert!(
        said.contains("R 12.000 ± 0.020 mm") && said.contains("cylinder of 812 points (residual 0.0500 mm)"),
        "{said}"
    );
    assert!(said.contains("of an earlier model") && said.contains("over the rim"), "{said}");
}
