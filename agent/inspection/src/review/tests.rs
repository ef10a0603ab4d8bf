use super::*;
use crate::ports::LoggedReview;
use crate::verdict::judge;
use crate::verdict::tests::{CRACK, GEAR, HEAD, WEAR, defect, record, rule};
use semascan_model::finding::{FindingId, FindingKind, Quantity};
use semascan_model::measurement::{FeatureKind, MeasuredFeature, MeasurementKind, MeasurementRecord};
use semascan_model::record::{ClassSummary, FilesRecord};
use semascan_model::review::{ReviewAction, ReviewId, Subject, SurfacePatch};
use semascan_model::verdict::Decision;
use std::sync::atomic::{AtomicUsize, Ordering};
use uuid::Uuid;

/// A log in memory; it counts the entries that were read.
#[derive(Default)]
struct MemoryLog(Mutex<Vec<(LoggedReview, ReviewResult)>>, AtomicUsize);

impl ReviewLog for MemoryLog {
    fn entries(&self, inspection: InspectionId, first: u64, limit: u32) -> Result<Vec<LoggedReview>, PortError> {
        let log = self.0.lock().expect("whole");
        let about = log.iter().map(|(logged, _)| logged).filter(|logged| logged.entry.inspection == inspection);
        let read: Vec<_> = about.filter(|l| l.entry.sequence >= first).take(limit as usize).cloned().collect();
        self.1.fetch_add(read.len(), Ordering::Relaxed);
        Ok(read)
    }

    fn entry(&self, review: ReviewId) -> Result<Option<ReviewEntry>, PortError> {
        let log = self.0.lock().expect("whole");
        let found = log.iter().map(|(logged, _)| &logged.entry).find(|entry| entry.review.id == review).cloned();
        self.1.fetch_add(usize::from(found.is_some()), Ordering::Relaxed);
        Ok(found)
    }

    fn last(&self) -> Result<u64, PortError> {
        Ok(self.0.lock().expect("whole").len() as u64)
    }

    fn append(&self, entry: &ReviewEntry, result: &ReviewResult, _: &BusMessage) -> Result<String, PortError> {
        let mut log = self.0.lock().expect("whole");
        let previous = log.last().map_or(chain::FIRST, |(logged, _)| &logged.hash);
        let hash = chain::hash(previous, &chain::canonical(entry).expect("plain data"));
        log.push((LoggedReview { entry: entry.clone(), hash: hash.clone() }, result.clone()));
        Ok(hash)
    }
}

struct Desk {
    desk: ReviewDesk,
    log: Arc<MemoryLog>,
    record: InspectionRecord,
    criteria: CheckedCriteria,
}

/// A worn gear of which the criteria reject 100 mm2 of wear and any crack.
fn desk() -> Desk {
    let mut record = record(vec![defect(1, GEAR, WEAR, 150.0, 10.0), defect(2, GEAR, WEAR, 20.0, 5.0)]);
    let summary = |class: u16, name: &str| ClassSummary {
        class,
        name: name.into(),
        points: 1,
        area: None,
        confidence: 1.0,
        sigma: None,
    };
    record.components = vec![summary(0, "none"), summary(1, "gear"), summary(2, "cap")];
    record.defects = vec![summary(0, "none"), summary(1, "wear"), summary(2, "crack")];
    record.files = Some(FilesRecord { generation: "g1".into(), names: Vec::new() });
    let rules = [rule("wear", "largest_area_mm2 = 100"), rule("crack", "largest_count = 0")].concat();
    let criteria = CheckedCriteria::parse(&format!("{HEAD}{rules}")).expect("right criteria");
    judge(&mut record, &criteria, None, Timestamp::UNIX_EPOCH);
    let log = Arc::new(MemoryLog::default());
    Desk { desk: ReviewDesk::new(log.clone()), log, record, criteria }
}

impl Desk {
    fn take(&self, review: Review) -> Result<Taken, ReviewError> {
        self.desk.take(&self.record, Some(&self.criteria), review, Timestamp::UNIX_EPOCH)
    }

    fn entries(&self) -> Vec<ReviewEntry> {
        let logged = self.log.entries(self.record.id, 0, u32::MAX).expect("reads");
        logged.into_iter().map(|logged| logged.entry).collect()
    }

    /// The name of the field that a review is refused for.
    fn refused(&self, review: Review) -> String {
        match self.take(review) {
            Err(ReviewError::Field(error)) => error.field,
            other => panic!("{other:?}"),
        }
    }
}

fn review(number: u128, subject: Subject, seen: u64, action: ReviewAction) -> Review {
    Review {
        id: ReviewId(Uuid::from_u128(number)),
        subject,
        seen,
        model: None,
        action,
        person: "A. Reviewer".into(),
        reason: "because".into(),
        resolves: Vec::new(),
    }
}

fn finding(number: u8) -> FindingId {
    FindingId::from_bytes([number; 16])
}

fn on(number: u8) -> Subject {
    Subject::Finding { finding: finding(number) }
}

fn gear() -> Subject {
    Subject::Component { component: "gear".into() }
}

const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.1], [0.02, 0.0, 0.1], [0.02, 0.01, 0.1], [0.0, 0.01, 0.1]];

#[test]
fn a_decision_about_the_part_counts_and_the_lines_stay() {
    let desk = desk();
    assert_eq!(desk.record.verdict.as_ref().expect("judged").automatic, Decision::Reject);
    let taken = desk.take(review(1, Subject::Part, 0, ReviewAction::Rework)).expect("taken");
    assert_eq!((taken.entry.sequence, taken.is_known), (1, false));
    assert_eq!(taken.entry.versions.model.as_deref(), Some("g1"));
    assert_eq!(taken.entry.versions.criteria, desk.record.verdict.as_ref().map(|v| v.criteria.clone()));
    let verdict = taken.state.verdict.expect("judged");
    assert_eq!((verdict.automatic, verdict.decision()), (Decision::Reject, Decision::Rework));
    assert_eq!(verdict.overrides[0].reason, "because");
    assert_eq!(taken.state.decision, Some(Decision::Rework));
    let (_, rows) = desk.log.0.lock().expect("whole")[0].clone();
    assert_eq!(rows.row.decision, Some(Decision::Rework));
    assert_eq!((rows.row.automatic, rows.row.findings), (Some(Decision::Reject), Some(2)));
    // A person who saw that decides anew: no conflict.
    let later = desk.take(review(2, Subject::Part, 1, ReviewAction::Accept)).expect("taken");
    assert_eq!((later.state.conflicts, later.state.decision), (0, Some(Decision::Accept)));
}

#[test]
fn sending_again_is_harmless_and_another_body_is_refused() {
    let desk = desk();
    let first = desk.take(review(1, Subject::Part, 0, ReviewAction::Accept)).expect("taken");
    let again = desk.take(review(1, Subject::Part, 0, ReviewAction::Accept)).expect("known");
    assert_eq!((again.entry, again.is_known), (first.entry.clone(), true));
    assert_eq!(desk.log.last(), Ok(1));
    let other = desk.take(review(1, Subject::Part, 0, ReviewAction::Reject));
    assert_eq!(other, Err(ReviewError::Other(Box::new(first.entry))));
    // Another inspection's review of this name is another review.
    let mut elsewhere = desk.record.clone();
    elsewhere.id = InspectionId::new(9, &[9; 10]);
    let review = review(1, Subject::Part, 0, ReviewAction::Accept);
    let said = desk.desk.take(&elsewhere, None, review, Timestamp::UNIX_EPOCH);
    assert!(matches!(said, Err(ReviewError::Other(_))), "{said:?}");
}

#[test]
fn two_decisions_about_one_version_are_a_conflict_until_a_later_one_names_both() {
    let desk = desk();
    desk.take(review(1, Subject::Part, 0, ReviewAction::Accept)).expect("taken");
    let second = desk.take(review(2, Subject::Part, 0, ReviewAction::Rework)).expect("kept as well");
    let ids = |numbers: &[u128]| numbers.iter().map(|n| ReviewId(Uuid::from_u128(*n))).collect::<Vec<_>>();
    assert_eq!(second.entry.conflicts_with, ids(&[1]));
    assert_eq!(second.state.conflicts, 1);
    assert_eq!(second.state.decision, Some(Decision::Reject), "neither counts: what the criteria say");
    assert_eq!(second.state.subjects[0].conflict, ids(&[1, 2]));
    assert_eq!(second.state.subjects[0].decision, None);
    let lines = second.state.verdict.expect("judged").lines;
    assert!(lines.iter().any(|line| line.reason.contains("contradict") && line.reason.contains("rework")));
    // One that does not name them stands beside them; one that names one of them is refused.
    let third = desk.take(review(3, Subject::Part, 2, ReviewAction::Reject)).expect("kept as well");
    assert_eq!(third.entry.conflicts_with, ids(&[1, 2]));
    let partly = Review { resolves: ids(&[1, 2]), ..review(4, Subject::Part, 3, ReviewAction::Accept) };
    assert_eq!(desk.refused(partly.clone()), "resolves");
    let unknown = Review { resolves: ids(&[1, 2, 3, 8]), ..partly.clone() };
    assert_eq!(desk.refused(unknown), "resolves[3]");
    let all = desk.take(Review { resolves: ids(&[1, 2, 3]), ..partly }).expect("taken");
    assert!(all.entry.conflicts_with.is_empty());
    assert_eq!((all.state.conflicts, all.state.decision), (0, Some(Decision::Accept)));
    assert_eq!(desk.entries().len(), 4, "all are kept");
    // Somebody else settled the same meanwhile, without having seen that: both are kept, as always where two decide at once.
    let late = Review { resolves: ids(&[1, 2, 3]), ..review(14, Subject::Part, 3, ReviewAction::Reject) };
    let late = desk.take(late).expect("kept as well");
    assert_eq!((late.entry.conflicts_with, late.state.conflicts), (ids(&[4]), 1));
    let settled = Review { resolves: ids(&[4, 14]), ..review(15, Subject::Part, 5, ReviewAction::Accept) };
    let all = desk.take(settled).expect("settles both");
    assert_eq!((all.state.conflicts, all.state.decision), (0, Some(Decision::Accept)));
    // Decisions about different subjects, and remarks, are no conflict.
    for (number, subject) in [(5, gear()), (6, on(1)), (7, on(2))] {
        let taken = desk.take(review(number, subject, 0, ReviewAction::Accept)).expect("taken");
        assert_eq!(taken.state.conflicts, 0);
    }
    let remark = desk.take(review(8, Subject::Part, 0, ReviewAction::Comment)).expect("taken");
    assert_eq!((remark.state.conflicts, remark.state.decision), (0, Some(Decision::Accept)));
}

#[test]
fn a_decision_that_was_seen_is_followed_while_changes_of_the_class_contradict_each_other() {
    let desk = desk();
    let ids = |numbers: &[u128]| numbers.iter().map(|n| ReviewId(Uuid::from_u128(*n))).collect::<Vec<_>>();
    let class = |name: &str| ReviewAction::Reclassify { component: None, defect: Some(name.into()) };
    desk.take(review(1, on(1), 0, ReviewAction::Accept)).expect("taken");
    desk.take(review(2, on(1), 1, class("crack"))).expect("taken");
    let state = desk.take(review(3, on(1), 1, class("wear"))).expect("kept as well").state;
    assert_eq!(state.conflicts, 1);
    // A page names what contradicts itself: the changes of the class, not the decision that nothing contradicts.
    let next = Review { resolves: ids(&[2, 3]), ..review(4, on(1), 3, ReviewAction::Rework) };
    let next = desk.take(next).expect("follows the first");
    assert!(next.entry.conflicts_with.is_empty());
    let subject = next.state.subjects.iter().find(|subject| subject.subject == on(1)).expect("reviewed");
    assert_eq!((subject.decision, &subject.conflict), (Some(Decision::Rework), &ids(&[2, 3])));
}

#[test]
fn without_criteria_people_alone_decide() {
    let mut desk = desk();
    desk.record.verdict = None;
    assert_eq!(desk.desk.state(&desk.record, None).expect("reads").decision, None);
    let one = desk.take(review(1, Subject::Part, 0, ReviewAction::Accept)).expect("taken");
    assert_eq!((one.state.decision, one.state.verdict), (Some(Decision::Accept), None));
    let two = desk.take(review(2, Subject::Part, 0, ReviewAction::Accept)).expect("taken");
    assert_eq!(two.state.decision, Some(Decision::Person), "contradicted, although they agree: neither saw the other");
}

#[test]
fn decisions_about_findings_and_components_take_the_place_of_lines() {
    let desk = desk();
    // The line names the finding that is too large alone, or all: accepting every one of them accepts the part.
    desk.take(review(1, on(1), 0, ReviewAction::Accept)).expect("taken");
    let state = desk.take(review(2, on(2), 0, ReviewAction::Accept)).expect("taken").state;
    assert_eq!(state.decision, Some(Decision::Accept), "{:?}", state.verdict);
    assert!(state.verdict.expect("judged").overrides.is_empty());
    let state = desk.take(review(3, on(2), 2, ReviewAction::Rework)).expect("taken").state;
    assert_eq!(state.decision, Some(Decision::Rework));
    // No line speaks of the cap: what a person decides about it is a line of its own.
    let cap = Subject::Component { component: "cap".into() };
    let state = desk.take(review(4, cap, 0, ReviewAction::Reject)).expect("taken").state;
    assert_eq!(state.decision, Some(Decision::Reject));
    let lines = state.verdict.expect("judged").lines;
    assert!(lines.iter().any(|line| line.reason.contains("cap") && line.decision == Decision::Reject), "{lines:?}");
}

#[test]
fn a_finding_of_another_class_is_judged_as_what_it_is() {
    let desk = desk();
    let crack = ReviewAction::Reclassify { component: None, defect: Some("crack".into()) };
    let state = desk.take(review(1, on(2), 0, crack.clone())).expect("taken").state;
    let changed = state.findings.expect("looked")[1].clone();
    assert_eq!(changed.kind.defect().map(|d| (d.class, d.name.as_str())), Some(CRACK));
    assert!(!state.is_verdict_outdated);
    let cracks = |verdict: &semascan_model::verdict::Verdict| {
        let lines = verdict.lines.iter().filter(|l| l.defect.as_ref().is_some_and(|d| d.name == "crack"));
        lines.map(|l| l.decision).fold(Decision::Accept, Decision::with)
    };
    assert_eq!(cracks(&state.verdict.expect("judged")), Decision::Reject, "no crack is allowed");
    // The large one is no defect at all: what is left is the crack.
    let nothing = ReviewAction::Reclassify { component: None, defect: None };
    let state = desk.take(review(2, on(1), 0, nothing)).expect("taken").state;
    assert_eq!((state.found_in_error, state.findings.map(|list| list.len())), (vec![finding(1)], Some(1)));
    // Two changes of one version contradict each other: the finding stays what was measured.
    let wear = ReviewAction::Reclassify { component: Some("cap".into()), defect: Some("wear".into()) };
    let state = desk.take(review(3, on(2), 0, wear)).expect("kept").state;
    let kept = state.findings.expect("looked")[0].clone();
    assert_eq!((kept.component.name.as_str(), kept.kind.defect().map(|d| d.name.as_str())), ("gear", Some("wear")));
    assert_eq!(state.conflicts, 1);
    // Without the criteria the lines are those of the measured findings, and that is said.
    let without = desk.desk.state(&desk.record, None).expect("reads");
    assert!(without.is_verdict_outdated);
}

#[test]
fn a_drawn_finding_has_its_outline_and_no_figure_that_nobody_measured() {
    let desk = desk();
    let outline = SQUARE.to_vec();
    let action = ReviewAction::NewFinding { outline, component: "cap".into(), defect: Some("wear".into()) };
    let state = desk.take(review(1, Subject::Part, 0, action.clone())).expect("taken").state;
    let list = state.findings.expect("looked");
    let drawn = list.last().expect("there");
    assert!(matches!(&drawn.kind, FindingKind::Drawn { person, .. } if person == "A. Reviewer"));
    assert_eq!((drawn.area(), drawn.id), (None, state.drawn[0].finding));
    assert!((state.drawn[0].flat_area - 2e-4).abs() < 1e-12 && (state.drawn[0].perimeter - 0.06).abs() < 1e-12);
    // It is a subject like any other, and a person has to judge it.
    let subject = Subject::Finding { finding: drawn.id };
    let state = desk.take(review(2, subject, 0, ReviewAction::Accept)).expect("taken").state;
    assert_eq!(state.subjects.len(), 2);
    // Where nobody looked for defects, what a person drew is what there is.
    let mut blind = desk.record.clone();
    (blind.findings, blind.verdict) = (None, None);
    let log = desk.entries();
    assert_eq!(reviewed_state(&blind, &log, None).findings.map(|list| list.len()), Some(1));
    assert_eq!(reviewed_state(&blind, &[], None).findings, None);
}

#[test]
fn what_cannot_be_taken_in_is_refused_by_its_field() {
    let desk = desk();
    let accept = |subject: Subject| review(1, subject, 0, ReviewAction::Accept);
    let on_part = |action: ReviewAction| review(1, Subject::Part, 0, action);
    let relabel =
        |patch: SurfacePatch| on_part(ReviewAction::Relabel { patch, component: Some("gear".into()), defect: None });
    let points = |points: Vec<[f64; 3]>, radius: f64| relabel(SurfacePatch::Points { points, radius });
    let drawn =
        |outline: Vec<[f64; 3]>| on_part(ReviewAction::NewFinding { outline, component: "gear".into(), defect: None });
    let class = |component: Option<&str>, defect: Option<&str>| ReviewAction::Reclassify {
        component: component.map(str::to_owned),
        defect: defect.map(str::to_owned),
    };
    let part = || accept(Subject::Part);
    for (wrong, field) in [
        (Review { person: " ".into(), ..part() }, "person"),
        (Review { person: "A\u{1b}[31m".into(), ..part() }, "person"),
        (Review { person: "x".repeat(201), ..part() }, "person"),
        (Review { reason: "\n".into(), ..part() }, "reason"),
        (Review { reason: "x".repeat(10_001), ..part() }, "reason"),
        (Review { reason: "\u{7}".into(), ..part() }, "reason"),
        (Review { seen: 1, ..part() }, "seen"),
        (Review { resolves: vec![ReviewId(Uuid::nil())], ..part() }, "resolves[0]"),
        (Review { action: ReviewAction::Comment, resolves: vec![ReviewId(Uuid::nil())], ..part() }, "resolves"),
        (accept(Subject::Component { component: "none".into() }), "subject.component"),
        (accept(Subject::Component { component: "gaer".into() }), "subject.component"),
        (accept(on(9)), "subject.finding"),
        (on_part(class(None, Some("wear"))), "subject"),
        (review(1, on(1), 0, class(Some("gears"), None)), "action.component"),
        (review(1, on(1), 0, class(None, Some("dent"))), "action.defect"),
        (points(Vec::new(), 0.001), "action.patch.points"),
        (points(vec![[0.0; 3], [f64::NAN, 0.0, 0.0]], 0.001), "action.patch.points[1]"),
        (points(vec![[0.0; 3]; 20_001], 0.001), "action.patch.points"),
        (points(vec![[0.0; 3]], 0.0), "action.patch.radius"),
        (points(vec![[0.0; 3]], f64::INFINITY), "action.patch.radius"),
        (relabel(SurfacePatch::Voxels { edge: -1.0, cells: vec![[0; 3]] }), "action.patch.edge"),
        (relabel(SurfacePatch::Voxels { edge: 1.0, cells: vec![[0; 3], [i32::MAX; 3]] }), "action.patch.cells[1]"),
        (relabel(SurfacePatch::Outline { outline: SQUARE[..2].to_vec() }), "action.patch.outline"),
        (drawn(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), "action.outline"),
        (drawn(vec![[0.0; 3], [1.0, 0.0, 0.0], [2e9, 0.0, 0.0]]), "action.outline[2]"),
        (
            on_part(ReviewAction::Relabel {
                patch: SurfacePatch::Points { points: vec![[0.0; 3]], radius: 0.1 },
                component: None,
                defect: None,
            }),
            "action",
        ),
        (
            review(
                1,
                gear(),
                0,
                ReviewAction::NewFinding { outline: SQUARE.to_vec(), component: "cap".into(), defect: None },
            ),
            "action.component",
        ),
    ] {
        assert_eq!(desk.refused(wrong.clone()), field, "{wrong:?}");
    }
    let other = Review { model: Some("g0".into()), ..part() };
    assert_eq!(desk.take(other), Err(ReviewError::Model { now: "g1".into() }));
    let mut running = desk.record.clone();
    running.outcome = Outcome::Running;
    let said = desk.desk.take(&running, None, part(), Timestamp::UNIX_EPOCH);
    assert_eq!(said, Err(ReviewError::Running(running.id)));
    assert_eq!(desk.log.last(), Ok(0), "nothing was taken in");
    // What is right in all these fields is taken.
    let right = Review { model: Some("g1".into()), ..points(vec![[0.0; 3]], 0.001) };
    desk.take(right).expect("taken");
}

#[test]
fn surface_without_a_defect_is_said_to_have_none_though_the_record_lists_no_such_class() {
    let mut desk = desk();
    desk.record.components.retain(|class| class.class != 0);
    desk.record.defects.retain(|class| class.class != 0);
    let patch = SurfacePatch::Points { points: vec![[0.0; 3]], radius: 0.001 };
    let relabel = |number, component: Option<&str>, defect: Option<&str>| {
        let (component, defect) = (component.map(str::to_owned), defect.map(str::to_owned));
        let action = ReviewAction::Relabel { patch: patch.clone(), component, defect };
        review(number, Subject::Part, 0, action)
    };
    desk.take(relabel(1, None, Some("none"))).expect("taken");
    desk.take(relabel(2, Some("none"), None)).expect("taken");
    assert_eq!(desk.refused(relabel(3, None, Some("rust"))), "action.defect");
}

/// An action of every kind, in turn.
fn any_review(number: u128) -> Review {
    let some = |name: &str| Some(name.to_owned());
    let (subject, action) = match number % 7 {
        0 => (Subject::Part, ReviewAction::Comment),
        1 => (on(1), ReviewAction::Accept),
        2 => (on(2), ReviewAction::Reclassify { component: None, defect: some("crack") }),
        3 => (gear(), ReviewAction::Rework),
        4 => (Subject::Part, ReviewAction::Accept),
        5 => {
            let patch = SurfacePatch::Points { points: vec![[0.0; 3]], radius: 0.1 };
            (Subject::Part, ReviewAction::Relabel { patch, component: some("cap"), defect: None })
        }
        _ => {
            let action =
                ReviewAction::NewFinding { outline: SQUARE.to_vec(), component: "cap".into(), defect: some("wear") };
            (Subject::Part, action)
        }
    };
    // Each was decided by a person who saw all before it.
    review(number, subject, (number - 1) as u64, action)
}

#[test]
fn a_review_reads_as_many_entries_after_a_thousand_as_after_ten() {
    let desk = desk();
    let mut read = Vec::new();
    for number in 1..=1000 {
        let before = desk.log.1.load(Ordering::Relaxed);
        desk.take(any_review(number)).expect("taken");
        read.push(desk.log.1.load(Ordering::Relaxed) - before);
    }
    assert!(read[2..].iter().all(|entries| *entries == 1), "the last one, to see that it is still there: {read:?}");
    // What is held is what follows from the whole log.
    let before = desk.log.1.load(Ordering::Relaxed);
    let held = desk.desk.state(&desk.record, Some(&desk.criteria)).expect("reads");
    assert_eq!(desk.log.1.load(Ordering::Relaxed) - before, 1);
    assert_eq!(held, reviewed_state(&desk.record, &desk.entries(), Some(&desk.criteria)));
    // Findings are listed anew by those alone that change them.
    let log = desk.log.0.lock().expect("whole");
    assert!(log.iter().all(|(logged, result)| result.findings.is_some() == changes_findings(&logged.entry)));
}

#[test]
fn a_log_that_is_another_one_is_read_again_and_another_record_is_judged_again() {
    let mut desk = desk();
    (1..=20).for_each(|number| drop(desk.take(any_review(number)).expect("taken")));
    let mut log = desk.log.0.lock().expect("whole");
    let (last, _) = log.last_mut().expect("entries");
    (last.entry.review.action, last.hash) = (ReviewAction::Reject, "another".into());
    drop(log);
    let state = |desk: &Desk| desk.desk.state(&desk.record, Some(&desk.criteria)).expect("reads");
    assert_eq!(state(&desk), reviewed_state(&desk.record, &desk.entries(), Some(&desk.criteria)));
    // Entries that are gone are not held on to.
    desk.log.0.lock().expect("whole").truncate(5);
    assert_eq!(state(&desk), reviewed_state(&desk.record, &desk.entries(), Some(&desk.criteria)));
    desk.log.0.lock().expect("whole").clear();
    assert_eq!(state(&desk).sequence, 0);
    (1..=3).for_each(|number| drop(desk.take(any_review(number)).expect("taken")));
    // It was judged again meanwhile, and then has another model.
    desk.record.verdict.as_mut().expect("judged").automatic = Decision::Accept;
    assert_eq!(state(&desk), reviewed_state(&desk.record, &desk.entries(), Some(&desk.criteria)));
    desk.record.files = Some(FilesRecord { generation: "g2".into(), names: Vec::new() });
    desk.record.findings.as_mut().expect("looked").list.remove(0);
    assert_eq!(state(&desk), reviewed_state(&desk.record, &desk.entries(), Some(&desk.criteria)));
}

#[test]
fn what_contradicts_each_other_stays_so_few_that_one_review_settles_it() {
    let desk = desk();
    for number in 1..=rules::MOST_RESOLVED as u128 {
        desk.take(review(number, Subject::Part, 0, ReviewAction::Accept)).expect("taken");
    }
    let more = review(500, Subject::Part, 0, ReviewAction::Reject);
    assert_eq!(desk.refused(more.clone()), "resolves");
    let resolves = (1..=rules::MOST_RESOLVED as u128).map(|number| ReviewId(Uuid::from_u128(number))).collect();
    let settled = desk.take(Review { resolves, ..more }).expect("settles all of them").state;
    assert_eq!((settled.conflicts, settled.decision), (0, Some(Decision::Reject)));
}

/// A distance of 50 mm.
fn measured() -> MeasurementRecord {
    let point = |position: [f64; 3]| MeasuredFeature {
        kind: FeatureKind::Point,
        picked: position,
        position,
        direction: None,
        radius: None,
        fit: None,
    };
    MeasurementRecord {
        kind: MeasurementKind::Distance,
        figure: Some(Quantity { value: 0.05, expanded: Some(1e-3) }),
        along_axes: None,
        features: vec![point([0.0; 3]), point([0.05, 0.0, 0.0])],
        voxel: 1.4e-3,
        place: [0.025, 0.0, 0.0],
        lines: vec![[[0.0; 3], [0.05, 0.0, 0.0]]],
    }
}

fn keep(number: u128, measurement: MeasurementRecord) -> Review {
    let action = ReviewAction::Measure { measurement: Box::new(measurement) };
    Review { reason: String::new(), ..review(number, Subject::Part, 0, action) }
}

#[test]
fn measurements_stand_until_one_is_withdrawn_and_decide_nothing() {
    let mut desk = desk();
    let before = desk.desk.state(&desk.record, Some(&desk.criteria)).expect("reads");
    desk.take(keep(1, measured())).expect("taken");
    let state = desk.take(keep(2, measured())).expect("taken").state;
    assert_eq!((state.decision, state.conflicts, &state.findings), (before.decision, 0, &before.findings));
    let names =
        |state: &ReviewedState| state.measurements.iter().map(|kept| kept.review.0.as_u128()).collect::<Vec<_>>();
    assert_eq!((names(&state), state.measurements[0].is_of_earlier_model), (vec![1, 2], false));
    assert_eq!(state.measurements[0].measurement, measured());
    let withdraw = |n: u128| ReviewAction::Withdraw { review: ReviewId(Uuid::from_u128(n)) };
    assert_eq!(desk.refused(review(3, Subject::Part, 2, withdraw(9))), "action.review");
    let unsaid = Review { reason: String::new(), ..review(3, Subject::Part, 2, withdraw(1)) };
    assert_eq!(desk.refused(unsaid), "reason");
    let state = desk.take(review(3, Subject::Part, 2, withdraw(1))).expect("taken").state;
    assert_eq!(names(&state), [2]);
    assert_eq!(desk.refused(review(4, Subject::Part, 3, withdraw(1))), "action.review");
    // They are of the model that was measured.
    desk.record.files = Some(FilesRecord { generation: "g2".into(), names: Vec::new() });
    let state = desk.desk.state(&desk.record, Some(&desk.criteria)).expect("reads");
    assert!(state.measurements[0].is_of_earlier_model);
    assert_eq!(state, reviewed_state(&desk.record, &desk.entries(), Some(&desk.criteria)));
}

#[test]
fn a_measurement_that_cannot_be_is_refused_by_its_field() {
    let desk = desk();
    let refused = |change: &dyn Fn(&mut MeasurementRecord)| {
        let mut measurement = measured();
        change(&mut measurement);
        desk.refused(keep(1, measurement))
    };
    assert_eq!(refused(&|m| m.figure = None), "action.measurement.figure");
    assert_eq!(refused(&|m| m.kind = MeasurementKind::Plane), "action.measurement.figure");
    assert_eq!(refused(&|m| m.figure = Some(Quantity::without_uncertainty(f64::NAN))), "action.measurement.figure");
    assert_eq!(
        refused(&|m| m.figure = Some(Quantity { value: 1.0, expanded: Some(-1.0) })),
        "action.measurement.figure"
    );
    let infinite = [Quantity::without_uncertainty(f64::INFINITY); 3];
    assert_eq!(refused(&|m| m.along_axes = Some(infinite)), "action.measurement.along_axes");
    assert_eq!(refused(&|m| m.features.clear()), "action.measurement.features");
    assert_eq!(refused(&|m| m.features[1].position[2] = 1e9), "action.measurement.features[1].position[0]");
    assert_eq!(
        refused(&|m| m.features[0].direction = Some([2.0, 0.0, 0.0])),
        "action.measurement.features[0].direction"
    );
    assert_eq!(refused(&|m| m.features[0].radius = Some(0.0)), "action.measurement.features[0].radius");
    assert_eq!(refused(&|m| m.features[1].kind = FeatureKind::Plane), "action.measurement.features[1].fit");
    assert_eq!(refused(&|m| m.voxel = f64::INFINITY), "action.measurement.voxel");
    assert_eq!(refused(&|m| m.lines[0][1][0] = f64::NAN), "action.measurement.lines[1]");
    assert_eq!(refused(&|m| m.lines = vec![[[0.0; 3]; 2]; 20_001]), "action.measurement.lines");
    let action = ReviewAction::Measure { measurement: Box::new(measured()) };
    assert_eq!(desk.refused(review(1, gear(), 0, action)), "subject");
}
