use super::*;
use crate::findings::fixtures::grid;
use semascan_model::finding::{
    Depth, FindingId, Footprint, LabelUncertainty, LeftOut, NamedClass, RegionFigures, Spread,
};
use semascan_model::record::{LabelSource, RegionRecord, RunRecord};

pub(crate) const HEAD: &str = "version = 1\nname = \"motor\"\nrevision = \"3\"\n";

fn named(class: u16, name: &str) -> NamedClass {
    NamedClass { class, name: name.into() }
}

fn quantity(value: f64, expanded: f64) -> Quantity {
    Quantity { value, expanded: Some(expanded) }
}

/// A defect of an area and length, each uncertain by a tenth.
pub(crate) fn defect(number: u8, component: (u16, &str), defect: (u16, &str), mm2: f64, mm: f64) -> Finding {
    let spread = Spread { mean: 0.9, least: 0.6, greatest: 1.0 };
    let tenth = |value: f64| quantity(value, 0.1 * value);
    Finding {
        id: FindingId::from_bytes([number; 16]),
        kind: FindingKind::Defect { defect: named(defect.0, defect.1) },
        component: named(component.0, component.1),
        instances: Vec::new(),
        region: Some(RegionFigures {
            area: tenth(mm2 * MM2),
            area_budget: Default::default(),
            length: tenth(mm * MM),
            width: tenth(mm * MM),
            perimeter: 4.0 * mm * MM,
            depth: Depth { fitted: None, unknown: Some("bent".into()), reference: None },
            confidence: spread,
            sigma: LabelUncertainty { all: Spread { mean: 0.02, ..spread }, data: None, model: None },
            position: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            outlines: Vec::new(),
            views: Vec::new(),
            footprint: Footprint::default(),
        }),
    }
}

pub(crate) const GEAR: (u16, &str) = (1, "gear");
const CAP: (u16, &str) = (2, "cap");
pub(crate) const WEAR: (u16, &str) = (1, "wear");
pub(crate) const CRACK: (u16, &str) = (2, "crack");

/// A gear of 1000 mm2 and a cap of 500 mm2, with these findings, in a finished inspection.
pub(crate) fn record(list: Vec<Finding>) -> InspectionRecord {
    let spread = Spread { mean: 0.95, least: 0.5, greatest: 1.0 };
    let component = |(class, name): (u16, &str), mm2: f64| ComponentFigures {
        component: named(class, name),
        instances: Vec::new(),
        area: quantity(mm2 * MM2, 0.02 * mm2 * MM2),
        unjudged: 0.0,
        confidence: Some(spread),
        sigma: Some(Spread { mean: 0.01, ..spread }),
    };
    InspectionRecord {
        schema_version: 2,
        id: semascan_model::InspectionId::new(1, &[0; 10]),
        began: Timestamp::UNIX_EPOCH,
        ended: None,
        outcome: Outcome::Finished,
        files: None,
        software: SoftwareRecord { name: "semascan".into(), version: "1".into() },
        part: "motor".into(),
        source: "scene".into(),
        labels: LabelSource::Source,
        networks: None,
        settings: Vec::new(),
        voxel: Some(0.5e-3),
        points: 1,
        base_from_table: None,
        refinement: None,
        photometric: None,
        plan: None,
        run: Some(RunRecord::new(5, 5, 0.5, RegionRecord::default())),
        views: Vec::new(),
        components: Vec::new(),
        defects: Vec::new(),
        findings: Some(FindingsRecord {
            conventions: Vec::new(),
            looked_for: vec![named(1, "wear"), named(2, "crack")],
            not_looked: None,
            least_area: 4.0 * MM2,
            left_out: Vec::new(),
            components: vec![component(GEAR, 1000.0), component(CAP, 500.0)],
            list,
        }),
        verdict: None,
        truth: None,
    }
}

fn judged(mut record: InspectionRecord, rules: &str) -> Verdict {
    let checked = CheckedCriteria::parse(&format!("{HEAD}{rules}")).expect("right criteria");
    judge(&mut record, &checked, None, Timestamp::UNIX_EPOCH);
    record.verdict.expect("judged")
}

/// What follows from rules on findings, and the reasons of the lines that do not accept.
fn decision(record: InspectionRecord, rules: &str) -> (Decision, String) {
    let verdict = judged(record, rules);
    let reasons: Vec<&str> =
        verdict.lines.iter().filter(|l| l.decision != Decision::Accept).map(|l| l.reason.as_str()).collect();
    (verdict.automatic, reasons.join("; "))
}

pub(crate) fn rule(defect: &str, limit: &str) -> String {
    format!("[[defect]]\ndefect = \"{defect}\"\n{limit}\nthen = \"reject\"\n")
}

#[test]
fn the_interval_decides_and_not_the_value() {
    let worn = |mm2: f64| record(vec![defect(1, GEAR, WEAR, mm2, 10.0)]);
    let limit = rule("wear", "largest_area_mm2 = 100");
    assert_eq!(decision(worn(90.0), &limit).0, Decision::Accept, "81 to 99");
    assert_eq!(decision(worn(95.0), &limit).0, Decision::Person, "85.5 to 104.5");
    assert_eq!(decision(worn(105.0), &limit).0, Decision::Person, "94.5 to 115.5");
    let (rejected, reason) = decision(worn(112.0), &limit);
    assert_eq!(rejected, Decision::Reject, "100.8 to 123.2");
    assert!(reason.contains("112.00 +- 11.20 mm2, at most 100"), "{reason}");
    let mut unknown = worn(10.0);
    let region = unknown.findings.as_mut().and_then(|f| f.list[0].region.as_mut()).expect("a region");
    region.area.expanded = None;
    assert_eq!(decision(unknown, &limit).0, Decision::Person, "nobody knows how far off it is");
}

#[test]
fn every_limit_is_judged() {
    let list =
        || vec![defect(1, GEAR, WEAR, 60.0, 20.0), defect(2, GEAR, WEAR, 40.0, 9.0), defect(3, CAP, WEAR, 30.0, 5.0)];
    for (limit, expected) in [
        ("largest_length_mm = 23", Decision::Accept),
        ("largest_length_mm = 15", Decision::Reject),
        ("largest_length_mm = 21", Decision::Person),
        // 100 of 1000 on the gear, 30 of 500 on the cap.
        ("largest_share = 0.12", Decision::Accept),
        ("largest_share = 0.105", Decision::Person),
        ("largest_share = 0.08", Decision::Reject),
        ("largest_count = 2", Decision::Accept),
        ("largest_count = 1", Decision::Reject),
        ("largest_count = 0\ncounted_from_mm2 = 70", Decision::Accept),
        ("largest_count = 0\ncounted_from_mm2 = 62", Decision::Person),
        ("least_confidence = 0.8", Decision::Accept),
        ("least_confidence = 0.88", Decision::Person),
        ("least_confidence = 0.95", Decision::Reject),
        ("largest_depth_mm = 1", Decision::Person),
    ] {
        assert_eq!(decision(record(list()), &rule("wear", limit)).0, expected, "{limit}");
    }
    let mut deep = record(list());
    for region in deep.findings.as_mut().into_iter().flat_map(|f| &mut f.list).filter_map(|f| f.region.as_mut()) {
        region.depth.fitted = Some(quantity(0.5e-3, 0.1e-3));
    }
    assert_eq!(decision(deep, &rule("wear", "largest_depth_mm = 0.7")).0, Decision::Accept);
}

#[test]
fn a_rule_for_a_component_stands_in_place_of_the_general_one() {
    let list = || vec![defect(1, GEAR, WEAR, 60.0, 20.0), defect(2, CAP, WEAR, 60.0, 20.0)];
    let rules = |on: &str| {
        format!(
            "{}[[defect]]\ncomponent = \"{on}\"\ndefect = \"wear\"\nthen = \"accept\"\n",
            rule("wear", "largest_area_mm2 = 10")
        )
    };
    let (rejected, reason) = decision(record(list()), &rules("gear"));
    assert!(rejected == Decision::Reject && reason.contains("on cap") && !reason.contains("on gear"), "{reason}");
    // Two rules for the same pair are both judged.
    let steps = "[[defect]]\ndefect = \"wear\"\nlargest_area_mm2 = 10\nthen = \"rework\"\n\
                 [[defect]]\ndefect = \"wear\"\nlargest_area_mm2 = 200\nthen = \"reject\"\n";
    assert_eq!(decision(record(list()), steps).0, Decision::Rework);
}

#[test]
fn what_nobody_looked_for_or_saw_is_not_accepted() {
    let none = rule("crack", "largest_count = 0");
    assert_eq!(decision(record(Vec::new()), &none).0, Decision::Accept);
    let change = |change: &dyn Fn(&mut InspectionRecord, &mut FindingsRecord)| {
        let mut record = record(Vec::new());
        let mut findings = record.findings.take().expect("some");
        change(&mut record, &mut findings);
        record.findings = Some(findings);
        decision(record, &none)
    };
    let (decided, reason) = change(&|_, f| f.not_looked = Some("no network looks for defects".into()));
    assert!(decided == Decision::Person && reason.contains("no network"), "{reason}");
    let (decided, reason) = change(&|_, f| f.looked_for.truncate(1));
    assert!(decided == Decision::Person && reason.contains("no such class"), "{reason}");
    let (decided, reason) = change(&|_, f| f.components[1].area.value = 0.0);
    assert!(decided == Decision::Person && reason.contains("nothing of the component was seen"), "{reason}");
    let (decided, reason) = change(&|_, f| f.components[0].unjudged = 50.0 * MM2);
    assert!(decided == Decision::Person && reason.contains("gear: of 5.00"), "{reason}");
    for outcome in [Outcome::Running, Outcome::Stopped, Outcome::Failed { reason: "disk".into() }] {
        assert_eq!(change(&|r, _| r.outcome = outcome.clone()).0, Decision::Person, "{outcome:?}");
    }
    assert_eq!(change(&|r, _| r.run = Some(RunRecord::new(9, 1, 0.5, RegionRecord::default()))).0, Decision::Person);
    let mut without = record(Vec::new());
    without.findings = None;
    assert_eq!(decision(without, &none).0, Decision::Person);
}

#[test]
fn what_is_too_small_to_be_found_leaves_small_limits_undecided() {
    let small = |limit: &str| {
        let mut record = record(Vec::new());
        let left = LeftOut { component: named(1, "gear"), defect: named(1, "wear"), regions: 3, area: 5.0 * MM2 };
        record.findings.as_mut().expect("some").left_out.push(left);
        decision(record, &rule("wear", limit)).0
    };
    assert_eq!([small("largest_area_mm2 = 4"), small("largest_area_mm2 = 1")], [Decision::Accept, Decision::Person]);
    // Eight voxels in a row, each of which has an eighth of the least area.
    assert_eq!(
        [small("largest_length_mm = 5.7"), small("largest_length_mm = 5.6")],
        [Decision::Accept, Decision::Person]
    );
    assert_eq!([small("largest_share = 0.006"), small("largest_share = 0.004")], [Decision::Accept, Decision::Reject]);
}

#[test]
fn findings_without_a_rule_are_not_passed_over() {
    let list = || vec![defect(7, CAP, CRACK, 20.0, 9.0)];
    let rules = rule("wear", "largest_count = 0");
    let verdict = judged(record(list()), &rules);
    assert_eq!(verdict.automatic, Decision::Person);
    let line = verdict.lines.last().expect("lines");
    assert!(line.findings == [FindingId::from_bytes([7; 16])] && line.reason.contains("no rule"), "{line:?}");
    assert_eq!(judged(record(list()), &format!("unlisted = \"reject\"\n{rules}")).automatic, Decision::Reject);
    // On no component: rules judge components.
    let nowhere = vec![defect(7, (0, "none"), WEAR, 20.0, 9.0)];
    assert_eq!(judged(record(nowhere), &rules).automatic, Decision::Person);
}

#[test]
fn components_are_expected_and_become_findings() {
    let rules = "[[component]]\ncomponent = \"gear\"\nexpected_area_mm2 = 1200\nleast_completeness = 0.9\n\
                 least_confidence = 0.9\nthen = \"rework\"\n[[component]]\ncomponent = \"cap\"\nthen = \"reject\"\n";
    let mut inspected = record(Vec::new());
    let checked = CheckedCriteria::parse(&format!("{HEAD}{rules}")).expect("right");
    judge(&mut inspected, &checked, None, Timestamp::UNIX_EPOCH);
    let verdict = inspected.verdict.clone().expect("judged");
    assert_eq!(verdict.automatic, Decision::Rework, "83 % +- 2 % of the gear");
    let findings = inspected.findings.clone().expect("some").list;
    assert!(findings.len() == 1 && verdict.lines[1].findings == [findings[0].id], "{findings:?}");
    // Judged again: the finding keeps its name, and a person's decision stays.
    let by_person =
        semascan_model::verdict::Override::new(Decision::Accept, "A", Timestamp::UNIX_EPOCH, "known").expect("whole");
    inspected.verdict.as_mut().expect("judged").overrides.push(by_person);
    judge(&mut inspected, &checked, None, Timestamp::UNIX_EPOCH);
    assert_eq!(inspected.findings.as_ref().expect("some").list, findings);
    assert_eq!(inspected.verdict.as_ref().expect("judged").decision(), Decision::Accept);
    inspected.findings.as_mut().expect("some").components[1].area.value = 0.0;
    judge(&mut inspected, &checked, None, Timestamp::UNIX_EPOCH);
    assert_eq!(inspected.verdict.expect("judged").automatic, Decision::Reject);
}

#[test]
fn surface_off_the_reference_is_judged() {
    let rules = "[reference]\nfile = \"x.ply\"\nunit = \"m\"\ntolerance_mm = 0.3\nthen = \"reject\"\n";
    let mut checked = CheckedCriteria::parse(&format!("{HEAD}{rules}")).expect("right");
    let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    checked.reference = crate::findings::Reference::new(&square, &[[0, 1, 2], [0, 2, 3]]);
    let taxonomy = Taxonomy::from_names(&["gear", "cap"], &["wear", "crack"]);
    let of = |deep: f32| {
        let mesh = grid(60, 40, |x, y| if (x as f32 - 20.0).hypot(y as f32 - 20.0) < 8.0 { -deep * 1e-3 } else { 0.0 });
        let mut inspected = record(Vec::new());
        inspected.voxel = Some(1e-3);
        judge(&mut inspected, &checked, Some((&mesh, &taxonomy)), Timestamp::UNIX_EPOCH);
        let verdict = inspected.verdict.expect("judged");
        (verdict.automatic, inspected.findings.expect("some").list.len())
    };
    assert_eq!([of(0.2), of(0.35), of(1.5)], [(Decision::Accept, 0), (Decision::Person, 1), (Decision::Reject, 1)]);
    // Without a mesh nothing was compared.
    let mut inspected = record(Vec::new());
    judge(&mut inspected, &checked, None, Timestamp::UNIX_EPOCH);
    assert_eq!(inspected.verdict.expect("judged").automatic, Decision::Person);
}
