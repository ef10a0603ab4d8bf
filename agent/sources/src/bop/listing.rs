//! The picture files of a scene's folder by the numbers in their names: how many digits a name has, and which format a
//! picture is stored in, differ between data sets [Hodan 2018], so both are taken from what lies there.

use semascan_inspection::source::SourceError;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// Endings of the pictures that can be read.
const READABLE: [&str; 6] = ["png", "jpg", "jpeg", "tif", "tiff", "webp"];

/// The numbers in a file's name, as the layout has them.
pub(super) trait Key: Copy + Ord {
    /// Of a name without its ending.
    fn parse(stem: &str) -> Option<Self>;
    /// The usual name without its ending.
    fn name(self) -> String;
}

/// A view: `000007`.
impl Key for u32 {
    fn parse(stem: &str) -> Option<Self> {
        stem.bytes().all(|b| b.is_ascii_digit()).then(|| stem.parse().ok()).flatten()
    }

    fn name(self) -> String {
        format!("{self:06}")
    }
}

/// An object of a view: `000007_000002`.
impl Key for (u32, u32) {
    fn parse(stem: &str) -> Option<Self> {
        let (view, object) = stem.split_once('_')?;
        Some((u32::parse(view)?, u32::parse(object)?))
    }

    fn name(self) -> String {
        format!("{:06}_{:06}", self.0, self.1)
    }
}

/// The picture files of a folder.
#[derive(Debug)]
pub(super) struct Listing<K> {
    folder: PathBuf,
    files: BTreeMap<K, Vec<PathBuf>>,
}

impl<K: Key> Listing<K> {
    /// What `folder` holds; nothing, if there is no such folder.
    pub(super) fn read(folder: PathBuf) -> Result<Self, SourceError> {
        let io = |source| SourceError::Io { path: folder.clone(), source };
        let mut files: BTreeMap<K, Vec<PathBuf>> = BTreeMap::new();
        let entries = match std::fs::read_dir(&folder) {
            Ok(entries) => Some(entries),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(io(error)),
        };
        for entry in entries.into_iter().flatten() {
            let path = entry.map_err(io)?.path();
            if let Some(key) = path.file_stem().and_then(|stem| K::parse(stem.to_str()?)) {
                files.entry(key).or_default().push(path);
            }
        }
        files.values_mut().for_each(|paths| paths.sort());
        Ok(Self { folder, files })
    }

    /// The numbers that there are files for.
    pub(super) fn keys(&self) -> impl Iterator<Item = K> + '_ {
        self.files.keys().copied()
    }

    /// Whether there is no file.
    pub(super) fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The picture of `key`; `None` if there is no file of that number.
    ///
    /// # Errors
    /// [`SourceError::Format`] naming the file, if no format is read that it is stored in, or if there are two.
    pub(super) fn find(&self, key: K) -> Result<Option<&Path>, SourceError> {
        let Some(all) = self.files.get(&key) else { return Ok(None) };
        let readable = |path: &&PathBuf| {
            let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            READABLE.iter().any(|known| known.eq_ignore_ascii_case(ending))
        };
        let pictures: Vec<&PathBuf> = all.iter().filter(readable).collect();
        match (pictures.as_slice(), all.as_slice()) {
            ([one], _) => Ok(Some(one)),
            ([first, second, ..], _) => Err(SourceError::Format {
                path: (*first).clone(),
                reason: format!("{} has the same number: which is meant cannot be known", second.display()),
            }),
            ([], [other, ..]) => Err(SourceError::Format {
                path: other.clone(),
                reason: "pictures are read as PNG, JPEG, TIFF or WebP; convert it to one of these".into(),
            }),
            ([], []) => Ok(None),
        }
    }

    /// The picture of `key`.
    ///
    /// # Errors
    /// As [`Self::find`], and [`SourceError::Io`] naming the file that should be there.
    pub(super) fn get(&self, key: K) -> Result<&Path, SourceError> {
        self.find(key)?.ok_or_else(|| SourceError::Io {
            path: self.expected(key),
            source: io::Error::new(io::ErrorKind::NotFound, "no such file"),
        })
    }

    /// Where the picture of `key` should lie, with the ending that its neighbours have.
    pub(super) fn expected(&self, key: K) -> PathBuf {
        let neighbour = self.files.values().flatten().next().and_then(|path| path.extension()?.to_str());
        self.folder.join(format!("{}.{}", key.name(), neighbour.unwrap_or("png")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_any_width_and_format_are_found_and_two_of_a_number_are_refused() {
        let dir = tempfile::tempdir().expect("folder");
        for name in ["0003.png", "000004.TIF", "5.exr", "6.png", "000006.jpg", "notes.txt", "7.json", "7.jpeg"] {
            std::fs::write(dir.path().join(name), "").expect("written");
        }
        let listing = Listing::<u32>::read(dir.path().to_owned()).expect("reads");
        assert_eq!(listing.keys().collect::<Vec<_>>(), [3, 4, 5, 6, 7]);
        let name = |key| listing.get(key).map(|p| p.file_name().map(|n| n.to_os_string()));
        assert_eq!(name(3).expect("found"), Some("0003.png".into()));
        assert_eq!(name(4).expect("found"), Some("000004.TIF".into()));
        assert_eq!(name(7).expect("found"), Some("7.jpeg".into()));
        let message = |key| listing.get(key).expect_err("refused").to_string();
        assert!(message(5).contains("5.exr") && message(5).contains("TIFF"), "{}", message(5));
        assert!(message(6).contains("6.png") && message(6).contains("000006.jpg"), "{}", message(6));
        assert!(message(8).contains("000008.png"), "{}", message(8));
        assert_eq!(<(u32, u32)>::parse("0001_02"), Some((1, 2)));
        let missing = Listing::<u32>::read(dir.path().join("none")).expect("nothing there");
        assert!(missing.is_empty());
    }
}
