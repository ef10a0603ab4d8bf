//! Findings of simulated motors against truth: found, true to size, within their intervals, and with names that stay. The full
//! run is `semascan tables findings`, on more motors and larger pictures; the figures here are what so few reach.

use semascan_evaluation::tables::findings::{Config, Report, run};
use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_inspection::{Inspected, Inspection};
use semascan_model::finding::{Finding, FindingId};
use semascan_simulation::{VirtualCell, VirtualCellSpec};

#[test]
fn defects_of_motors_are_found_and_their_intervals_hold_the_truth() {
    let config = Config { motors: vec![3001, 3002, 3003], views: 6, size: (480, 360), ..Config::default() };
    let Report { summary, motors, .. } = run(&config, &|_, _| {}).expect("motors");
    let share = |(part, all): (usize, usize)| part as f64 / all as f64;
    assert!(summary.regions > 30 && share((summary.found, summary.regions)) >= 0.9, "{summary:?}");
    assert!(summary.false_findings <= motors.len(), "{summary:?}");
    assert!(
        summary.area_error.is_some_and(|e| e < 0.1) && summary.length_error.is_some_and(|e| e < 0.1),
        "{summary:?}"
    );
    assert!(summary.area_covered.1 > 20 && share(summary.area_covered) >= 0.85, "{summary:?}");
    assert!(share(summary.length_covered) >= 0.8, "{summary:?}");
}

const MOTOR: &str = "virtual:starter-motor?seed=3004&views=5&size=320x240&cell=2.5";

fn inspect(registration: RegistrationMethod, earlier: &[Finding]) -> Inspected {
    let cell = VirtualCell::open(&VirtualCellSpec::parse(MOTOR).expect("a URI")).expect("a motor");
    let spec = InspectionSpec { registration, ..InspectionSpec::default() };
    let inspection = Inspection::new(spec, Box::new(cell)).expect("set up");
    inspection.with_earlier_findings(earlier.to_vec()).start().wait().expect("a model")
}

fn findings(inspected: &Inspected) -> Vec<Finding> {
    inspected.record.findings.clone().expect("somebody looked").list
}

fn ids(findings: &[Finding]) -> Vec<FindingId> {
    findings.iter().map(|f| f.id).collect()
}

#[test]
fn names_stay_in_a_second_run_and_in_a_map_with_other_poses() {
    let first = findings(&inspect(RegistrationMethod::Auto, &[]));
    assert!(first.len() > 5, "{}", first.len());
    assert_eq!(findings(&inspect(RegistrationMethod::Auto, &[])), first, "all figures are the same");
    let rebuilt = findings(&inspect(RegistrationMethod::Kinematic, &first));
    let places: Vec<_> = rebuilt.iter().map(|f| f.region.as_ref().map(|r| r.position)).collect();
    let before: Vec<_> = first.iter().map(|f| f.region.as_ref().map(|r| r.position)).collect();
    assert_ne!(places, before, "the poses are others");
    // Those that are clearly larger than what is left out are there again.
    let large = |list: &[Finding]| -> Vec<FindingId> {
        let is_large = |f: &&Finding| f.area().is_some_and(|a| a.value > 50e-6);
        list.iter().filter(is_large).map(|f| f.id).collect()
    };
    let (now, then) = (ids(&rebuilt), large(&first));
    let kept = then.iter().filter(|id| now.contains(id)).count();
    // Under poses off by half a millimetre two of them may have become one, which has one name.
    assert!(then.len() > 9 && kept + 1 >= then.len(), "{kept} of {} names", then.len());
    let unique: std::collections::BTreeSet<_> = now.iter().collect();
    assert_eq!(unique.len(), now.len());
}

#[test]
fn no_labels_no_findings_and_a_reason() {
    let cell = VirtualCell::open(&VirtualCellSpec::parse(MOTOR).expect("a URI")).expect("a motor");
    let labels = semascan_inspection::spec::LabelSource::None;
    let spec = InspectionSpec { labels, ..InspectionSpec::default() };
    let inspected = Inspection::new(spec, Box::new(cell)).expect("set up").start().wait().expect("a model");
    let findings = inspected.record.findings.expect("a mesh");
    assert!(findings.list.is_empty() && findings.not_looked.is_some_and(|why| why.contains("no labels")));
}
