//! Text as programs of many systems write it: lines end with LF, CR LF or CR alone; names are UTF-8 or Latin-1; numbers that
//! are none have several spellings.

use std::borrow::Cow;

/// Splits the first line off `bytes`: the line without its end, and what follows. A CR before an LF is one end with it.
pub(crate) fn split_line(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    if bytes.is_empty() {
        return None;
    }
    let Some(end) = bytes.iter().position(|b| matches!(b, b'\n' | b'\r')) else { return Some((bytes, &[])) };
    let width = if bytes[end..].starts_with(b"\r\n") { 2 } else { 1 };
    Some((&bytes[..end], &bytes[end + width..]))
}

/// The lines of a text, without their ends.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = without_mark(bytes);
    std::iter::from_fn(move || {
        let (line, after) = split_line(rest)?;
        rest = after;
        Some(line)
    })
}

/// A text without the UTF-8 mark that some editors put at its head.
pub(crate) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Bytes as text: UTF-8, or Latin-1 where they are not that.
pub(crate) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect()),
    }
}

/// A number as programs write it. `-nan(ind)`, `1.#QNAN` and `1.#INF` are those of Microsoft's C library, `1.5D+03` of
/// Fortran's. `None` if it is not a number in any of these forms.
pub(crate) fn number(word: &str) -> Option<f64> {
    if let Ok(value) = word.parse() {
        return Some(value);
    }
    let lower = word.to_ascii_lowercase();
    let (sign, bare) = match lower.strip_prefix('-') {
        Some(bare) => (-1.0, bare),
        None => (1.0, lower.strip_prefix('+').unwrap_or(&lower)),
    };
    if bare.starts_with("1.#inf") {
        return Some(sign * f64::INFINITY);
    }
    if bare.starts_with("nan(") || ["1.#qnan", "1.#snan", "1.#ind", "1.#nan"].iter().any(|n| bare.starts_with(n)) {
        return Some(f64::NAN);
    }
    let by_fortran = bare.starts_with(|c: char| c.is_ascii_digit() || c == '.') && bare.contains('d');
    by_fortran.then(|| bare.replacen('d', "e", 1).parse::<f64>().ok()).flatten().map(|value| sign * value)
}

/// Most characters of the name of an object: it is kept with each of its pieces.
const LONGEST_NAME: usize = 256;

/// The name of an object, cut where it is longer than anybody reads.
pub(crate) fn name(text: &str) -> String {
    text.chars().take(LONGEST_NAME).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_three_ways() {
        for text in ["a b\n\nc", "a b\r\n\r\nc\r\n", "a b\r\rc\r", "\u{feff}a b\n\nc\n"] {
            let found: Vec<&[u8]> = lines(text.as_bytes()).collect();
            assert_eq!(found, [&b"a b"[..], b"", b"c"], "{text:?}");
        }
        assert_eq!(lines(b"").count(), 0);
        assert_eq!(decoded(b"Geh\xe4use"), decoded("Gehäuse".as_bytes()));
    }

    #[test]
    fn numbers_have_many_spellings() {
        for (word, value) in
            [("1e-3", 1e-3), ("+.5E+02", 50.0), ("-7.", -7.0), ("1.5D+03", 1500.0), ("-1.#INF00", f64::NEG_INFINITY)]
        {
            assert_eq!(number(word), Some(value), "{word}");
        }
        for word in ["nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#IND00"] {
            assert!(number(word).is_some_and(f64::is_nan), "{word}");
        }
        for word in ["", "1,5", "x", "dad", "0x10", "1d"] {
            assert_eq!(number(word), None, "{word}");
        }
    }
}
