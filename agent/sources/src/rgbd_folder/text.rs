//! Text files of recordings: rows of numbers, of which a bad one is named by its line.

use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use std::path::Path;

/// Most bytes of a text file: a pose a frame for days.
const LARGEST: u64 = 256 << 20;

/// The content of a text file.
///
/// # Errors
/// [`SourceError`] naming the file: it cannot be read, is too large, or is no text.
pub(crate) fn read_text(path: &Path) -> Result<String, SourceError> {
    let io = |source| SourceError::Io { path: path.to_owned(), source };
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let bytes = std::fs::metadata(path).map_err(io)?.len();
    if bytes > LARGEST {
        return Err(refuse(format!("{bytes} bytes; {LARGEST} are the most of a text file of a recording")));
    }
    let bytes = regular_file::read(path).map_err(io)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) if !text.contains('\0') => Ok(text.to_owned()),
        _ => Err(refuse("is no text".to_owned())),
    }
}

/// Lines of a text with their numbers, from 1; empty ones and comments (`#`) are passed over.
#[derive(Clone, Debug)]
pub(crate) struct Rows<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
}

impl<'a> Rows<'a> {
    pub(crate) fn of(text: &'a str) -> Self {
        Self { lines: text.lines().enumerate() }
    }
}

impl<'a> Iterator for Rows<'a> {
    type Item = (usize, &'a str);

    fn next(&mut self) -> Option<Self::Item> {
        for (place, line) in self.lines.by_ref() {
            let line = line.trim();
            if !line.is_empty() && !line.starts_with('#') {
                return Some((place + 1, line));
            }
        }
        None
    }
}

/// Exactly `N` numbers of a line; NaN and infinite are numbers here. Commas separate as blanks do.
///
/// # Errors
/// What is there in their place.
pub(crate) fn numbers<const N: usize>(line: &str) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    let mut found = 0;
    for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()) {
        let shown: String = word.chars().take(40).collect();
        let value = word.parse::<f64>().map_err(|_| format!("`{shown}` is no number"))?;
        if let Some(slot) = out.get_mut(found) {
            *slot = value;
        }
        found += 1;
    }
    if found == N { Ok(out) } else { Err(format!("{found} numbers in place of {N}")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rows_have_their_line_numbers_and_numbers_are_counted() {
        let rows: Vec<_> = Rows::of("# head\r\n\r\n1 2\r\n  3 4 # no comment\n").collect();
        assert_eq!(rows, [(3, "1 2"), (4, "3 4 # no comment")]);
        assert_eq!(numbers::<3>("1 -2.5e3,\t3"), Ok([1.0, -2500.0, 3.0]));
        assert!(numbers::<1>("NaN").expect("a number")[0].is_nan());
        assert_eq!(numbers::<2>("1 2 3"), Err("3 numbers in place of 2".into()));
        assert_eq!(numbers::<2>("1 two"), Err("`two` is no number".into()));
    }

    #[test]
    fn what_is_no_text_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rgb.txt");
        for bytes in [&b"\xff\xfe\x00"[..], b"1 a\0b"] {
            std::fs::write(&path, bytes).expect("written");
            let error = read_text(&path).expect_err("no text").to_string();
            assert!(error.contains("rgb.txt") && error.contains("no text"), "{error}");
        }
        std::fs::write(&path, b"\xef\xbb\xbf1 a").expect("written");
        assert_eq!(read_text(&path).expect("text"), "1 a");
        assert!(read_text(folder.path()).is_err(), "a folder");
    }

    proptest! {
        #[test]
        fn any_line_is_numbers_or_refused(line in ".{0,80}") {
            let _ = numbers::<4>(&line);
        }
    }
}
