//! Colour and depth files that belong together by their names: the same number, or stamps that are near where each has its
//! own (`0000012-000000366987.jpg` of [Choi 2016], microseconds), or their places where names say nothing.

use super::association::{TOLERANCE, pairs};
use semascan_inspection::source::SourceError;
use std::path::{Path, PathBuf};

/// Endings of the pictures that can be read.
const READABLE: [&str; 6] = ["png", "jpg", "jpeg", "tif", "tiff", "webp"];

/// What a name says.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Number {
    frame: u64,
    /// Seconds.
    stamp: Option<f64>,
}

/// A colour and a depth picture, with the stamp of the former in seconds if names have stamps.
pub(crate) type Pair = (PathBuf, PathBuf, Option<f64>);

/// Pictures of a folder by the numbers of their names, else by their names.
///
/// # Errors
/// [`SourceError::Io`] naming the folder that cannot be listed.
pub(crate) fn pictures(folder: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let io = |source| SourceError::Io { path: folder.to_owned(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        if READABLE.iter().any(|known| known.eq_ignore_ascii_case(ending)) {
            found.push(path);
        }
    }
    found.sort_by_cached_key(|path| (number(path).map_or(u64::MAX, |number| number.frame), path.clone()));
    Ok(found)
}

/// The pictures of two folders that belong together, in the order of the colour pictures, and what is to be said of it.
///
/// # Errors
/// [`SourceError`] naming the folder that cannot be listed, or whose pictures find no others.
pub(crate) fn paired_pictures(color: &Path, depth: &Path) -> Result<(Vec<Pair>, Option<String>), SourceError> {
    let (colors, depths) = (pictures(color)?, pictures(depth)?);
    let [color_numbers, depth_numbers] =
        [&colors, &depths].map(|paths| paths.iter().map(|path| number(path)).collect::<Option<Vec<Number>>>());
    let places: Vec<(usize, usize)> = match (&color_numbers, &depth_numbers) {
        (Some(a), Some(b)) => match (stamps(a), stamps(b)) {
            (Some(a), Some(b)) => pairs(&a, &b, TOLERANCE),
            _ => {
                let frames =
                    |numbers: &[Number]| numbers.iter().map(|number| number.frame as f64).collect::<Vec<f64>>();
                pairs(&frames(a), &frames(b), 0.0)
            }
        },
        _ if colors.len() == depths.len() => (0..colors.len()).map(|i| (i, i)).collect(),
        _ => {
            return Err(SourceError::Format {
                path: depth.to_owned(),
                reason: format!(
                    "{} depth pictures for {} colour pictures, and their names do not say which belong together",
                    depths.len(),
                    colors.len()
                ),
            });
        }
    };
    let alone = colors.len().max(depths.len()) - places.len();
    let said = (alone > 0).then(|| {
        format!(
            "{} of {} colour and {} depth pictures belong together; the rest is left out",
            places.len(),
            colors.len(),
            depths.len()
        )
    });
    let pair = |(a, b): (usize, usize)| {
        let stamp = color_numbers.as_ref().and_then(|numbers| numbers.get(a)?.stamp);
        Some((colors.get(a)?.clone(), depths.get(b)?.clone(), stamp))
    };
    Ok((places.into_iter().filter_map(pair).collect(), said))
}

/// Stamps in ascending order; `None` where names have none, or they go back.
fn stamps(numbers: &[Number]) -> Option<Vec<f64>> {
    let stamps: Vec<f64> = numbers.iter().map(|number| number.stamp).collect::<Option<_>>()?;
    stamps.windows(2).all(|w| w[0] < w[1]).then_some(stamps)
}

/// The number in a name: all of it, a number and a stamp with a dash, or the digits at its end.
fn number(path: &Path) -> Option<Number> {
    let stem = path.file_stem()?.to_str()?;
    if let Some((frame, stamp)) = stem.split_once('-')
        && let (Some(frame), Some(stamp)) = (digits(frame), digits(stamp))
    {
        return Some(Number { frame, stamp: Some(stamp as f64 * 1e-6) });
    }
    let frame = digits(stem.rsplit(|c: char| !c.is_ascii_digit()).next()?)?;
    Some(Number { frame, stamp: None })
}

fn digits(text: &str) -> Option<u64> {
    (!text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())).then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn paired(color: &[&str], depth: &[&str]) -> Result<(Vec<(String, String)>, bool), SourceError> {
        let folder = tempfile::tempdir().expect("a folder");
        for (kind, names) in [("rgb", color), ("depth", depth)] {
            std::fs::create_dir(folder.path().join(kind)).expect("made");
            for name in names {
                std::fs::write(folder.path().join(kind).join(name), "").expect("written");
            }
        }
        let (found, said) = paired_pictures(&folder.path().join("rgb"), &folder.path().join("depth"))?;
        let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
        Ok((found.iter().map(|(a, b, _)| (name(a), name(b))).collect(), said.is_some()))
    }

    #[test]
    fn names_say_what_belongs_together() {
        let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let numbered = paired(&["10.jpg", "9.jpg", "x.txt"], &["000009.png", "000010.png", "000011.png"]);
        assert_eq!(numbered.expect("pairs"), (vec![pair("9.jpg", "000009.png"), pair("10.jpg", "000010.png")], true));
        let stamped = paired(
            &["0000001-000000000000.jpg", "0000002-000000033000.jpg"],
            &["0000001-000000014000.png", "0000002-000000041000.png", "0000003-000000080000.png"],
        );
        let expected = vec![
            pair("0000001-000000000000.jpg", "0000001-000000014000.png"),
            pair("0000002-000000033000.jpg", "0000002-000000041000.png"),
        ];
        assert_eq!(stamped.expect("pairs"), (expected, true));
        let by_order = paired(&["a.png", "b.png"], &["u.png", "v.png"]);
        assert_eq!(by_order.expect("pairs"), (vec![pair("a.png", "u.png"), pair("b.png", "v.png")], false));
        let error = paired(&["a.png", "b.png"], &["u.png"]).expect_err("no way to tell").to_string();
        assert!(error.contains("1 depth pictures for 2 colour pictures"), "{error}");
    }

    proptest! {
        #[test]
        fn any_name_has_a_number_or_none(name in "\\PC{0,20}") {
            let _ = number(Path::new(&name));
        }
    }
}
