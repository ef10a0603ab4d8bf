//! The ranges of numbers on the command line, each stated once: a number outside is refused by the argument's name before
//! anything begins.

use clap::builder::RangedU64ValueParser;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Longest length in millimetres that anybody means: ten kilometres.
const LONGEST: f64 = 1e7;
/// Most points that a mesh is sampled with: a few gigabytes.
#[cfg(feature = "demo")]
const MOST_SAMPLES: u64 = 20_000_000;
/// Most threads.
const MOST_THREADS: u64 = 4096;
/// Longest pause between two captures, seconds: a day.
const LONGEST_PAUSE: f64 = 86_400.0;

/// A share, a confidence or a standard uncertainty: 0 to 1.
pub(crate) fn share<T: Number>(text: &str) -> Result<T, String> {
    within(text, 0.0..=1.0)
}

/// The threshold of a standard uncertainty, 0 to 1.
pub(crate) fn threshold(text: &str) -> Result<f32, String> {
    share(text).map_err(|reason| format!("as a threshold of a standard uncertainty {reason}"))
}

/// A length above 0, millimetres.
pub(crate) fn length<T: Number>(text: &str) -> Result<T, String> {
    positive(text, LONGEST)
}

/// A length of 0 or more, millimetres.
pub(crate) fn length_or_zero<T: Number>(text: &str) -> Result<T, String> {
    within(text, 0.0..=LONGEST)
}

/// What one unit of a file is in metres.
#[cfg(feature = "demo")]
pub(crate) fn scale(text: &str) -> Result<f64, String> {
    positive(text, 1e6)
}

/// The edge of the mesher's grid cells in voxels.
pub(crate) fn pitch(text: &str) -> Result<f32, String> {
    positive(text, 1e3)
}

/// A pause in seconds.
pub(crate) fn pause(text: &str) -> Result<f64, String> {
    within(text, 0.0..=LONGEST_PAUSE)
}

/// A number of samples.
#[cfg(feature = "demo")]
pub(crate) fn samples() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=MOST_SAMPLES)
}

/// A number of threads.
pub(crate) fn threads() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=MOST_THREADS)
}

/// A number of points or triangles.
pub(crate) fn count() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=u64::from(u32::MAX))
}

/// A floating point number of either precision.
pub(crate) trait Number: FromStr + Into<f64> + Display + Copy {}
impl Number for f32 {}
impl Number for f64 {}

fn positive<T: Number>(text: &str, most: f64) -> Result<T, String> {
    match within(text, 0.0..=most) {
        Ok(value) if Into::<f64>::into(value) > 0.0 => Ok(value),
        Ok(_) => Err(format!("{text} is not above 0")),
        Err(reason) => Err(reason),
    }
}

fn within<T: Number>(text: &str, range: RangeInclusive<f64>) -> Result<T, String> {
    let value: T = text.trim().parse().map_err(|_| format!("{text} is no number"))?;
    // No range holds what is no number.
    if range.contains(&value.into()) {
        return Ok(value);
    }
    Err(format!("{text} is not within {} to {}", range.start(), range.end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_or_no_number_is_refused_with_the_range() {
        for wrong in ["nan", "2", "-0.1", "inf", "1e999", "", "half"] {
            let reason = share::<f32>(wrong).expect_err(wrong);
            assert!(reason.contains("0 to 1") || reason.contains("no number"), "{reason}");
        }
        assert_eq!([share::<f64>("0"), share("1"), share("0.16")], [Ok(0.0), Ok(1.0), Ok(0.16)]);
        assert_eq!(length::<f64>("1e-9"), Ok(1e-9));
        for wrong in ["0", "-1", "nan", "inf", "1e8", "1e-999"] {
            length::<f64>(wrong).expect_err(wrong);
        }
        assert_eq!(length_or_zero::<f32>("0"), Ok(0.0));
        assert!(pause("1e9").is_err() && pitch("nan").is_err());
    }

    #[cfg(feature = "demo")]
    #[test]
    fn a_unit_is_longer_than_nothing() {
        assert!(scale("0").is_err());
        assert_eq!(scale("0.0254"), Ok(0.0254));
    }
}
