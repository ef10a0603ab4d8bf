//! Whether a reference lies where the model lies and is as large: deviations from one in another unit or frame are figures
//! without a meaning, and nothing in a picture says so.

use crate::state::units;
use crate::words::{decimal, t};
use semascan_model::LengthUnit;

/// The box that most of a model or reference is in: centre and edges in metres, table frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extent {
    /// Middle.
    pub center: [f64; 3],
    /// Edges.
    pub size: [f64; 3],
}

/// Points that are looked at for an extent.
const SAMPLES: usize = 50_000;
/// Share of the points beyond either side of the box.
const BEYOND: f64 = 0.01;
/// A reference is as large as the model if it is not so many times larger or smaller: of a part half may be seen, and a
/// centimetre is 2.54 times smaller than an inch.
const SAME_SIZE: f64 = 2.2;
/// A unit that makes the reference so nearly as large as the model is offered.
const FITTING_SIZE: f64 = 1.7;
/// Of one frame are things whose middles are not farther apart than this share of their diagonals.
const SAME_PLACE: f64 = 0.5;
/// Of one part in one frame are surfaces that half of the mesh is not farther from than this share of its diagonal.
const SAME_SURFACE: f64 = 0.05;

impl Extent {
    /// Of positions in metres; `None` without any.
    pub fn of(positions: &[[f32; 3]]) -> Option<Self> {
        let step = positions.len().div_ceil(SAMPLES).max(1);
        let (mut center, mut size) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let all = positions.iter().step_by(step).map(|p| f64::from(p[axis]));
            let mut values: Vec<f64> = all.filter(|v| v.is_finite()).collect();
            values.sort_unstable_by(f64::total_cmp);
            let last = values.len().checked_sub(1)?;
            let at = |part: f64| values[(part * last as f64).round() as usize];
            let (low, high) = (at(BEYOND), at(1.0 - BEYOND));
            center[axis] = (low + high) / 2.0;
            size[axis] = high - low;
        }
        Some(Self { center, size })
    }

    /// Length of its diagonal, metres.
    pub fn diagonal(&self) -> f64 {
        self.size.iter().map(|c| c * c).sum::<f64>().sqrt()
    }

    /// Between its middle and another's, metres.
    fn distance(&self, other: &Self) -> f64 {
        (0..3).map(|a| (self.center[a] - other.center[a]).powi(2)).sum::<f64>().sqrt()
    }
}

/// Why deviations from a reference mean nothing, or may mean nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mismatch {
    /// It is so many times as large as the model; in another unit it would be about as large.
    Unit {
        /// Diagonal of the reference over that of the model.
        ratio: f64,
        /// The unit in which they would be alike.
        fits: LengthUnit,
    },
    /// It is so many times as large as the model, whatever the unit.
    Size {
        /// Diagonal of the reference over that of the model.
        ratio: f64,
    },
    /// It lies so far away from the model, in metres.
    Place {
        /// Between the middles.
        distance: f64,
    },
    /// It is there, and most of the mesh is not on it.
    Surface {
        /// Median distance of the mesh from it, metres.
        median: f64,
    },
}

impl Mismatch {
    /// What is wrong, if anything.
    ///
    /// * `unit`: what the numbers of the reference were taken for.
    /// * `median`: of the mesh's distances from the reference, metres.
    pub fn of(model: &Extent, reference: &Extent, unit: LengthUnit, median: f64) -> Option<Self> {
        let ratio = reference.diagonal() / model.diagonal();
        let unlike = |ratio: f64| ratio.ln().abs();
        if !(ratio.is_finite() && ratio > 0.0) {
            return None;
        }
        if unlike(ratio) > SAME_SIZE.ln() {
            let in_unit = |other: &LengthUnit| unlike(ratio * other.in_metres() / unit.in_metres());
            let fits = LengthUnit::ALL.into_iter().min_by(|a, b| in_unit(a).total_cmp(&in_unit(b)));
            match fits.filter(|other| in_unit(other) <= FITTING_SIZE.ln()) {
                Some(fits) => return Some(Self::Unit { ratio, fits }),
                // A small model on a large reference that it lies on is a part of it.
                None if ratio < 1.0 || median > SAME_SURFACE * model.diagonal() => return Some(Self::Size { ratio }),
                None => return None,
            }
        }
        let distance = model.distance(reference);
        if distance > SAME_PLACE * model.diagonal().max(reference.diagonal()) {
            return Some(Self::Place { distance });
        }
        (median > SAME_SURFACE * model.diagonal()).then_some(Self::Surface { median })
    }

    /// What is wrong, and what helps, for people.
    pub fn sentence(&self) -> String {
        let length = |metres: f64| match metres {
            m if m >= 1.0 => format!("{} m", decimal(m, 1)),
            m => format!("{} mm", decimal(m * 1e3, 0)),
        };
        let times = |ratio: f64| {
            let factor = if ratio >= 1.0 { ratio } else { 1.0 / ratio };
            let factor = decimal(factor, usize::from(factor < 10.0));
            if ratio >= 1.0 { t!("mismatch.larger", factor) } else { t!("mismatch.smaller", factor) }
        };
        let alignment = t!("mismatch.alignment");
        match self {
            Self::Unit { ratio, fits } => {
                t!("mismatch.unit", times = times(*ratio), unit = units::unit_name(*fits))
            }
            Self::Size { ratio } => t!("mismatch.size", times = times(*ratio)),
            Self::Place { distance } => t!("mismatch.place", distance = length(*distance), alignment),
            Self::Surface { median } => t!("mismatch.surface", median = length(*median), alignment),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, edge: f64) -> Extent {
        Extent { center: [x, 0.0, 0.0], size: [edge; 3] }
    }

    #[test]
    fn other_units_are_noticed_and_the_one_that_fits_is_offered() {
        let model = at(0.0, 0.2);
        for (taken, real) in [
            (LengthUnit::Metres, LengthUnit::Millimetres),
            (LengthUnit::Millimetres, LengthUnit::Metres),
            (LengthUnit::Metres, LengthUnit::Centimetres),
            (LengthUnit::Centimetres, LengthUnit::Inches),
            (LengthUnit::Inches, LengthUnit::Millimetres),
        ] {
            // The whole part, of which the model is what was seen.
            let edge = 0.22 * taken.in_metres() / real.in_metres();
            match Mismatch::of(&model, &at(0.0, edge), taken, 1.0) {
                Some(Mismatch::Unit { fits, .. }) => assert_eq!(fits, real, "taken for {}", taken.name()),
                other => panic!("{real:?} taken for {taken:?}: {other:?}"),
            }
            assert_eq!(Mismatch::of(&model, &at(0.0, 0.22), real, 1e-4), None);
        }
    }

    #[test]
    fn other_frames_and_other_parts_are_noticed() {
        let model = at(0.0, 0.2);
        assert!(matches!(Mismatch::of(&model, &at(0.9, 0.2), LengthUnit::Metres, 0.8), Some(Mismatch::Place { .. })));
        assert!(matches!(
            Mismatch::of(&model, &at(0.01, 0.2), LengthUnit::Metres, 0.03),
            Some(Mismatch::Surface { .. })
        ));
        assert_eq!(
            Mismatch::of(&model, &at(0.01, 0.2), LengthUnit::Metres, 0.002),
            None,
            "a worn part is the same part"
        );
        let odd = Mismatch::of(&model, &at(0.0, 0.2 * 5.0), LengthUnit::Metres, 0.2);
        assert!(matches!(odd, Some(Mismatch::Size { ratio }) if (ratio - 5.0).abs() < 1e-9), "{odd:?}");
        assert_eq!(
            Mismatch::of(&model, &at(0.0, 0.2 * 5.0), LengthUnit::Metres, 1e-4),
            None,
            "a piece of a large part"
        );
        assert_eq!(Mismatch::of(&at(0.0, 0.0), &model, LengthUnit::Metres, 0.0), None, "nothing is known of a point");
    }

    #[test]
    fn a_few_wild_points_do_not_count() {
        let mut points: Vec<[f32; 3]> = (0..1000).map(|i| [i as f32 * 1e-3, 0.0, f32::NAN]).collect();
        assert_eq!(Extent::of(&points), None, "no height is known");
        points.iter_mut().for_each(|p| p[2] = 0.5);
        points.push([900.0, 900.0, 900.0]);
        let extent = Extent::of(&points).expect("points");
        assert!(extent.diagonal() < 1.0 && (extent.center[0] - 0.5).abs() < 0.01, "{extent:?}");
        assert_eq!(Extent::of(&[]), None);
    }

    #[test]
    fn every_sentence_says_how_much_and_what_helps() {
        let said = Mismatch::Unit { ratio: 1000.0, fits: LengthUnit::Millimetres }.sentence();
        assert_eq!(said, "The reference is 1000 times as large as the model. In mm the two would be alike.");
        assert!(Mismatch::Place { distance: 0.25 }.sentence().contains("250 mm away"));
        assert!(Mismatch::Surface { median: 0.03 }.sentence().contains("--align"));
        assert!(Mismatch::Size { ratio: 0.2 }.sentence().contains("5.0 times smaller"));
    }
}
