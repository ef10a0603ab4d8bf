//! A picked point in words and figures, as card, labels and screen readers have it.

use super::PickedPoint;
use crate::state::AppState;
use crate::state::units;
use crate::words::{decimal, signed, t};

/// Name of the component; what has none is unlabelled.
pub fn component(state: &AppState, point: &PickedPoint) -> String {
    match state.legend.rows.get(usize::from(point.component)) {
        Some(row) if point.component != 0 => row.class.name.clone(),
        None if point.component != 0 => t!("common.class", number = point.component),
        _ => t!("common.unlabelled").into(),
    }
}

/// Name of the defect with its share; `None` where the surface is sound or nobody looks for defects.
pub fn defect(state: &AppState, point: &PickedPoint) -> Option<String> {
    let name = match state.legend.defects.get(usize::from(point.defect)) {
        _ if point.defect == 0 => return None,
        Some(class) => class.name.clone(),
        None => t!("common.class", number = point.defect),
    };
    Some(format!("{name}, {}", units::percent(point.defect_confidence.into())))
}

/// The defect, or why there is none.
pub fn defect_or_none(state: &AppState, point: &PickedPoint) -> String {
    defect(state, point).unwrap_or_else(|| match state.legend.defects.len() {
        0 | 1 => t!("inspect.not_looked_for").into(),
        _ => t!("inspect.no_defect").into(),
    })
}

/// The confidence in the component.
pub fn confidence(point: &PickedPoint) -> String {
    point.confidence.map_or_else(|| t!("common.not_known").into(), |share| units::percent(share.into()))
}

/// The uncertainty of the component.
pub fn sigma(point: &PickedPoint) -> String {
    point.sigma.map_or_else(|| t!("common.not_known").into(), |sigma| decimal(sigma, 3))
}

/// A coordinate in metres as signed millimetres.
pub fn millimetres(metres: f32) -> String {
    decimal(f64::from(metres) * 1e3, 2)
}

/// A deviation in metres as millimetres with its sign.
pub fn deviation(metres: f32) -> String {
    format!("{}\u{a0}mm", signed(f64::from(metres) * 1e3, 3))
}

/// The whole in a sentence, for a screen reader.
pub fn sentence(state: &AppState, point: &PickedPoint) -> String {
    let [x, y, z] = point.position.map(millimetres);
    let defect = defect(state, point).map(|defect| t!("inspect.spoken.defect", defect)).unwrap_or_default();
    let component = units::sentence(&component(state, point));
    let component = component.trim_end_matches('.');
    t!("inspect.spoken", component, confidence = confidence(point), defect, x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::LinkEvent;
    use crate::state::Event;
    use semascan_model::{SemanticPoint, Taxonomy};
    use semascan_protocol::Inspection;

    fn state(defects: &[&str]) -> AppState {
        let mut inspection = Inspection::default();
        inspection.set_taxonomy(&Taxonomy::from_names(&["housing", "pinion"], defects));
        let mut state = AppState::default();
        state.reduce(&Event::from(LinkEvent::Cleared(inspection)));
        state
    }

    fn point(label: u16, defect: u16) -> PickedPoint {
        let point = SemanticPoint {
            position: [0.012_345, -0.1, 0.0],
            label,
            confidence: 0.876,
            defect,
            defect_confidence: 0.5,
            sigma: 0.0321,
            ..SemanticPoint::UNKNOWN
        };
        PickedPoint::of(&point, 1e-3, true)
    }

    #[test]
    fn classes_are_named_and_what_is_not_known_is_said() {
        let (bare, full) = (state(&[]), state(&["rust"]));
        assert_eq!(
            (component(&full, &point(2, 0)), component(&full, &point(0, 0))),
            ("pinion".into(), "unlabelled".into())
        );
        assert_eq!(component(&full, &point(9, 0)), "class 9");
        assert_eq!(defect_or_none(&full, &point(1, 1)), "rust, 50\u{a0}%");
        assert_eq!(
            (defect_or_none(&full, &point(1, 0)), defect_or_none(&bare, &point(1, 0))),
            ("none".into(), "not looked for".into())
        );
        assert_eq!((confidence(&point(1, 0)), sigma(&point(1, 0))), ("88\u{a0}%".into(), "0.032".into()));
        assert_eq!((confidence(&point(0, 0)), sigma(&point(0, 0))), ("not known".into(), "not known".into()));
    }

    #[test]
    fn places_are_in_millimetres() {
        assert_eq!((millimetres(0.012_345), millimetres(-0.1)), ("12.35".into(), "\u{2212}100.00".into()));
        assert_eq!((deviation(1.5e-4), deviation(-2e-3)), ("+0.150\u{a0}mm".into(), "\u{2212}2.000\u{a0}mm".into()));
        assert_eq!(
            sentence(&state(&["rust"]), &point(1, 1)),
            "Housing, confidence 88\u{a0}%. Defect rust, 50\u{a0}%. x 12.35, y \u{2212}100.00, z 0.00 millimetres."
        );
    }
}
