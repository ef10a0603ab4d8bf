//! Measurements that are kept with the inspection: made of those in the list, and read as the agent gives them.

use super::measurement::in_words;
use super::{Kind, Measurement, Picking, Taken};
use semascan_geometry::fit::Element;
use semascan_geometry::measure::dimensions::Estimate;
use semascan_model::LengthUnit;
use semascan_model::finding::Quantity;
use semascan_model::measurement::{FeatureKind, FitRecord, KeptMeasurement, MeasuredFeature, MeasurementRecord};
use serde::Deserialize;

/// Most lines that show one; beyond them the figure stands alone.
const MOST_LINES: usize = 20_000;
/// Places are sent to the micrometre: with all digits a long edge would be more than the agent takes.
const PLACES: f64 = 1e6;

/// The answer of `/inspections/{inspection}/measurements`, as far as it is used.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct MeasurementsAnswer {
    /// The measurements.
    pub items: Vec<KeptMeasurement>,
}

/// A measurement as it is kept; `None` where it has no place.
pub fn record(measurement: &Measurement) -> Option<MeasurementRecord> {
    let quantity = |estimate: Estimate| Quantity::with_standard(estimate.value, estimate.standard_uncertainty);
    let lines = measurement.whole_lines();
    let lines = if lines.len() > MOST_LINES { Vec::new() } else { lines };
    Some(MeasurementRecord {
        kind: measurement.kind,
        figure: measurement.estimate().map(quantity),
        along_axes: measurement.along_axes().map(|axes| axes.map(quantity)),
        features: measurement.taken.iter().map(feature).collect(),
        voxel: measurement.voxel(),
        place: rounded(measurement.place()?),
        lines: lines.into_iter().map(|line| line.map(rounded)).collect(),
    })
}

fn feature(taken: &Taken) -> MeasuredFeature {
    let fit = taken.fit();
    MeasuredFeature {
        kind: fit.map_or(FeatureKind::Point, |fit| match fit.element {
            Element::Plane(_) => FeatureKind::Plane,
            Element::Cylinder(_) => FeatureKind::Cylinder,
            Element::Sphere(_) => FeatureKind::Sphere,
            Element::Circle(_) => FeatureKind::Circle,
        }),
        picked: rounded(taken.place),
        position: taken.feature.middle().into(),
        direction: taken.feature.direction().map(Into::into),
        radius: fit.and_then(|fit| fit.element.radius()),
        fit: fit.map(|fit| FitRecord {
            rms: fit.rms,
            largest: fit.largest,
            used: fit.used as u64,
            left_out: fit.left_out as u64,
        }),
    }
}

fn rounded(place: [f32; 3]) -> [f64; 3] {
    place.map(|c| (f64::from(c) * PLACES).round() / PLACES)
}

/// The figure of a kept measurement with its uncertainty, or its kind where it has none.
pub fn value_and_uncertainty(record: &MeasurementRecord, unit: LengthUnit) -> String {
    match record.figure {
        Some(Quantity { value, expanded }) => in_words(record.kind, value, expanded, unit).1,
        None => record.kind.name().into(),
    }
}

/// The same without its uncertainty.
pub fn value(record: &MeasurementRecord, unit: LengthUnit) -> String {
    match record.figure {
        Some(Quantity { value, expanded }) => in_words(record.kind, value, expanded, unit).0,
        None => record.kind.name().into(),
    }
}

/// Kinds whose figure says by itself what it is.
pub fn is_plain(kind: Kind) -> bool {
    kind == Kind::Distance
}

#[cfg(test)]
mod tests {
    use super::super::measurement::tests::{cylinder, measured, measurement, plane};
    use super::*;

    #[test]
    fn a_measurement_is_kept_with_its_figures_and_what_it_was_taken_from() {
        let way = measurement(1, Kind::Distance, &[[0.0; 3], [0.03, -0.04, 0.0]]);
        let kept = record(&way).expect("a place");
        let figure = kept.figure.expect("a distance");
        assert!((figure.value - 0.05).abs() < 1e-7 && figure.expanded.is_some_and(|u| (1.0e-3..1.3e-3).contains(&u)));
        assert_eq!(
            value_and_uncertainty(&kept, LengthUnit::Millimetres),
            way.value_and_uncertainty(LengthUnit::Millimetres)
        );
        assert_eq!(kept.features.iter().map(|f| f.kind).collect::<Vec<_>>(), [FeatureKind::Point; 2]);
        assert_eq!(kept.lines, [[[0.0; 3], [0.03, -0.04, 0.0]]]);
        let bore = record(&measured(2, Kind::Cylinder, vec![cylinder(0.0, None)])).expect("a place");
        assert_eq!(bore.features[0].fit.map(|fit| (fit.used, fit.left_out)), Some((812, 14)));
        assert_eq!((bore.features[0].radius, bore.features[0].direction), (Some(0.012), Some([0.0, 0.0, 1.0])));
        assert_eq!(value(&bore, LengthUnit::Inches), "R\u{a0}0.47244\u{a0}inch");
        let flat = record(&measured(3, Kind::Plane, vec![plane(0.0, None)])).expect("a place");
        assert_eq!((flat.figure, value(&flat, LengthUnit::Millimetres).as_str()), (None, "Plane"));
    }

    #[test]
    fn what_shows_elements_of_the_list_is_kept_with_the_figure_between_them() {
        let between = measured(3, Kind::Distance, vec![cylinder(0.0, Some(1)), cylinder(0.05, Some(2))]);
        assert_eq!((between.lines().len(), record(&between).expect("a place").lines.len()), (1, 3));
        let meets = measured(6, Kind::Distance, vec![plane(0.0, Some(4)), cylinder(0.0, Some(1))]);
        assert_eq!(record(&meets), None);
    }
}
