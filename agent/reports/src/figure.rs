//! Figures with their uncertainty, as reports print them.
//!
//! The expanded uncertainty is given with two significant digits and the value to the same place ([GUM], 7.2.6). Units are
//! millimetres and square millimetres.

use semascan_model::finding::Quantity;

/// Digits behind the point at most: nanometres are nobody's business here.
const MOST_DIGITS: i32 = 4;

/// A unit that figures are printed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Metres printed as millimetres.
    Millimetre,
    /// Square metres printed as square millimetres.
    SquareMillimetre,
    /// Shares printed as percent.
    Percent,
    /// Numbers.
    One,
}

impl Unit {
    /// What a figure in SI units is multiplied by.
    pub(crate) fn factor(self) -> f64 {
        match self {
            Self::Millimetre => 1e3,
            Self::SquareMillimetre => 1e6,
            Self::Percent => 1e2,
            Self::One => 1.0,
        }
    }

    /// Behind the figure; empty for numbers.
    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::SquareMillimetre => "mm²",
            Self::Percent => "%",
            Self::One => "",
        }
    }
}

/// `12.3 ± 0.4` in the unit, without its symbol. Without an uncertainty the value has three significant digits.
pub(crate) fn with_uncertainty(quantity: Quantity, unit: Unit) -> String {
    in_unit(quantity, unit.factor())
}

/// The same for a figure that is multiplied by `factor`.
pub(crate) fn in_unit(quantity: Quantity, factor: f64) -> String {
    let value = quantity.value * factor;
    match quantity.expanded.map(|expanded| expanded * factor) {
        // An uncertainty of zero is that of a count.
        Some(0.0) => plain(value, 0),
        Some(expanded) if expanded.is_finite() => {
            let digits = digits_for(expanded, 2);
            format!("{} ± {}", plain(value, digits), plain(expanded, digits))
        }
        _ => significant(value),
    }
}

/// A value alone with three significant digits, in the unit.
pub(crate) fn alone(value: f64, unit: Unit) -> String {
    significant(value * unit.factor())
}

/// A value with three significant digits.
pub(crate) fn significant(value: f64) -> String {
    plain(value, digits_for(value, 3))
}

/// A value with a number of digits behind the point; a zero has no sign.
pub(crate) fn plain(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}

/// Digits behind the point that `value` has with `significant` ones in all.
fn digits_for(value: f64, significant: i32) -> usize {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    // What rounds up to the next power of ten has one digit less behind the point.
    let mut magnitude = value.abs().log10().floor() as i32;
    let rounded = (value.abs() / 10_f64.powi(magnitude - significant + 1)).round();
    if rounded >= 10_f64.powi(significant) {
        magnitude += 1;
    }
    (significant - 1 - magnitude).clamp(0, MOST_DIGITS) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uncertainty_says_how_many_digits_there_are() {
        let shown = |value, expanded, unit| with_uncertainty(Quantity { value, expanded }, unit);
        assert_eq!(shown(4.0e-4, Some(2.0e-5), Unit::SquareMillimetre), "400 ± 20");
        assert_eq!(shown(0.028_123, Some(0.001_04), Unit::Millimetre), "28.1 ± 1.0");
        assert_eq!(shown(0.028_123, Some(0.000_099_6), Unit::Millimetre), "28.12 ± 0.10");
        assert_eq!(shown(0.5, Some(0.012), Unit::Percent), "50.0 ± 1.2");
        assert_eq!(shown(3.0, Some(0.0), Unit::One), "3");
        assert_eq!(shown(0.002, None, Unit::Millimetre), "2.00");
        assert_eq!(shown(-1e-9, Some(1e-5), Unit::Millimetre), "0.000 ± 0.010");
        assert_eq!(shown(1.0, Some(f64::NAN), Unit::One), "1.00");
        assert_eq!(
            (significant(0.0), significant(12_345.6), significant(0.999_6)),
            ("0".into(), "12346".into(), "1.00".into())
        );
    }
}
