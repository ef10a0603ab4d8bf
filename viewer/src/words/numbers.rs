//! Numbers as a person reads them: with the decimal separator of the language, and with a minus that is a sign and no hyphen.
//!
//! Fields for numbers are the browser's (`type=number`), which takes what the person's system writes.

use super::t;

const MINUS: &str = "\u{2212}";

/// A number with that many decimals.
pub fn decimal(value: impl Into<f64>, decimals: usize) -> String {
    let value = value.into();
    localized(&format!("{value:.decimals$}"))
}

/// The same with its sign, plus or minus.
pub fn signed(value: impl Into<f64>, decimals: usize) -> String {
    let value = value.into();
    localized(&format!("{value:+.decimals$}"))
}

/// A number as the language writes it, from one as programs write it.
pub fn localized(number: &str) -> String {
    number.replace('.', t!("number.decimal")).replace('-', MINUS)
}
