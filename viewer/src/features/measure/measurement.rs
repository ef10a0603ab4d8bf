//! One measurement: its points, its figures with their uncertainties, and how these are written.

use semascan_geometry::measure::dimensions::{self, Estimate};
use semascan_model::LengthUnit;

/// Minus is a sign, not a hyphen.
const MINUS: &str = "\u{2212}";

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The distance of two points, straight and along each axis.
    Distance,
    /// The angle of three points; the second is its vertex.
    Angle,
}

impl Kind {
    /// Every kind, in the order of the panel.
    pub const ALL: [Self; 2] = [Self::Distance, Self::Angle];

    /// Stable name for tests and files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::Angle => "angle",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Distance => "Distance",
            Self::Angle => "Angle",
        }
    }

    /// How many points it takes.
    pub fn points(self) -> usize {
        match self {
            Self::Distance => 2,
            Self::Angle => 3,
        }
    }
}

/// One measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Its number, for people and for [`super::MeasureEvent::Remove`].
    pub number: u32,
    /// What was measured.
    pub kind: Kind,
    /// Its points in order, [`Kind::points`] of them; metres, table frame.
    pub points: Vec<[f32; 3]>,
    /// Voxel edge of the model that they lie on, metres.
    pub voxel: f32,
    /// Whether the model has changed since.
    pub outdated: bool,
}

impl Measurement {
    /// The figure: metres or radians. `None` for an angle without an opening, or without its points.
    pub fn estimate(&self) -> Option<Estimate> {
        let u = dimensions::grid_uncertainty(self.voxel.into());
        match (self.kind, self.positions().as_slice()) {
            (Kind::Distance, [a, b]) => Some(dimensions::distance(*a, *b, u)),
            (Kind::Angle, [a, vertex, b]) => dimensions::angle(*a, *vertex, *b, u),
            _ => None,
        }
    }

    /// Of a distance the way along each axis, metres.
    pub fn along_axes(&self) -> Option<[Estimate; 3]> {
        let u = dimensions::grid_uncertainty(self.voxel.into());
        match (self.kind, self.positions().as_slice()) {
            (Kind::Distance, [a, b]) => Some(dimensions::along_axes(*a, *b, u)),
            _ => None,
        }
    }

    /// Where its figure is written: in the middle of a distance, at the vertex of an angle. Metres, table frame.
    pub fn place(&self) -> Option<[f32; 3]> {
        match (self.kind, self.points.as_slice()) {
            (Kind::Distance, [a, b]) => Some(std::array::from_fn(|k| (a[k] + b[k]) / 2.0)),
            (Kind::Angle, [_, vertex, _]) => Some(*vertex),
            _ => None,
        }
    }

    /// The figure in words: `12.3 mm`.
    pub fn value(&self, unit: LengthUnit) -> String {
        self.written(unit).map_or_else(|| "–".into(), |(value, _, unit)| format!("{value}{unit}"))
    }

    /// The figure with its expanded uncertainty (k = 2): `12.3 ± 1.1 mm`.
    pub fn value_and_uncertainty(&self, unit: LengthUnit) -> String {
        self.written(unit)
            .map_or_else(|| "–".into(), |(value, uncertainty, unit)| format!("{value} ± {uncertainty}{unit}"))
    }

    /// Of a distance the way along each axis in words, without unit.
    pub fn axes(&self, unit: LengthUnit) -> Option<[String; 3]> {
        Some(self.along_axes()?.map(|estimate| in_digits(estimate, unit.in_metres()).0))
    }

    /// Value, expanded uncertainty and unit, with the space that stands before it: none before a degree sign.
    fn written(&self, unit: LengthUnit) -> Option<(String, String, String)> {
        let estimate = self.estimate()?;
        let (one, name) = match self.kind {
            Kind::Distance => (unit.in_metres(), format!("\u{a0}{}", unit.name())),
            Kind::Angle => (1_f64.to_radians(), "°".into()),
        };
        let (value, uncertainty) = in_digits(estimate, one);
        Some((value, uncertainty, name))
    }

    fn positions(&self) -> Vec<[f64; 3]> {
        self.points.iter().map(|p| p.map(f64::from)).collect()
    }
}

/// Value and expanded uncertainty in a unit that is `one` long, with the two digits that the uncertainty is worth.
fn in_digits(estimate: Estimate, one: f64) -> (String, String) {
    let (value, uncertainty) = (estimate.value / one, estimate.expanded() / one);
    let magnitude = if uncertainty > 0.0 { uncertainty.log10().floor() } else { -3.0 };
    let decimals = (1.0 - magnitude).clamp(0.0, 5.0) as usize;
    (format!("{value:.decimals$}").replace('-', MINUS), format!("{uncertainty:.decimals$}"))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn measurement(number: u32, kind: Kind, points: &[[f32; 3]]) -> Measurement {
        Measurement { number, kind, points: points.to_vec(), voxel: 1.4e-3, outdated: false }
    }

    #[test]
    fn figures_have_the_digits_that_they_are_worth() {
        let way = measurement(1, Kind::Distance, &[[0.0, 0.0, 0.0], [0.03, -0.04, 0.0]]);
        assert_eq!(way.value(LengthUnit::Millimetres), "50.0\u{a0}mm");
        assert_eq!(way.value_and_uncertainty(LengthUnit::Millimetres), "50.0 ± 1.1\u{a0}mm");
        assert_eq!(way.value_and_uncertainty(LengthUnit::Inches), "1.969 ± 0.045\u{a0}inch");
        let axes = way.axes(LengthUnit::Millimetres).expect("a distance has axes");
        assert_eq!(axes, ["30.0".to_owned(), "\u{2212}40.0".into(), "0.0".into()]);
        assert!(way.place().expect("its middle").iter().zip([0.015, -0.02, 0.0]).all(|(a, b)| (a - b).abs() < 1e-7));
        let coarse = Measurement { voxel: 0.05, ..way };
        assert_eq!(coarse.value_and_uncertainty(LengthUnit::Millimetres), "50 ± 41\u{a0}mm");
    }

    #[test]
    fn an_angle_is_in_degrees_and_one_without_opening_is_none() {
        let right = measurement(1, Kind::Angle, &[[0.1, 0.0, 0.0], [0.0; 3], [0.0, 0.1, 0.0]]);
        assert_eq!(right.value(LengthUnit::Inches), "90.00°");
        assert!(right.value_and_uncertainty(LengthUnit::Millimetres).starts_with("90.00 ± 0.9"));
        assert_eq!((right.axes(LengthUnit::Millimetres), right.place()), (None, Some([0.0; 3])));
        let none = measurement(1, Kind::Angle, &[[0.0; 3], [0.0; 3], [0.0, 0.1, 0.0]]);
        assert_eq!(none.value(LengthUnit::Millimetres), "–");
        assert_eq!(measurement(1, Kind::Angle, &[[0.0; 3]]).estimate(), None);
    }
}
