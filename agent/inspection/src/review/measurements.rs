//! Measurements that people keep: which can be taken in, and which stand.

use super::rules::{FARTHEST, FieldError, check_points, fail};
use super::standing::Standings;
use semascan_model::finding::Quantity;
use semascan_model::measurement::{FeatureKind, KeptMeasurement, MeasurementKind, MeasurementRecord};
use semascan_model::review::{Review, ReviewAction, ReviewId, Subject};

/// Lines that may show one: the edge of a large area.
const MOST_LINES: usize = 20_000;
/// Measurements that an inspection may have.
const MOST: usize = 1000;

/// Checks a measurement that is to be kept.
pub(super) fn check(review: &Review, measurement: &MeasurementRecord, standings: &Standings) -> Result<(), FieldError> {
    if review.subject != Subject::Part {
        return fail("subject", "a measurement is of the part");
    }
    if standings.measured.len() >= MOST {
        return fail("action.measurement", format!("{MOST} are kept, and no more are taken"));
    }
    let MeasurementRecord { kind, figure, along_axes, features, voxel, place, lines } = measurement;
    let field = |name: &str| format!("action.measurement.{name}");
    let has_figure = *kind != MeasurementKind::Plane;
    if figure.is_some() != has_figure {
        let reason = if has_figure { "has no figure" } else { "has a figure, and a plane has none" };
        return fail(field("figure"), reason);
    }
    figure.iter().try_for_each(|quantity| check_quantity(&field("figure"), *quantity))?;
    along_axes.iter().flatten().try_for_each(|quantity| check_quantity(&field("along_axes"), *quantity))?;
    if !(1..=3).contains(&features.len()) {
        return fail(field("features"), format!("has {} entries, and 1 to 3 are taken", features.len()));
    }
    for (index, feature) in features.iter().enumerate() {
        let field = |name: &str| format!("action.measurement.features[{index}].{name}");
        check_points(&field("position"), &[feature.position])?;
        check_points(&field("picked"), &[feature.picked])?;
        let length = feature.direction.map(|direction| direction.iter().map(|c| c * c).sum::<f64>().sqrt());
        if length.is_some_and(|length| !(0.999..=1.001).contains(&length)) {
            return fail(field("direction"), "has not the length 1");
        }
        if feature.radius.is_some_and(|radius| !is_length(radius)) {
            return fail(field("radius"), "is no number of metres above 0");
        }
        if feature.fit.is_some() != (feature.kind != FeatureKind::Point) {
            return fail(field("fit"), "is said of elements, and of these always");
        }
        if feature
            .fit
            .is_some_and(|fit| !(0.0..=FARTHEST).contains(&fit.rms) || !(0.0..=FARTHEST).contains(&fit.largest))
        {
            return fail(field("fit"), "has residuals that are no lengths");
        }
    }
    if !is_length(*voxel) {
        return fail(field("voxel"), format!("{voxel} is no number of metres above 0"));
    }
    check_points(&field("place"), &[*place])?;
    if lines.len() > MOST_LINES {
        return fail(field("lines"), format!("has {} entries, and {MOST_LINES} are taken", lines.len()));
    }
    check_points(&field("lines"), lines.as_flattened())
}

/// Checks that there is a measurement to withdraw.
pub(super) fn check_withdrawn(review: ReviewId, standings: &Standings) -> Result<(), FieldError> {
    if standings.measured.iter().any(|entry| entry.review.id == review) {
        return Ok(());
    }
    fail("action.review", format!("no measurement {review} is kept"))
}

/// The measurements that stand; `generation` is that of the model.
pub(super) fn kept(standings: &Standings, generation: Option<&str>) -> Vec<KeptMeasurement> {
    let measured = standings.measured.iter().filter_map(|entry| {
        let ReviewAction::Measure { measurement } = &entry.review.action else { return None };
        Some(KeptMeasurement {
            review: entry.review.id,
            person: entry.review.person.clone(),
            at: entry.at,
            note: entry.review.reason.clone(),
            is_of_earlier_model: entry.versions.model.as_deref() != generation,
            measurement: measurement.as_ref().clone(),
        })
    });
    measured.collect()
}

fn is_length(length: f64) -> bool {
    length > 0.0 && length <= FARTHEST
}

fn check_quantity(field: &str, quantity: Quantity) -> Result<(), FieldError> {
    // An area may be larger than a length, and is none that a part has.
    let most = FARTHEST * FARTHEST;
    let is_number = quantity.value.abs() <= most && quantity.expanded.is_none_or(|u| (0.0..=most).contains(&u));
    if is_number { Ok(()) } else { fail(field, "is no figure with an uncertainty from 0 on") }
}
