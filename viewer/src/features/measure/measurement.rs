//! One measurement: what was picked for it, its figures with their uncertainties, and how these are written.

use super::{Kind, Line, Picking, Taken};
use crate::state::units;
use crate::words::decimal;
use crate::words::t;
use semascan_geometry::fit::{self, Feature, Fit, Relation};
use semascan_geometry::measure::dimensions::{self, Estimate};
use semascan_model::LengthUnit;
use semascan_model::measurement::Dimension;
use semascan_model::review::ReviewId;

/// One measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Its number, for people and for [`super::MeasureEvent::Remove`].
    pub number: u32,
    /// What was measured.
    pub kind: Kind,
    /// What was picked for it, in order.
    pub taken: Vec<Taken>,
    /// Whether the model has changed since.
    pub outdated: bool,
    /// The review by which it is kept with the inspection; `None` where it is not.
    pub kept: Option<ReviewId>,
}

impl Measurement {
    /// The figure; `None` for a plane, which has none but its form, and where what was picked has no such figure.
    pub fn estimate(&self) -> Option<Estimate> {
        match (self.kind, self.taken.as_slice()) {
            (Kind::Angle, [a, vertex, b]) => {
                let [a, vertex, b] = [a, vertex, b].map(|t| t.feature.middle().into());
                dimensions::angle(a, vertex, b, dimensions::grid_uncertainty(self.voxel()))
            }
            (Kind::Area, [one]) | (Kind::Along, [_, one]) => one.figure,
            (_, [one]) => one.fit()?.radius(),
            _ => self.relation().map(|relation| relation.estimate),
        }
    }

    /// What the figure is counted in.
    pub fn dimension(&self) -> Dimension {
        self.kind.dimension()
    }

    /// Of the distance of two points the way along each axis, metres.
    pub fn along_axes(&self) -> Option<[Estimate; 3]> {
        match (self.kind, self.taken.as_slice()) {
            (Kind::Distance, [a, b]) if a.is_point() && b.is_point() => {
                let [from, to] = [a, b].map(|t| t.feature.middle().into());
                Some(dimensions::along_axes(from, to, dimensions::grid_uncertainty(self.voxel())))
            }
            _ => None,
        }
    }

    /// The element that it is; `None` where it is no element.
    pub fn fit(&self) -> Option<&Fit> {
        match self.taken.as_slice() {
            [one] => one.fit(),
            _ => None,
        }
    }

    /// Where its figure is written, metres, table frame.
    pub fn place(&self) -> Option<[f32; 3]> {
        match (self.kind, self.taken.as_slice()) {
            (Kind::Angle, [_, vertex, _]) => Some(vertex.place),
            (_, [one]) => Some(one.place),
            (Kind::Along, [_, end]) => Some(end.lines.get(end.lines.len() / 2).map_or(end.place, |line| line[0])),
            _ => self.relation().map(|r| ((r.ends[0] + r.ends[1]) * 0.5).map(|c| c as f32).into()),
        }
    }

    /// The lines that show it: from foot to foot or along the sides of the angle, and what shows its elements. Those of elements
    /// in the list are theirs.
    pub fn lines(&self) -> Vec<Line> {
        let own = self.taken.iter().filter(|t| t.of.is_none());
        self.between().into_iter().chain(own.flat_map(|t| t.lines.iter().copied())).collect()
    }

    /// The same with what shows elements of the list.
    pub fn whole_lines(&self) -> Vec<Line> {
        self.between().into_iter().chain(self.taken.iter().flat_map(|t| t.lines.iter().copied())).collect()
    }

    /// The lines from foot to foot or along the sides of the angle.
    fn between(&self) -> Vec<Line> {
        let ends: Vec<[f32; 3]> = match (self.kind, self.taken.as_slice()) {
            (Kind::Angle, [_, _, _]) => self.taken.iter().map(|t| t.place).collect(),
            (_, [_]) | (Kind::Along, _) => Vec::new(),
            _ => self.relation().map_or(Vec::new(), |r| r.ends.map(|p| p.map(|c| c as f32).into()).to_vec()),
        };
        ends.windows(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// The figure in words: `12.3 mm`, with `R` before a radius.
    pub fn value(&self, unit: LengthUnit) -> String {
        self.written(unit).map_or_else(|| self.kind.name().into(), |(value, _)| value)
    }

    /// The figure with its expanded uncertainty (k = 2): `12.3 ± 1.1 mm`.
    pub fn value_and_uncertainty(&self, unit: LengthUnit) -> String {
        self.written(unit).map_or_else(|| self.kind.name().into(), |(_, whole)| whole)
    }

    /// Of the distance of two points the way along each axis in words, without unit.
    pub fn axes(&self, unit: LengthUnit) -> Option<[String; 3]> {
        let one = unit.in_metres();
        Some(self.along_axes()?.map(|estimate| in_digits(estimate.value / one, estimate.expanded() / one).0))
    }

    /// What it is of, in words: the elements between which it was taken, or how well its own element fits.
    pub fn note(&self, unit: LengthUnit) -> Option<String> {
        if let Some(fit) = self.fit() {
            let decimals = if unit == LengthUnit::Inches { 4 } else { 2 };
            let length = |metres: f64| decimal(metres / unit.in_metres(), decimals);
            return Some(t!(
                "measure.fit",
                used = fit.used,
                left_out = fit.left_out,
                rms = length(fit.rms),
                most = length(fit.largest)
            ));
        }
        let of: Vec<String> = self
            .taken
            .iter()
            .map(|t| t.of.map_or_else(|| t.name().to_owned(), |number| format!("{} {number}", t.name())))
            .collect();
        let has_element = self.taken.len() > 1 && self.taken.iter().any(|t| !t.is_point());
        has_element.then(|| of.join(" – "))
    }

    /// Voxel edge of the model, of two the coarser one, metres.
    pub fn voxel(&self) -> f64 {
        self.taken.iter().map(|t| t.voxel).fold(0.0, f32::max).into()
    }

    fn relation(&self) -> Option<Relation> {
        let [first, second] = self.taken.as_slice() else { return None };
        let relate: fn(&Feature, &Feature) -> Option<Relation> = match self.kind {
            Kind::Angle => fit::angle,
            Kind::Step => fit::step_height,
            _ => fit::distance,
        };
        relate(&first.feature, &second.feature)
    }

    /// The figure, alone and with its uncertainty, with unit.
    fn written(&self, unit: LengthUnit) -> Option<(String, String)> {
        let estimate = self.estimate()?;
        Some(in_words(self.kind, estimate.value, Some(estimate.expanded()), unit))
    }
}

/// A figure (metres, square metres or radians as the kind has it), alone and with its expanded uncertainty, with unit; `R` stands
/// before a radius.
pub(super) fn in_words(kind: Kind, value: f64, expanded: Option<f64>, unit: LengthUnit) -> (String, String) {
    let dimension = kind.dimension();
    let one = dimension.one(unit);
    // What is known without its uncertainty has the digits of a thousandth.
    let (value, uncertainty) = in_digits(value / one, expanded.unwrap_or(0.0) / one);
    let radius = if kind.is_radius() { "R\u{a0}" } else { "" };
    // No space before a degree sign.
    let unit = match dimension {
        Dimension::Length => format!("\u{a0}{}", units::unit_name(unit)),
        Dimension::Area => format!("\u{a0}{}²", units::unit_name(unit)),
        Dimension::Angle => "°".into(),
    };
    let whole = match expanded {
        Some(_) => format!("{radius}{value} ± {uncertainty}{unit}"),
        None => format!("{radius}{value}{unit}"),
    };
    (format!("{radius}{value}{unit}"), whole)
}

impl Taken {
    /// The element; `None` for a point.
    pub fn fit(&self) -> Option<&Fit> {
        match &self.feature {
            Feature::Fitted(fit) => Some(fit),
            Feature::Point { .. } => None,
        }
    }

    /// What it is, within a sentence.
    fn name(&self) -> &'static str {
        match self.fit().map(|fit| &fit.element) {
            None => t!("measure.within.point"),
            Some(fit::Element::Plane(_)) => t!("measure.within.plane"),
            Some(fit::Element::Cylinder(_)) => t!("measure.within.cylinder"),
            Some(fit::Element::Sphere(_)) => t!("measure.within.sphere"),
            Some(fit::Element::Circle(_)) => t!("measure.within.circle"),
        }
    }
}

/// Value and expanded uncertainty, with the two digits that the uncertainty is worth.
fn in_digits(value: f64, uncertainty: f64) -> (String, String) {
    let magnitude = if uncertainty > 0.0 { uncertainty.log10().floor() } else { -3.0 };
    let decimals = (1.0 - magnitude).clamp(0.0, 5.0) as usize;
    (decimal(value, decimals), decimal(uncertainty, decimals))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::features::inspect::PickedPoint;
    use semascan_geometry::fit::{Cylinder, Element, Plane};
    use semascan_model::SemanticPoint;

    pub(in super::super) fn point(position: [f32; 3], voxel: f32) -> Taken {
        let point = SemanticPoint { position, ..SemanticPoint::UNKNOWN };
        Taken::point(&PickedPoint::of(&point, voxel, false))
    }

    pub(in super::super) fn element(element: Element, of: Option<u32>) -> Taken {
        let mut covariance = [[0.0; 6]; 6];
        (0..6).for_each(|k| covariance[k][k] = 1e-10);
        let fit = Fit { element, rms: 5e-5, largest: 3e-4, used: 812, left_out: 14, covariance: covariance.into() };
        let lines = vec![[[0.0; 3], [0.01; 3]]].into();
        Taken { feature: Feature::Fitted(fit), figure: None, lines, place: [0.0; 3], voxel: 1.4e-3, of }
    }

    pub(in super::super) fn cylinder(x: f64, of: Option<u32>) -> Taken {
        let (point, axis) = ([x, 0.0, 0.0].into(), [0.0, 0.0, 1.0].into());
        element(Element::Cylinder(Cylinder { point, axis, radius: 0.012 }), of)
    }

    pub(in super::super) fn plane(z: f64, of: Option<u32>) -> Taken {
        element(Element::Plane(Plane { point: [0.0, 0.0, z].into(), normal: [0.0, 0.0, 1.0].into() }), of)
    }

    pub(in super::super) fn measured(number: u32, kind: Kind, taken: Vec<Taken>) -> Measurement {
        Measurement { number, kind, taken, outdated: false, kept: None }
    }

    pub(in super::super) fn measurement(number: u32, kind: Kind, points: &[[f32; 3]]) -> Measurement {
        measured(number, kind, points.iter().map(|p| point(*p, 1.4e-3)).collect())
    }

    #[test]
    fn figures_have_the_digits_that_they_are_worth() {
        let ends = [[0.0, 0.0, 0.0], [0.03, -0.04, 0.0]];
        let way = measurement(1, Kind::Distance, &ends);
        assert_eq!(way.value(LengthUnit::Millimetres), "50.0\u{a0}mm");
        assert_eq!(way.value_and_uncertainty(LengthUnit::Millimetres), "50.0 ± 1.1\u{a0}mm");
        assert_eq!(way.value_and_uncertainty(LengthUnit::Inches), "1.969 ± 0.045\u{a0}inch");
        let axes = way.axes(LengthUnit::Millimetres).expect("a distance has axes");
        assert_eq!(axes, ["30.0".to_owned(), "\u{2212}40.0".into(), "0.0".into()]);
        assert!(way.place().expect("its middle").iter().zip([0.015, -0.02, 0.0]).all(|(a, b)| (a - b).abs() < 1e-7));
        assert_eq!(way.note(LengthUnit::Millimetres), None);
        let coarse = measured(1, Kind::Distance, ends.map(|p| point(p, 0.02)).to_vec());
        assert_eq!(coarse.value_and_uncertainty(LengthUnit::Millimetres), "50 ± 16\u{a0}mm");
    }

    #[test]
    fn an_angle_is_in_degrees_and_one_without_opening_is_none() {
        let right = measurement(1, Kind::Angle, &[[0.1, 0.0, 0.0], [0.0; 3], [0.0, 0.1, 0.0]]);
        assert_eq!(right.value(LengthUnit::Inches), "90.00°");
        assert!(right.value_and_uncertainty(LengthUnit::Millimetres).starts_with("90.00 ± 0.9"));
        assert_eq!((right.axes(LengthUnit::Millimetres), right.place()), (None, Some([0.0; 3])));
        assert_eq!(right.lines().len(), 2, "its sides");
        assert_eq!(measurement(1, Kind::Angle, &[[0.0; 3], [0.0; 3], [0.0, 0.1, 0.0]]).estimate(), None);
        assert_eq!(measurement(1, Kind::Angle, &[[0.0; 3]]).estimate(), None);
    }

    #[test]
    fn an_element_says_its_radius_and_how_well_it_fits() {
        let one = measured(1, Kind::Cylinder, vec![cylinder(0.0, None)]);
        assert_eq!(one.value_and_uncertainty(LengthUnit::Millimetres), "R\u{a0}12.000 ± 0.020\u{a0}mm");
        let note = one.note(LengthUnit::Millimetres).expect("a note");
        assert_eq!(note, "812 points, 14 left out; residual 0.05 rms, 0.30 at most");
        assert_eq!(one.lines().len(), 1, "its wireframe");
        let flat = measured(2, Kind::Plane, vec![plane(0.0, None)]);
        assert_eq!((flat.estimate(), flat.value(LengthUnit::Millimetres)), (None, "Plane".into()));
    }

    #[test]
    fn figures_between_elements_say_of_which() {
        let axes = measured(3, Kind::Distance, vec![cylinder(0.0, Some(1)), cylinder(0.05, Some(2))]);
        assert_eq!(axes.value(LengthUnit::Millimetres), "50.000\u{a0}mm");
        assert_eq!(axes.note(LengthUnit::Millimetres).as_deref(), Some("cylinder 1 – cylinder 2"));
        assert_eq!((axes.lines().len(), axes.along_axes()), (1, None), "those of its elements belong to these");
        let step = measured(4, Kind::Step, vec![plane(0.002, None), plane(-0.001, None)]);
        assert_eq!(step.value(LengthUnit::Millimetres), "\u{2212}3.000\u{a0}mm");
        let angle = measured(5, Kind::Angle, vec![plane(0.0, Some(4)), cylinder(0.0, Some(1))]);
        assert_eq!(angle.value(LengthUnit::Millimetres), "90.0000°");
        let meets = measured(6, Kind::Distance, vec![plane(0.0, Some(4)), cylinder(0.0, Some(1))]);
        assert_eq!((meets.estimate(), meets.place()), (None, None));
    }
}
