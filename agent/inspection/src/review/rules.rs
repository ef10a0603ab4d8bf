//! Which reviews can be taken in: everything that is wrong with one is refused by the name of its field.

use super::measurements;
use super::standing::Standings;
use semascan_model::choice::possible_instead;
use semascan_model::finding::{Finding, FindingKind};
use semascan_model::record::{ClassSummary, InspectionRecord};
use semascan_model::review::{Review, ReviewAction, ReviewId, Subject, SurfacePatch};

/// Letters that a name of a person may have.
const LONGEST_NAME: usize = 200;
/// Bytes that a reason may have.
const LONGEST_REASON: usize = 10_000;
/// Points that an outline or a patch may have, and cells.
const MOST_POINTS: usize = 20_000;
/// Reviews that one may settle, and that may contradict each other about one subject.
pub(super) const MOST_RESOLVED: usize = 100;
/// Farthest coordinate of a point in the table frame, metres.
pub(super) const FARTHEST: f64 = 1e3;
/// Least area of an outline, as a share of its squared length: below that it is a line.
const LEAST_SHAPE: f64 = 1e-4;

/// A field that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct FieldError {
    /// The field, as a path: `action.patch.radius`.
    pub field: String,
    /// Why not.
    pub reason: String,
}

pub(super) fn fail<T>(field: impl Into<String>, reason: impl Into<String>) -> Result<T, FieldError> {
    Err(FieldError { field: field.into(), reason: reason.into() })
}

/// Checks `review` against the record of its inspection, its `findings` as they stand and the reviews that stand; `last` is
/// the place of the last entry of the log.
pub(super) fn check(
    review: &Review,
    record: &InspectionRecord,
    findings: &[&Finding],
    standings: &Standings,
    last: u64,
) -> Result<(), FieldError> {
    check_words(review)?;
    if review.seen > last {
        return fail("seen", format!("is {}, and the log ends with {last}", review.seen));
    }
    let finding = check_subject(&review.subject, record, findings)?;
    let on_finding = |action: &str| match finding {
        Some(finding) => Ok(finding),
        None => fail("subject", format!("{action} is about a finding")),
    };
    match &review.action {
        ReviewAction::Accept | ReviewAction::Reject | ReviewAction::Rework | ReviewAction::Comment => {}
        ReviewAction::Reclassify { component, defect } => {
            let finding = on_finding("reclassify")?;
            check_class("action.component", component.as_deref(), &record.components, false)?;
            check_class("action.defect", defect.as_deref(), &record.defects, true)?;
            let has_class = matches!(finding.kind, FindingKind::Defect { .. } | FindingKind::Drawn { .. });
            if !has_class && (component.is_some() || defect.is_some()) {
                let reason =
                    format!("a finding of {} has no class; leave both out where it is an error", finding.kind.name());
                return fail("action", reason);
            }
        }
        ReviewAction::Relabel { patch, component, defect } => {
            if finding.is_some() {
                return fail("subject", "relabel is about the part or a component, whose surface the patch lies on");
            }
            check_class("action.component", component.as_deref(), &record.components, true)?;
            check_class("action.defect", defect.as_deref(), &record.defects, true)?;
            if component.is_none() && defect.is_none() {
                return fail("action", "names neither a component nor a defect");
            }
            check_patch(patch)?;
        }
        ReviewAction::NewFinding { outline, component, defect } => {
            if finding.is_some() {
                return fail("subject", "new_finding is about the part or a component");
            }
            if let Subject::Component { component: subject } = &review.subject
                && subject != component
            {
                return fail("action.component", format!("is not {subject}, which the review is about"));
            }
            check_class("action.component", Some(component), &record.components, false)?;
            check_class("action.defect", defect.as_deref(), &record.defects, false)?;
            check_outline("action.outline", outline)?;
        }
        ReviewAction::Measure { measurement } => measurements::check(review, measurement, standings)?,
        ReviewAction::Withdraw { review } => measurements::check_withdrawn(*review, standings)?,
    }
    check_resolved(review, standings)
}

fn check_words(review: &Review) -> Result<(), FieldError> {
    let Review { person, reason, action, .. } = review;
    if person.trim().is_empty() {
        return fail("person", "nobody is named");
    }
    if person.chars().count() > LONGEST_NAME || person.chars().any(char::is_control) {
        return fail("person", format!("is no name of at most {LONGEST_NAME} letters"));
    }
    if reason.len() > LONGEST_REASON {
        return fail("reason", format!("has {} bytes, and {LONGEST_REASON} are taken", reason.len()));
    }
    if reason.chars().any(|c| c.is_control() && !matches!(c, '\n' | '\t')) {
        return fail("reason", "holds control characters");
    }
    let says_enough =
        matches!(action, ReviewAction::Relabel { .. } | ReviewAction::NewFinding { .. } | ReviewAction::Measure { .. });
    if !says_enough && reason.trim().is_empty() {
        return fail("reason", format!("none is given, and {} needs one", action.name()));
    }
    Ok(())
}

/// Whether there is such a subject; the finding, where it is one.
fn check_subject<'a>(
    subject: &Subject,
    record: &InspectionRecord,
    findings: &[&'a Finding],
) -> Result<Option<&'a Finding>, FieldError> {
    match subject {
        Subject::Part => Ok(None),
        Subject::Component { component } => {
            check_class("subject.component", Some(component), &record.components, false)?;
            Ok(None)
        }
        Subject::Finding { finding } => match findings.iter().copied().find(|one| one.id == *finding) {
            Some(found) => Ok(Some(found)),
            None => fail("subject.finding", format!("the inspection has no finding {finding}")),
        },
    }
}

/// Whether there is such a class; class 0 (none) counts where `with_none`.
fn check_class(field: &str, name: Option<&str>, classes: &[ClassSummary], with_none: bool) -> Result<(), FieldError> {
    let Some(name) = name else { return Ok(()) };
    // A record lists the classes that there are: none is not always among them.
    let mut known: Vec<&str> = classes.iter().filter(|c| c.class != 0).map(|c| c.name.as_str()).collect();
    if with_none {
        known.insert(0, "none");
    }
    if known.contains(&name) {
        return Ok(());
    }
    fail(field, format!("the inspection knows no {name:?}; {}", possible_instead(name, &known)))
}

fn check_patch(patch: &SurfacePatch) -> Result<(), FieldError> {
    let is_length = |length: f64| length.is_finite() && length > 0.0 && length <= FARTHEST;
    match patch {
        SurfacePatch::Points { points, radius } => {
            if !is_length(*radius) {
                return fail("action.patch.radius", format!("{radius} is no number of metres above 0"));
            }
            check_count("action.patch.points", points.len(), 1)?;
            check_points("action.patch.points", points)
        }
        SurfacePatch::Voxels { edge, cells } => {
            if !is_length(*edge) {
                return fail("action.patch.edge", format!("{edge} is no number of metres above 0"));
            }
            check_count("action.patch.cells", cells.len(), 1)?;
            let far = |cell: &[i32; 3]| cell.iter().any(|c| (f64::from(*c) * edge).abs() > FARTHEST);
            match cells.iter().position(far) {
                Some(place) => {
                    fail(format!("action.patch.cells[{place}]"), format!("lies farther away than {FARTHEST} m"))
                }
                None => Ok(()),
            }
        }
        SurfacePatch::Outline { outline } => check_outline("action.patch.outline", outline),
    }
}

pub(super) fn check_outline(field: &str, outline: &[[f64; 3]]) -> Result<(), FieldError> {
    check_count(field, outline.len(), 3)?;
    check_points(field, outline)?;
    let (area, perimeter) = flat_figures(outline);
    if area <= LEAST_SHAPE * perimeter * perimeter {
        return fail(field, "encloses nothing: its points lie on a line, or it crosses itself");
    }
    Ok(())
}

fn check_count(field: &str, count: usize, least: usize) -> Result<(), FieldError> {
    if (least..=MOST_POINTS).contains(&count) {
        return Ok(());
    }
    fail(field, format!("has {count} entries, and {least} to {MOST_POINTS} are taken"))
}

pub(super) fn check_points(field: &str, points: &[[f64; 3]]) -> Result<(), FieldError> {
    match points.iter().position(|p| p.iter().any(|c| !(c.is_finite() && c.abs() <= FARTHEST))) {
        Some(place) => fail(format!("{field}[{place}]"), format!("is no point within {FARTHEST} m")),
        None => Ok(()),
    }
}

/// Area of a closed curve seen along its mean normal (half the length of the sum of its cross products), and its length.
pub(super) fn flat_figures(outline: &[[f64; 3]]) -> (f64, f64) {
    use nalgebra::Vector3;
    let Some(first) = outline.first().copied().map(Vector3::from) else { return (0.0, 0.0) };
    let (mut normal, mut perimeter) = (Vector3::zeros(), 0.0);
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let (a, b) = (Vector3::from(*a) - first, Vector3::from(*b) - first);
        normal += a.cross(&b);
        perimeter += (b - a).norm();
    }
    (0.5 * normal.norm(), perimeter)
}

/// Reviews that are settled must stand about the same subject, and be of the same kind, as far as the person could know.
fn check_resolved(review: &Review, standings: &Standings) -> Result<(), FieldError> {
    let contradicted =
        standings.of_subject(&review.subject).map_or(0, |standing| standing.contradicted_by(review).len());
    // One more could not be settled by one review any more.
    if contradicted >= MOST_RESOLVED {
        let reason =
            format!("{contradicted} reviews about {} contradict each other: settle them first", review.subject);
        return fail("resolves", reason);
    }
    if review.resolves.is_empty() {
        return Ok(());
    }
    if review.resolves.len() > MOST_RESOLVED {
        return fail("resolves", format!("names {} reviews, and {MOST_RESOLVED} are taken", review.resolves.len()));
    }
    let decides = review.action.decision().is_some() || matches!(review.action, ReviewAction::Reclassify { .. });
    if !decides {
        return fail("resolves", format!("{} settles nothing", review.action.name()));
    }
    let standing = standings.of_subject(&review.subject).and_then(|standing| standing.of_kind(&review.action));
    let standing = standing.unwrap_or_default();
    // What came after the person looked may have settled these already: then this one stands beside that. Nothing that a person
    // decided is lost because it came late.
    if standing.iter().any(|entry| entry.sequence > review.seen) {
        return Ok(());
    }
    let standing: Vec<_> = standing.iter().map(|entry| entry.review.id).collect();
    // A page names all that contradicts itself about a subject, decisions and changes of the class: each settles its own kind.
    let stands = |id: &ReviewId| {
        let of_subject = standings.of_subject(&review.subject);
        of_subject.is_some_and(|of| of.decisions.iter().chain(&of.changes).any(|entry| entry.review.id == *id))
    };
    if let Some(place) = review.resolves.iter().position(|id| !stands(id)) {
        let reason = format!("is no review that stands about {}", review.subject);
        return fail(format!("resolves[{place}]"), reason);
    }
    // One that nothing contradicts is followed by this one without being named.
    let left = standing.iter().filter(|_| standing.len() > 1).find(|id| !review.resolves.contains(id));
    if let Some(left) = left {
        return fail("resolves", format!("leaves out {left}, which stands about {} too", review.subject));
    }
    Ok(())
}
