//! Lengths, areas, counts and durations as people read them. The model is in metres and seconds; the screen shows
//! millimetres, groups digits by narrow spaces (ISO 80000-1) and never shows more digits than a figure is worth.

use crate::words::{decimal, t};
use semascan_model::LengthUnit;

/// Narrow no-break space between groups of digits.
const GROUP: char = '\u{202f}';
/// No-break space between figure and unit.
const UNIT: char = '\u{a0}';

/// A unit of length as people read it.
pub fn unit_name(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Inches => t!("unit.inch"),
        unit => unit.name(),
    }
}

/// `1234567` as `1 234 567`.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() * 2);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(GROUP);
        }
        out.push(digit);
    }
    out
}

/// A length in metres as millimetres.
pub fn length(metres: f64) -> String {
    let mm = metres * 1e3;
    match mm.abs() {
        a if !a.is_finite() => "–".into(),
        a if a < 10.0 => format!("{}{UNIT}mm", decimal(mm, 2)),
        a if a < 1000.0 => format!("{}{UNIT}mm", decimal(mm, 1)),
        _ => format!("{}{UNIT}mm", decimal(mm, 0)),
    }
}

/// An area in square metres as mm² below one square centimetre, as cm² from there.
pub fn area(square_metres: f64) -> String {
    let mm2 = square_metres * 1e6;
    match mm2 {
        a if !a.is_finite() => "–".into(),
        a if a < 99.5 => format!("{a:.0}{UNIT}mm²"),
        a if a < 99_950.0 => format!("{}{UNIT}cm²", decimal(a / 100.0, 1)),
        a => format!("{}{UNIT}cm²", count((a / 100.0).round() as u64)),
    }
}

/// A share 0..=1 as whole per cent; short of certainty it never reads 100 %.
pub fn percent(share: f64) -> String {
    if !share.is_finite() {
        return "–".into();
    }
    let whole = (share.clamp(0.0, 1.0) * 100.0).round();
    let shown = if whole >= 100.0 && share < 0.9995 { 99.0 } else { whole };
    format!("{shown:.0}{UNIT}%")
}

/// A duration in microseconds.
pub fn duration(us: u64) -> String {
    let ms = us as f64 / 1e3;
    match us {
        0..1_000 => format!("{us}{UNIT}µs"),
        1_000..9_950 => format!("{}{UNIT}ms", decimal(ms, 1)),
        9_950..999_500 => format!("{ms:.0}{UNIT}ms"),
        _ => format!("{}{UNIT}s", decimal(ms / 1e3, 2)),
    }
}

/// A size in bytes.
pub fn bytes(n: u64) -> String {
    match n as f64 {
        b if b < 1e3 => format!("{n}{UNIT}B"),
        b if b < 1e6 => format!("{:.0}{UNIT}kB", b / 1e3),
        b => format!("{}{UNIT}MB", decimal(b / 1e6, 1)),
    }
}

/// A reason as it came, made a sentence: a capital in front, a full stop at the end.
pub fn sentence(reason: &str) -> String {
    let reason = reason.trim();
    let mut letters = reason.chars();
    let Some(first) = letters.next() else { return String::new() };
    let stop = if reason.ends_with(['.', '!', '?', '…']) { "" } else { "." };
    format!("{}{}{stop}", first.to_uppercase(), letters.as_str())
}

/// A file name made of a part's name: lower case, words joined by hyphens, never empty.
pub fn file_stem(part: &str) -> String {
    let mut stem = String::new();
    for c in part.chars().take(80) {
        if c.is_alphanumeric() {
            stem.extend(c.to_lowercase());
        } else if !stem.is_empty() && !stem.ends_with('-') {
            stem.push('-');
        }
    }
    let stem = stem.trim_end_matches('-');
    if stem.is_empty() { "semascan-model".into() } else { stem.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped_by_three() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(1_000), "1\u{202f}000");
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
    }

    #[test]
    fn figures_are_in_the_units_of_the_shop_floor() {
        assert_eq!(length(0.000_5), "0.50\u{a0}mm");
        assert_eq!(length(0.1234), "123.4\u{a0}mm");
        assert_eq!(length(f64::NAN), "–");
        assert_eq!(area(42e-6), "42\u{a0}mm²");
        assert_eq!(area(99.6e-6), "1.0\u{a0}cm²");
        assert_eq!(area(0.0123), "123.0\u{a0}cm²");
        assert_eq!(area(0.5), "5\u{202f}000\u{a0}cm²");
        assert_eq!(duration(850), "850\u{a0}µs");
        assert_eq!(duration(1_240), "1.2\u{a0}ms");
        assert_eq!(duration(999_700), "1.00\u{a0}s");
        assert_eq!(bytes(1_500_000), "1.5\u{a0}MB");
    }

    #[test]
    fn an_uncertain_share_is_never_called_certain() {
        assert_eq!(percent(0.997), "99\u{a0}%");
        assert_eq!(percent(1.0), "100\u{a0}%");
        assert_eq!(percent(f64::NAN), "–");
    }

    #[test]
    fn a_reason_becomes_a_sentence() {
        assert_eq!(sentence("the socket closed"), "The socket closed.");
        assert_eq!(sentence(" Reload the page. "), "Reload the page.");
        assert_eq!(sentence(""), "");
    }

    #[test]
    fn a_file_is_named_after_its_part() {
        assert_eq!(file_stem("Starter motor  7"), "starter-motor-7");
        assert_eq!(file_stem("../../etc/passwd"), "etc-passwd");
        assert_eq!(file_stem("***"), "semascan-model");
    }
}
